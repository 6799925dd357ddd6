"""report.jpg for the README: the report of an evaluated run as a browser shows it, and a whisk's card beside it.

python docs/pictures/take_report.py OUT TRIAL        (needs Chromium)
"""

import sys
from io import BytesIO
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from tests.scenes.chromium import Page  # noqa: E402

SIZE = (920, 1180)
QUALITY = 82


def main(out: Path, trial: str) -> None:
    """Write the picture."""
    shots = []
    for open_card in (False, True):
        with Page(out / "report.html", *SIZE) as page:
            if open_card:
                page.run(
                    f"[...document.querySelectorAll('#table a')].find(a => a.innerText === '{trial}').click()"
                )
            page.screenshot(ROOT / "shot.png", whole=False)
        shots.append(Image.open(BytesIO((ROOT / "shot.png").read_bytes())).convert("RGB"))
        (ROOT / "shot.png").unlink()
    whole = Image.new("RGB", (2 * SIZE[0] + 20, SIZE[1]), "#888888")
    for place, shot in enumerate(shots):
        whole.paste(shot, (place * (SIZE[0] + 20), 0))
    whole.resize((1400, round(1400 * whole.height / whole.width)), Image.Resampling.LANCZOS).save(
        Path(__file__).with_name("report.jpg"), quality=QUALITY
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2])
