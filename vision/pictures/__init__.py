"""Grey pictures: files and videos in order, one camera's view of a whisk, pixel noise, changes.

May import geometry.

`bench` imports the names below from here (see `vision`).
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {
    "files": (
        "FILM_SUFFIXES",
        "PICTURE_SUFFIXES",
        "PicturePart",
        "STACK_SUFFIXES",
        "natural_order",
        "page_count",
        "picture_size",
        "pictures_in",
        "read_picture",
    ),
    "frames": ("Frames",),
    "others": ("Others", "RodLines"),
    "scene_match": ("Likeness", "exposures", "is_blank", "likeness", "texture"),
}
__getattr__ = lazy_names(__name__, NAMES)
