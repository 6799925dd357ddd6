"""What the cameras see: calibrated views, the bar and the wire in space, the contact. Knows no torque.

This is the door through which `bench` sees: it imports the names below, those of the doors
`vision.geometry`, `vision.pictures`, `vision.boards`, `vision.calibration` and `vision.live`, and
nothing behind them (tests/house/test_doors.py). Each name is imported from its module at first use, so that a
command that sees no picture starts without what sees.
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {
    "fit.blocks": ("REST_PRIOR_MM", "WIRE_OFFSET_PX"),
    "fit.covariance": ("CAUSES",),
    "fit.line_noise": ("LineNoise",),
    "fit.refinements": ("ALONG", "LENS_TERMS", "LeftOut"),
    "fit.touch": ("FEWEST_FREE",),
    "fit.turns": ("Turns",),
    "touched.find": ("axis_from_angles",),
    "touched.width": ("SIGMA_SHARE", "bar_diameter_mm", "combine_widths"),
    "truth.at_angle": ("Smooth", "TruthAtAngle"),
    "truth.kept_fit": ("KeptFit",),
    "truth.known_whisk": ("KnownWhisk",),
    "truth.noise_in_pictures": ("CameraPictures", "line_noise_in_pictures"),
    "truth.observe": ("observe_trial", "wire_lines"),
    "truth.observe_traces": ("TrialTraces",),
    "truth.predicted_truth": ("PredictedTruth", "predict_truth"),
    "truth.records": ("FrameTruth", "SharedSigmas", "TrialTruth", "WhiskTruth"),
    "truth.sight_lines": ("sights_of",),
    "truth.trace_points": (
        "BesideWire",
        "Trace",
        "beside_wire",
        "lines_along_wire",
        "points_of_wire",
    ),
    "truth.trial_pictures": ("TrialPictures",),
    "truth.whisker_turns": ("whisker_angles",),
    "truth.value": ("NAN", "UNKNOWN", "Value"),
    "wire.one_sided": ("SeenWidth",),
    "wire.trace": ("NEAR_CLAMP_MM", "lines_of"),
}
__getattr__ = lazy_names(__name__, NAMES)
