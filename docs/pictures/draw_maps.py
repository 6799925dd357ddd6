"""The pictures of docs/maps.md: both maps as the command draws them, small enough for a repository.

python docs/pictures/draw_maps.py [--workers N]
"""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bench.theory.model_error_maps import MAPS, write_map

HERE = Path(__file__).parent
WIDTH_PX = 1400


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--workers", type=int, default=1)
    workers = parser.parse_args().workers
    with TemporaryDirectory() as folder:
        for name in MAPS:
            picture = Image.open(write_map(name, Path(folder), workers=workers)[0]).convert("RGB")
            picture.thumbnail((WIDTH_PX, WIDTH_PX))
            picture.quantize(64).save(HERE / f"error_by_{name}.png", optimize=True)


if __name__ == "__main__":
    main()
