"""Boards in pictures: corners with sigma, faults of a board, whether its views suffice.

May import geometry, pictures.

`bench` imports the names below from here (see `vision`).
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {
    "april_grid": ("AprilGrid",),
    "body": ("Body",),
    "board_optics": ("estimate_optics",),
    "charuco": ("CharucoBoard",),
    "checkerboard": ("Checkerboard",),
    "circle_grid": ("AsymmetricCircles", "CircleGrid"),
    "corners": ("Corners", "find_corners", "refine_corners"),
    "other_markers": ("find_other_markers",),
    "static_board": ("camera_moved",),
    "sufficiency": ("MIN_VIEWS", "fixes_pose"),
}
__getattr__ = lazy_names(__name__, NAMES)
