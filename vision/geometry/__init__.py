"""Space and lenses: cameras, board, rods, centrelines, silhouettes, contact; settings and refusals of vision.

Imports nothing else of vision.

`bench` imports the names below from here (see `vision`).
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {
    "board": ("Board",),
    "camera": ("Camera", "Cameras"),
    "centreline": ("Curves", "REST_POWERS", "centrelines", "unbent_curves", "rotation_z"),
    "contact": ("BarAxis", "axis_frame", "clearance"),
    "crop": ("Crop",),
    "forms": ("touched_object",),
    "lens": ("LENS_TERMS",),
    "number_words": ("counted",),
    "reasons": ("NO_REASON", "Reason", "UNNAMED", "as_reason", "joined"),
    "refusals": ("Refused",),
    "rods": ("Bar", "ProfiledWire", "Rods", "Wire"),
    "rotation": (
        "apply",
        "compose",
        "invert_transform",
        "nearest_rotation",
        "skew",
        "unit",
    ),
    "rounded": ("Rounded", "RoundedAxis"),
    "sampling": ("spread",),
    "touched": ("Axis", "StatedSizes", "Touched"),
    "vision_settings": ("VisionSettings",),
}
__getattr__ = lazy_names(__name__, NAMES)
