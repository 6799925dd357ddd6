"""Cameras from board views: one adjustment with covariance, held-out checks, files, and where the
rig is.

May import geometry, pictures, boards.

`bench` imports the names below from here (see `vision`).
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {
    "board_place": ("place_board",),
    "calibrate": ("Calibration", "CameraReport", "calibrate_cameras"),
    "cameras_file": ("cameras_as_files", "check_crops", "read_cameras"),
    "cameras_import": (
        "WRITERS",
        "are_placed",
        "foreign_cameras",
        "import_cameras",
        "place_on_rig",
    ),
    "held_out": ("Agreement", "HeldOut", "check_held_out"),
    "hub_marker": ("by_marker", "first_axis"),
    "hub_turning": ("FirstRig", "first_rig", "first_rig_about"),
    "hub_turns": ("marker_turns",),
    "kalibr_target": ("read_kalibr_target",),
    "known_distance": ("with_distance",),
    "known_lengths": ("check_known_lengths",),
    "marker_pictures": ("MarkerSighting",),
    "matlab_file": ("load_matlab",),
    "moving_line": ("MovingLines", "moving_lines"),
    "place": (
        "Placement",
        "by_board",
        "check_swing_suffices",
        "combine",
        "move_rig_frame",
        "rescale",
    ),
    "swing": ("by_strokes",),
    "turned": ("with_turns_resolved",),
    "views": ("BoardViews", "MeasuredPose"),
}
__getattr__ = lazy_names(__name__, NAMES)
