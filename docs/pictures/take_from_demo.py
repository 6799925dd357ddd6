"""The README's pictures, out of what `make demo` wrote, small enough for a repository.

make demo && .venv/bin/python docs/pictures/take_from_demo.py
"""

from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
DEMO = HERE.parents[1] / "demo-out"
PICTURES = {"overlays/b30_3_0.png": "overlay.jpg", "planes/b60_4_0.png": "plane.png"}
WIDTH_PX = 1200

for source, name in PICTURES.items():
    picture = Image.open(DEMO / source).convert("RGB")
    picture.thumbnail((WIDTH_PX, WIDTH_PX))
    picture.save(HERE / name, optimize=True, quality=80, subsampling=0)
