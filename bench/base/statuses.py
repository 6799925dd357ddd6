"""Every kind of status that a run can give: one table of codes.

A status is a sentence with numbers for people and a code for programs
(`vision.geometry.reasons.Reason`, `estimator.reasons.NamedReason`). What follows from the code stands
here: how severe it is, and what to do about it. Nothing asks what a sentence says.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from vision.geometry import UNNAMED, Reason, as_reason

# Severities. A note changes neither distance nor moments; a warning flags them; a refusal
# says why there are none.
NOTE = "note"
WARNING = "warning"
REFUSAL = "refusal"

# Numbers of a whisk that a status of the whole session, or of its trial, may speak against.
TRUTH = "truth"
ESTIMATES = "estimates"

_USUAL_CURE = "look at the whisk's card and overlays; docs/truth.md says what the truth needs"

_PUSH_FARTHER = "let the motor turn farther, or take the trial out"
_BEGIN_EARLIER = "begin the recording some 2° of motor angle before touch"
_FRAMES_AT_TOUCH = "record frames all through touch; look for dropped ones"
_SECOND_CAMERA = "place a second camera that sees the bar from another side"
_FASTEN_CAMERA = "fasten the camera, record boards/rig again, and evaluate again"
_CHECK_POSE = "check T_camera_rig in cameras.toml: it takes rig coordinates to the camera's"
_LOOK_AT_CAMERA = "look at the overlays of that camera; if wire or bar is hidden there, move it"
_GIVE_PICTURES = "give frames of the trial and board views, if a truth is wanted"
_RECORD_GAUGES = "record gauge trials in two positions of the follicle, or try --gauges-from-all"
_CHECK_CHANNELS = "check that, and evaluate again"
_CLEARER_TOUCH = "sample faster, push farther after touch, or damp vibration"
_LOOK_AT_ESTIMATOR = "look into the estimator: what it returns is no distance"
_GENTLER = (
    "expected of (10) on steep slopes: touch a gentler one, or tilt the whisker's base towards it"
)
_LOOK_AT_BAR = (
    "look at the overlays: the drawn bar must lie on the bar; add a camera or another light"
)
_FRAMES_LOST = "if that is near touch, record again with a slower frame rate or a faster disk"
_LOOK_AT_FILE = "look at the file that is named; where it is right, nothing is to be done"
_MEASURE_RIG = (
    "measure again by `whisker-bench calibrate rig`, then leave T_rig_board out of session.toml"
)
_LOUDER = "move faster: a soft touch is below the microphone's noise"
_TOUCH_ALL_ROUND = "touch the object from all sides, neighbours less than 180° apart"
_SHOW_MARKER = "place two cameras that see the marker in all frames, and state hub_marker"
_SHOW_BASE = "let two cameras see the first third of the wire in all frames"
_GIVE_ENDS = "give both ends of the object inside the picture, as near to its middle as a few px"
_LOOK_ALONG_OBJECT = "look at the object in the picture: it must be thin, in view, and lit alike"
_MEASURE_BOARD = "measure a square of the board with a caliper, then T_rig_board"


@dataclass(frozen=True)
class Status:
    """A kind of status.

    code: its name in snake_case, which stays when words change. severity: NOTE, WARNING or REFUSAL.
    cure: what to do. sentence: with places for numbers, where bench makes it by `reason`; else it is
    written where its numbers are known. reaches: TRUTH, ESTIMATES or both: said of the session or of a
    trial, it stands in the status of every whisk that has such numbers, and no verdict rests on these
    (`bench.trials.contradictions`).
    """

    code: str
    severity: str
    cure: str = _USUAL_CURE
    sentence: str = ""
    reaches: tuple[str, ...] = ()


# Of several statuses in one line the cure of the first in this table is shown.
_TABLE = (
    Status("never_touches", REFUSAL, _PUSH_FARTHER),
    Status("no_bend_seen", REFUSAL, _PUSH_FARTHER),
    Status("no_rise", REFUSAL, _PUSH_FARTHER),
    Status("starts_touching", REFUSAL, _BEGIN_EARLIER),
    Status("no_free_stroke", REFUSAL, _BEGIN_EARLIER),
    Status("touch_outside_frames", REFUSAL, _FRAMES_AT_TOUCH),
    Status("frame_lost_at_touch", REFUSAL, _FRAMES_AT_TOUCH),
    Status("pushed_short", NOTE, "push farther, or evaluate at a smaller --theta-deg"),
    Status(
        "slips_in_jumps",
        NOTE,
        "expected of stick–slip: slip lies between those frames; more frames a second narrow it",
    ),
    Status(
        "rod_hidden",
        REFUSAL,
        "free the sight: nothing else may stand before or behind wire and bar",
    ),
    Status("marker_not_seen", REFUSAL, _SHOW_MARKER),
    Status("marker_not_fitted", REFUSAL, _SHOW_MARKER),
    Status("base_not_seen", REFUSAL, _SHOW_BASE),
    Status("base_not_converged", REFUSAL, _SHOW_BASE),
    Status("end_outside", REFUSAL, _GIVE_ENDS),
    Status("ends_together", REFUSAL, _GIVE_ENDS),
    Status("no_line", REFUSAL, _GIVE_ENDS),
    Status("hidden", REFUSAL, _LOOK_ALONG_OBJECT),
    Status("light_not_explained", REFUSAL, _LOOK_ALONG_OBJECT),
    Status("not_converged", REFUSAL, _LOOK_ALONG_OBJECT),
    Status("two_explanations", REFUSAL, _LOOK_AT_BAR),
    Status("bar_elsewhere", WARNING, _LOOK_AT_BAR),
    Status("bar_unconverged", WARNING, _LOOK_AT_BAR),
    Status(
        "camera_lines_scatter",
        WARNING,
        "look at the overlays: a shadow, a reflection, or another thing is taken for the wire",
    ),
    Status("slope_vague", WARNING, _SECOND_CAMERA),
    Status("single_camera", REFUSAL, _SECOND_CAMERA),
    Status(
        "slip_vague",
        REFUSAL,
        "bring a camera nearer, or place one that does not look along the bar",
    ),
    Status(
        "camera_late",
        WARNING,
        "look at which of that camera's pictures is the first, and number them so that all cameras' agree",
        reaches=(TRUTH,),
    ),
    Status("camera_moved", WARNING, _FASTEN_CAMERA),
    Status("cameras_contradict", WARNING, _FASTEN_CAMERA),
    Status("whisker_behind_camera", WARNING, _CHECK_POSE),
    Status("bar_behind_camera", REFUSAL, _CHECK_POSE),
    Status("all_cameras_behind", REFUSAL, _CHECK_POSE),
    Status("camera_left_out", WARNING, _LOOK_AT_CAMERA),
    Status("camera_with_few_frames", WARNING, _LOOK_AT_CAMERA),
    Status(
        "no_beam",
        WARNING,
        "check that one thing alone touches the whisker, and that it is not kinked; see beam.csv",
    ),
    Status(
        "bend_onset_vague",
        REFUSAL,
        "let two cameras see the whisker, one of them along the motor's axis",
    ),
    Status(
        "no_whisker_seen",
        REFUSAL,
        "check the motor's zero, T_rig_board and [whisker] diameter_mm; see the overlays",
    ),
    Status(
        "fit_not_converged",
        REFUSAL,
        "look at the frames of this trial; if they are sound, please report it with them",
    ),
    Status("no_pictures", NOTE, _GIVE_PICTURES, sentence="no pictures"),
    Status("stated_in_other_unit", WARNING, "write millimetres", reaches=(ESTIMATES,)),
    Status(
        "slip_not_seen",
        NOTE,
        _GIVE_PICTURES,
        sentence="the truth is a stage's: touch, slip and deflection are not seen",
    ),
    Status("stage_fits_nothing", NOTE, sentence="a stage's truth rests on no fit"),
    Status(
        "stage_says_nothing",
        REFUSAL,
        "state one of them in trial.toml, or take [truth] out of session.toml",
        sentence="neither d_x_mm, point_mm of [object] nor stage.csv says where the object stands",
    ),
    Status(
        "stage_unlike_pictures",
        WARNING,
        "measure the stage's origin against the whisker's base; look at the overlays",
        reaches=(TRUTH,),
    ),
    Status(
        "stage_unlike_felt",
        WARNING,
        "compare stage.csv or point_mm with those of its neighbours, and its unit and axes",
        sentence="judged by the other whisks, touch and moments place it elsewhere than the stage does: {apart}; as if {causes}",
        reaches=(TRUTH,),
    ),
    Status(
        "stage_unlike_all_felt",
        WARNING,
        "measure the stage's origin against the whisker's base anew; check stiffness and gains",
        sentence="touch and moments of all whisks together contradict the stage: as if {causes}",
        reaches=(TRUTH,),
    ),
    Status(
        "distance_unlike_stated",
        WARNING,
        "leave out d_x_mm or the place, whichever is not measured",
        reaches=(TRUTH,),
    ),
    Status(
        "object_points_not_read",
        WARNING,
        _LOOK_AT_FILE,
        sentence="{label} is not read: the object is found in the pictures, or there are no traces",
    ),
    Status(
        "stage_not_read",
        WARNING,
        _LOOK_AT_FILE,
        sentence="{label} is not read; where it is the truth, {cure}",
    ),
    Status(
        "motor_zero_unknown",
        NOTE,
        "record motor_deg, or let a stage say where the contact is",
        sentence="the motor's angle counts from the recording's start, not from where pictures have its zero: no truth by them",
    ),
    Status("camera_unused", WARNING, _GIVE_PICTURES),
    Status(
        "no_gauges",
        REFUSAL,
        _RECORD_GAUGES,
        sentence="no gauges: there is no gauges.toml, [gauges] or usable gauge trial",
    ),
    Status(
        "own_gauges",
        REFUSAL,
        _RECORD_GAUGES,
        sentence="not judged: without this trial the gauges are not known",
    ),
    Status(
        "gauge_rod_unconverged",
        NOTE,
        "look at the whisk's overlays, and at the whisker's sizes in session.toml",
        sentence="no rod of the stated sizes bends as this whisker does ({problem}): its moments are held against no gauge",
    ),
    Status(
        "gauge_moments_unknown",
        NOTE,
        sentence="its moments are not known: it calibrates no gauge",
    ),
    Status(
        "gauge_push_short",
        NOTE,
        sentence="the gauges do not show a push of {degrees:.2g}°: it calibrates no gauge",
    ),
    Status("gauges_undetermined", WARNING, _RECORD_GAUGES),
    Status("gauge_fault", WARNING, _CHECK_CHANNELS),
    Status(
        "moments_implausible",
        WARNING,
        "check the unit of m_y_Nmm and m_z_Nmm, and [whisker]",
        reaches=(ESTIMATES,),
    ),
    Status("force_reversed", WARNING, _CHECK_CHANNELS),
    Status(
        "signals_exchanged",
        WARNING,
        _CHECK_CHANNELS,
        sentence="the signals of trials {names} look exchanged: "
        "each has the moments of the shape seen in the other",
    ),
    Status(
        "pictures_exchanged",
        WARNING,
        "find the recordings that belong to these trials, and copy them anew",
        sentence="the pictures of trials {names} look exchanged, or their trial.toml: "
        "each shows the slope that the other states",
    ),
    Status(
        "shape_not_felt",
        WARNING,
        "compare the card's moments; check that the bar touches nothing but the whisker",
    ),
    Status(
        "beyond_calibration", WARNING, "calibrate the gauges with larger deflections, or push less"
    ),
    Status(
        "samples_saturated", WARNING, "lower the amplifier's gain", sentence="{samples} left out"
    ),
    Status("onset_vague", REFUSAL, _CLEARER_TOUCH),
    Status("rise_too_short", REFUSAL, _CLEARER_TOUCH),
    Status("too_few_samples", REFUSAL, _CLEARER_TOUCH),
    Status(
        "past_whisker",
        WARNING,
        "expected where the push breaks what the estimator assumes; else check its units",
        sentence="gave {d_x_mm:.1f} mm, past the whisker's length of {length_mm:g} mm",
    ),
    Status(
        "longer_than_whisker",
        WARNING,
        "expected where the contact slips, which (2) ignores: take (10)",
    ),
    Status(
        "tip_contact",
        WARNING,
        "take it as a contact near the tip; a touch nearer to the base is measured better",
    ),
    Status(
        "no_distance_given", REFUSAL, _LOOK_AT_ESTIMATOR, sentence="gave no distance and no reason"
    ),
    Status(
        "distance_impossible",
        REFUSAL,
        _LOOK_AT_ESTIMATOR,
        sentence="gave {d_x_mm:g} mm, which is no distance",
    ),
    Status("estimator_raised", REFUSAL, _LOOK_AT_ESTIMATOR, sentence="{name} raised {fault}"),
    Status(
        "sigma_impossible",
        WARNING,
        _LOOK_AT_ESTIMATOR,
        sentence="gave a sigma of {sigma_mm:g} mm, which is none",
    ),
    Status(
        "touch_apart",
        WARNING,
        "check how frames are stamped, and record strokes at two speeds or with their way back",
    ),
    Status(
        "whisks_scatter", WARNING, "fasten bar and hub: whisks of one recording should give one d_x"
    ),
    Status("frames_damaged", WARNING, _FRAMES_LOST),
    Status("exposure_changed", WARNING, "fix exposure, gain and light, and record the trial again"),
    Status("rows_repeated", WARNING, _FRAMES_LOST),
    Status(
        "rate_unlike_header", WARNING, "look which is right; frame_rate_Hz in trial.toml settles it"
    ),
    Status(
        "signals_copied",
        WARNING,
        "find the recordings that belong to these trials, and copy them anew",
        sentence="trials {names} have the same {file}: all but one of them hold a copy",
        reaches=(TRUTH, ESTIMATES),
    ),
    Status("signals_mended", WARNING, _LOOK_AT_FILE, sentence="{label}: {count} {cause} mended"),
    Status(
        "whisker_curved",
        WARNING,
        "take the exact rod's estimate, or touch it near its base",
        sentence="the whisker turns by {turn_deg:.0f}° up to its tip, and all estimates but the exact rod's take "
        "it as straight: (10) errs by up to {d_x_percent:.1f} % at the tip, and nearer to the base by less, as the "
        "square of the distance",
    ),
    Status("speed_unlike_stated", WARNING, _LOOK_AT_FILE),
    Status(
        "frames_without_signals", WARNING, "start the DAQ before the cameras and stop it after them"
    ),
    Status(
        "no_forward_stroke",
        WARNING,
        "take the trial out, or let the motor turn forward in it",
        sentence="{label}: no forward stroke of the motor, so no whisk",
    ),
    Status("board_misplaced", WARNING, _MEASURE_BOARD, reaches=(TRUTH,)),
    Status("scale_unconfirmed", WARNING, _MEASURE_BOARD, reaches=(TRUTH,)),
    Status("swing_narrow", WARNING, "record wider free strokes, or measure T_rig_board"),
    Status(
        "boards_not_at_once", WARNING, "record views of a board at rest, or trigger the cameras"
    ),
    Status(
        "boards_exchanged",
        REFUSAL,
        "give each camera the board views and the rig picture that it took",
    ),
    Status(
        "board_stretched",
        WARNING,
        "measure many squares along x and along y; print without scaling, or state the difference",
    ),
    Status(
        "pixels_not_square",
        WARNING,
        "state pixel_aspect in [[cameras]], or record without squashing",
    ),
    Status(
        "rig_file_contradicts",
        WARNING,
        _MEASURE_RIG,
        sentence="rig.toml: {alarm}; {counts}",
        reaches=(TRUTH,),
    ),
    Status("bar_width_unlike_board", WARNING, _MEASURE_BOARD, reaches=(TRUTH,)),
    Status("bends_from_start", REFUSAL, _BEGIN_EARLIER),
    Status(
        "moving_object_not_straight",
        REFUSAL,
        "record a straight bar where the object moves or gives way",
    ),
    Status("moving_object_many_whisks", REFUSAL, "record each whisk by itself"),
    Status("moving_object_from_one_side", REFUSAL, _SECOND_CAMERA),
    Status("object_from_one_side", REFUSAL, _SECOND_CAMERA),
    Status("no_shared_frame", REFUSAL),
    Status("no_shared_first_frame", REFUSAL),
    Status("too_few_frames", REFUSAL),
    Status("no_camera_with_frames", REFUSAL),
    Status("no_bar_seen", REFUSAL),
    Status("bar_distance_unseen", REFUSAL),
    Status(
        "trace_elsewhere",
        REFUSAL,
        "look whether the trace is of this trial and camera, and neither mirrored nor turned",
    ),
    Status(
        "object_points_elsewhere",
        REFUSAL,
        "look whether both are of this trial, and points on the object's middle or on both its edges",
    ),
    Status("no_object_seen", REFUSAL),
    Status("object_in_two_places", REFUSAL),
    Status("no_object_edge", REFUSAL),
    Status("no_object_outline", REFUSAL),
    Status("picture_size_differs", REFUSAL),
    Status("refused", REFUSAL),
    Status(
        "trial_lost",
        REFUSAL,
        sentence="no result: the process that evaluated the trial died {deaths} times, as it does "
        "where memory runs out; the same command tries again",
    ),
    Status("light_unexplained", WARNING),
    Status("no_touching_frame", NOTE),
    Status("bar_width_unlike_stated", WARNING, reaches=(TRUTH,)),
    Status("wire_width_unlike_stated", WARNING, reaches=(TRUTH,)),
    Status("length_unlike_stated", NOTE, "measure length_mm again: no estimate goes beyond it"),
    Status("slope_unlike_stated", WARNING, reaches=(TRUTH,)),
    Status("turns_unlike_motor", WARNING, reaches=(TRUTH,)),
    Status("friction_too_large", WARNING, reaches=(TRUTH,)),
    Status(
        "wire_off_its_base",
        WARNING,
        sentence="its wire starts {beside_mm:.1f} mm beside its base, check base_mm",
        reaches=(TRUTH,),
    ),
    Status(
        "wire_of_another", WARNING, sentence="its wire may be that of {names}", reaches=(TRUTH,)
    ),
    Status("no_free_force", REFUSAL),
    Status("angle_not_reached", REFUSAL),
    Status(
        "gauges_at_rail",
        REFUSAL,
        sentence="the gauges are at their rail at the pushing angle: "
        "raise their range, or ask for a smaller --theta-deg",
    ),
    Status("no_way_back", REFUSAL, sentence="no way back was recorded"),
    Status(
        "deflection_impossible", WARNING, sentence="gave a deflection of {given}, which is none"
    ),
    Status("only_nearer_known", WARNING, _GENTLER),
    Status("two_distances", WARNING),
    Status("motion_not_stated", REFUSAL),
    Status("object_runs_away", REFUSAL),
    Status("no_force_recorded", REFUSAL),
    Status("no_moment_rate", REFUSAL),
    Status("phi_turns", WARNING),
    Status("frame_count_unlike_header", WARNING),
    Status("first_frame_not_stated", WARNING),
    Status("clock_of_container", WARNING),
    Status("surface_unused", WARNING),
    Status(
        "wire_not_shown",
        REFUSAL,
        sentence="the camera shows nothing of this whisk's wire, or was left out",
    ),
    Status("value_missing", REFUSAL),
    Status("angle_not_positive", REFUSAL),
    Status("angle_too_large", REFUSAL),
    Status("slope_too_steep", REFUSAL),
    Status("not_pushing", REFUSAL),
    Status("moments_up_slope", REFUSAL),
    Status("beyond_friction", REFUSAL, _GENTLER),
    Status(
        "rod_unconverged",
        REFUSAL,
        "take (10) there, and look at the friction angle and at [whisker]",
    ),
    Status("distance_out_of_range", REFUSAL),
    Status("force_unlike_moment", REFUSAL),
    Status("never_slipped", REFUSAL),
    Status("friction_vague", REFUSAL),
    Status("friction_at_zero", WARNING),
    Status("friction_below_zero", WARNING),
    Status(
        "friction_at_bound",
        REFUSAL,
        sentence="at the bound of the search, {bound_deg:.1f}°: no angle between fits",
    ),
    Status("tilts_one_sided", REFUSAL),
    Status("still_slips", WARNING, "turn the plane once more"),
    Status("whisker_does_not_ring", REFUSAL),
    Status("ring_not_of_a_prop", REFUSAL),
    Status("not_a_straight_cylinder", REFUSAL),
    Status("no_unfiltered_samples", REFUSAL),
    Status("two_places_ring_alike", WARNING),
    Status("nothing_heard", REFUSAL, _LOUDER),
    Status(
        "moment_does_not_vanish",
        REFUSAL,
        "calibrate the load cell, and state the whisker's stiffness",
    ),
    Status("curved_unloaded", REFUSAL, "use (10) or exact_rod for a curved whisker"),
    Status("contour_open", REFUSAL, _TOUCH_ALL_ROUND),
    Status("whisks_slip_alike", REFUSAL),
    Status("whisks_unconverged", REFUSAL),
    Status("whisk_not_pushing", REFUSAL),
    Status("ways_alike", REFUSAL),
    Status("no_push_one_way", REFUSAL),
    Status("distance_nowhere", REFUSAL),
    Status("whisker_points_few", REFUSAL),
    Status("pushing_angle_unseen", REFUSAL),
    Status("bending_plane_unknown", WARNING),
    Status("shape_unconverged", REFUSAL),
    Status("bend_end_unseen", REFUSAL),
    Status(
        "angles_few",
        REFUSAL,
        sentence="needs moments at {least} pushing angles a degree apart: push further",
    ),
    Status("phi_turns_far", REFUSAL, sentence="phi turns by {degrees:.0f} degrees: too far"),
    Status("distances_missing", REFUSAL, sentence="(10) gives no distance at one of the angles"),
    Status("no_lateral_slip", NOTE, sentence="does not slip sideways: no lateral curvature"),
    Status("not_soft", NOTE, sentence="no softer than a rigid object within the noise"),
    Status("compliances_contradict", REFUSAL, sentence="no distance explains both compliances"),
    Status(
        "recordings_few",
        REFUSAL,
        sentence="needs more recordings than unknowns: else no sigma is known",
    ),
    Status("slopes_one_sided", REFUSAL, sentence="needs nominal slopes (beta_deg) of both signs"),
    Status(
        "whisks_few",
        REFUSAL,
        sentence="needs {least} whisks or more at one nominal distance (d_x_mm)",
    ),
    Status(
        "one_nominal_distance",
        REFUSAL,
        sentence="needs whisks at two nominal distances (d_x_mm) or more",
    ),
    Status(
        "no_push_on_object", REFUSAL, sentence="one of the whisks does not push against an object"
    ),
    Status("slip_angles_alike", REFUSAL, sentence="the whisks do not span two slip angles"),
    Status("no_truth", REFUSAL, sentence="no truth"),
    Status("effect_not_fitted", REFUSAL, sentence="the fit does not determine this effect"),
    Status(
        "clock_like_zero",
        REFUSAL,
        sentence="strokes at one speed and in one direction do not separate a late clock from a shifted zero",
    ),
    Status("bar_radius_unknown", REFUSAL, sentence="no bar diameter or friction angle is known"),
    Status("tilt_unknown", REFUSAL, sentence="no tilt is known"),
    Status("slope_unknown", REFUSAL, sentence="no slope is known"),
    Status("factors_unknown", REFUSAL, sentence="no gauges with one factor a channel are known"),
    Status(
        "drift_not_removed",
        NOTE,
        sentence="no free strokes before and after the contact, so no drift was taken out",
    ),
    Status("no_stick_slip", NOTE, sentence="the moments show no stick–slip"),
    Status("contacts_few", REFUSAL, sentence="too few, of {distances}"),
    Status("size_open", REFUSAL, sentence="contacts leave the size open"),
    Status("size_may_be_zero", WARNING, sentence="not known: the interval holds 0"),
    Status(
        "contacts_off_surface",
        WARNING,
        sentence="contacts lie farther off such a surface than their sigmas explain (chance {chance:.1g})",
    ),
    Status("unnamed", WARNING),
)

STATUSES = {status.code: status for status in _TABLE}
_RANK = {status.code: rank for rank, status in enumerate(_TABLE)}


def status_of_code(code: str) -> Status:
    """Return the kind of status of a code; that without a name where the code is not known."""
    return STATUSES.get(code, STATUSES[UNNAMED])


def reason(code: str, **numbers: object) -> Reason:
    """Return the status of a code, its sentence from the table with numbers filled in."""
    return Reason(code, STATUSES[code].sentence.format(**numbers))


def reaching(numbers: Collection[str], said: Reason) -> Reason:
    """Return the parts of a reason whose codes speak against one of these numbers."""
    found = []
    for code, sentence in said.parts:
        if set(numbers).intersection(status_of_code(code).reaches):
            found.append((code, sentence))
    return Reason.of_parts(found)


def has_only_notes(text: str) -> bool:
    """Return whether a status has notes alone, which change neither distance nor moments."""
    return all(status_of_code(code).severity == NOTE for code in as_reason(text).codes)


def cure_of(codes: Iterable[str]) -> str:
    """Return what to do about these codes: the cure of the one that stands first in the table."""
    known = [code if code in STATUSES else UNNAMED for code in codes]
    first = min(known, key=_RANK.__getitem__, default=UNNAMED)
    return STATUSES[first].cure
