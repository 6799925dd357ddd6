"""What to do about what is doubtful: the first cure whose pattern the line holds."""

import re

_CURES = (
    (r"never touches", "let the motor turn farther, or take the trial out"),
    (
        r"touches from the start|touching from the start",
        "begin the recording some 2° of motor angle before touch",
    ),
    (
        r"touch lies outside the frames|at touch was lost",
        "record frames all through touch; look for dropped ones",
    ),
    (r"pushed to .* deg only", "push farther, or evaluate at a smaller --theta-deg"),
    (
        r"slips in jumps",
        "expected of stick–slip: slip lies between those frames; more frames a second narrow it",
    ),
    (
        r"clear of the (wire|bar)|enough of the",
        "free the sight: nothing else may stand before or behind wire and bar",
    ),
    (
        r"scatter by .* px",
        "look at the overlays: a shadow, a reflection, or another thing is taken for the wire",
    ),
    (
        r"slope is known to|single camera",
        "place a second camera that sees the bar from another side",
    ),
    (r"slip is known to", "bring a camera nearer, or place one that does not look along the bar"),
    (r"moved and was left out", "fasten the camera, record boards/rig again, and evaluate again"),
    (
        r"by its pose",
        "check T_camera_rig in cameras.toml: it takes rig coordinates to the camera's",
    ),
    (
        r"was left out",
        "look at the overlays of that camera; if wire or bar is hidden there, move it",
    ),
    (
        r"bend as a beam",
        "check that one thing alone touches the whisker, and that it is not kinked; see beam.csv",
    ),
    (
        r"no bend of the whisker|begins to bend",
        "let two cameras see the whisker, one of them along the motor's axis",
    ),
    (
        r"no whisker is seen",
        "check the motor's zero, T_rig_board and [whisker] diameter_mm; see the overlays",
    ),
    (
        r"does not settle",
        "look at the frames of this trial; if they are sound, please report it with them",
    ),
    (r"no pictures", "give frames of the trial and board views, if a truth is wanted"),
    (
        r"no gauges|not judged",
        "record gauge trials in two positions of the follicle, or try --gauges-from-all",
    ),
    (
        r"exchanged|reversed|slipped|follicle looks turned|as stiff",
        "check that, and evaluate again",
    ),
    (
        r"not those of the seen shape",
        "compare the card's moments; check that the bar touches nothing but the whisker",
    ),
    (r"beyond the .* calibrated", "calibrate the gauges with larger deflections, or push less"),
    (r"saturated", "lower the amplifier's gain"),
    (
        r"no clear onset|too near the end|too few samples",
        "sample faster, push farther after touch, or damp vibration",
    ),
    (
        r"past the whisker|longer than the whisker|no distance|raised|sigma",
        "look at the estimator: its answer is none",
    ),
    (
        r"touch felt less seen",
        "check how frames are stamped, and record strokes at two speeds or with their way back",
    ),
    (r"scatter .* in d_x", "fasten bar and hub: whisks of one recording should give one d_x"),
    (
        r"dropped|damaged|cannot be read",
        "record again with a slower frame rate or a faster disk, if it is near touch",
    ),
    (r"header of .* says", "look which is right; frame_rate_Hz in trial.toml settles it"),
    (r"one and the same", "find the recordings that belong to these trials, and copy them anew"),
    (
        r"mended|is a .*, not|speed",
        "look at the file that is named; where it is meant so, nothing is to be done",
    ),
    (r"taken while no signals", "start the DAQ before the cameras and stop it after them"),
    (r"no forward stroke", "take the trial out, or let the motor turn forward in it"),
    (
        r"T_rig_board|square_mm|centre",
        "measure a square of the board with a caliper, then T_rig_board",
    ),
)
_OTHERWISE = "look at the whisk's card and overlays; docs/truth.md says what the truth needs"


def cure_of(doubt: str) -> str:
    """One sentence on what to do."""
    return next((cure for pattern, cure in _CURES if re.search(pattern, doubt)), _OTHERWISE)
