"""Overlays as small pictures inside the page; beyond a number of whisks they stay in their own files."""

import io
from base64 import b64encode
from pathlib import Path
from urllib.parse import quote

from PIL import Image

MOST_INSIDE = 200  # whisks; beyond, the page would be larger than a browser likes to open
# [bytes] Of one picture: 100 of them, two a whisk, are 4.9 MB in base64, as a page of 50 whisks may have.
MOST_BYTES = 36_000
_WIDTHS_PX = (1100, 900, 700, 500, 350, 250)
_QUALITY = 62


def picture_source(out: Path, name: str, whisks: int) -> str:
    """Return the `src` of a picture of the folder: itself as WebP, or where it is.

    Empty where it is not there. whisks: how many the page has.
    """
    path = out / name
    if not path.is_file():
        return ""
    if whisks > MOST_INSIDE:
        return quote(name)
    return "data:image/webp;base64," + b64encode(_as_webp(path)).decode()


def _as_webp(path: Path) -> bytes:
    """Return the picture as WebP of at most MOST_BYTES, as wide as that allows."""
    with Image.open(path) as picture:
        whole = picture.convert("RGB")
    for width in _WIDTHS_PX:
        scale = min(1.0, width / whole.width)
        size = (round(scale * whole.width), round(scale * whole.height))
        buffer = io.BytesIO()
        whole.resize(size, Image.Resampling.HAMMING).save(
            buffer, "WEBP", quality=_QUALITY, method=2
        )
        if buffer.tell() <= MOST_BYTES:
            break
    return buffer.getvalue()
