"""Every kind of status that a run can give: one table of codes.

A status is a sentence with numbers for people, made where the numbers are known, and a code for
programs (`vision.geometry.reasons.Reason`, `estimator.reasons.NamedReason`). What follows from it
stands here: how severe it is, and what to do about it. Nothing else asks what a sentence says.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from vision.geometry import UNNAMED, Reason, as_reason

# Severities. A note leaves distance and moments what they are; a warning flags them; a
# refusal says why there are none.
NOTE = "note"
WARNING = "warning"
REFUSAL = "refusal"

# Numbers of a whisk that a status of the whole session, or of its trial, puts in doubt.
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
_LOOK_AT_ESTIMATOR = "look at the estimator: its answer is none"
_GENTLER = (
    "expected of (10) on steep slopes: touch a gentler one, or tilt the whisker's base towards it"
)
_LOOK_AT_BAR = (
    "look at the overlays: the drawn bar must lie on the bar; add a camera or another light"
)
_FRAMES_LOST = "record again with a slower frame rate or a faster disk, if it is near touch"
_LOOK_AT_FILE = "look at the file that is named; where it is meant so, nothing is to be done"
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
    sentence: with places for numbers where bench makes it by `reason`; else what it says in general,
    and the sentence itself is made where its numbers are known. cure: what to do. reaches: TRUTH,
    ESTIMATES or both: said of the session or of a trial, it stands in the status of every whisk that
    has such numbers, and no verdict rests on these (`bench.trials.contradictions`).
    """

    code: str
    severity: str
    sentence: str
    cure: str = _USUAL_CURE
    reaches: tuple[str, ...] = ()


# Of several statuses in one line the cure of the first in this table is shown.
_TABLE = (
    Status("never_touches", REFUSAL, "the whisker never touches", _PUSH_FARTHER),
    Status("no_bend_seen", REFUSAL, "no bend of the whisker is seen", _PUSH_FARTHER),
    Status(
        "no_rise",
        REFUSAL,
        "never touches: the moments do not rise above their noise",
        _PUSH_FARTHER,
    ),
    Status(
        "starts_touching",
        REFUSAL,
        "touches from the start: fewer than two frames of free stroke",
        _BEGIN_EARLIER,
    ),
    Status(
        "no_free_stroke",
        REFUSAL,
        "touching from the start: no free stroke to measure the rise from",
        _BEGIN_EARLIER,
    ),
    Status("touch_outside_frames", REFUSAL, "touch lies outside the frames", _FRAMES_AT_TOUCH),
    Status("frame_lost_at_touch", REFUSAL, "a frame at touch was lost", _FRAMES_AT_TOUCH),
    Status(
        "pushed_short",
        NOTE,
        "not pushed as far as the wanted angle",
        "push farther, or evaluate at a smaller --theta-deg",
    ),
    Status(
        "slips_in_jumps",
        NOTE,
        "slips in jumps at the wanted angle",
        "expected of stick–slip: slip lies between those frames; more frames a second narrow it",
    ),
    Status(
        "rod_hidden",
        REFUSAL,
        "no camera shows enough of wire or bar",
        "free the sight: nothing else may stand before or behind wire and bar",
    ),
    Status("marker_not_seen", REFUSAL, "the hub's marker is not seen often enough", _SHOW_MARKER),
    Status(
        "marker_not_fitted", REFUSAL, "the marker's turns are no turns about one axis", _SHOW_MARKER
    ),
    Status("base_not_seen", REFUSAL, "the wire's base is not seen", _SHOW_BASE),
    Status(
        "base_not_converged", REFUSAL, "the angles of the wire's base do not converge", _SHOW_BASE
    ),
    Status("end_outside", REFUSAL, "an end lies outside the picture", _GIVE_ENDS),
    Status("ends_together", REFUSAL, "the ends are too near to each other", _GIVE_ENDS),
    Status("no_line", REFUSAL, "no object joins the ends", _GIVE_ENDS),
    Status("hidden", REFUSAL, "too little of the object is seen", _LOOK_ALONG_OBJECT),
    Status(
        "light_not_explained",
        REFUSAL,
        "the light along the line is not that of a lit rod",
        _LOOK_ALONG_OBJECT,
    ),
    Status("not_converged", REFUSAL, "the line does not converge", _LOOK_ALONG_OBJECT),
    Status(
        "two_explanations",
        REFUSAL,
        "the bar at another place explains the pictures equally well",
        _LOOK_AT_BAR,
    ),
    Status(
        "bar_elsewhere",
        WARNING,
        "another place of the bar explains more of the pictures, or as much",
        _LOOK_AT_BAR,
    ),
    Status(
        "bar_unconverged",
        WARNING,
        "the bar's place did not converge",
        _LOOK_AT_BAR,
    ),
    Status(
        "camera_lines_scatter",
        WARNING,
        "a camera's lines of the wire scatter, and it was left out",
        "look at the overlays: a shadow, a reflection, or another thing is taken for the wire",
    ),
    Status("slope_vague", WARNING, "the bar's slope is hardly known", _SECOND_CAMERA),
    Status("single_camera", REFUSAL, "a single camera sees wire and bar", _SECOND_CAMERA),
    Status(
        "slip_vague",
        REFUSAL,
        "slip is hardly known",
        "bring a camera nearer, or place one that does not look along the bar",
    ),
    Status(
        "camera_late",
        WARNING,
        "a camera shows each frame some frames later than the others",
        "look at which of that camera's pictures is the first, and number them so that all cameras' agree",
        reaches=(TRUTH,),
    ),
    Status("camera_moved", WARNING, "a camera moved and was left out", _FASTEN_CAMERA),
    Status("cameras_contradict", WARNING, "the cameras contradict each other", _FASTEN_CAMERA),
    Status(
        "whisker_behind_camera", WARNING, "by a camera's pose the whisker is behind it", _CHECK_POSE
    ),
    Status("bar_behind_camera", REFUSAL, "by a camera's pose the bar is behind it", _CHECK_POSE),
    Status("all_cameras_behind", REFUSAL, "all cameras have the whisker behind them", _CHECK_POSE),
    Status(
        "camera_left_out",
        WARNING,
        "a camera shows another scene, or nothing, and was left out",
        _LOOK_AT_CAMERA,
    ),
    Status(
        "camera_with_few_frames",
        WARNING,
        "a camera has few of the frames, and was left out",
        _LOOK_AT_CAMERA,
    ),
    Status(
        "no_beam",
        WARNING,
        "the wire does not bend as a beam with a point load",
        "check that one thing alone touches the whisker, and that it is not kinked; see beam.csv",
    ),
    Status(
        "bend_onset_vague",
        REFUSAL,
        "it is hardly known when the whisker begins to bend",
        "let two cameras see the whisker, one of them along the motor's axis",
    ),
    Status(
        "no_whisker_seen",
        REFUSAL,
        "no whisker is seen where the motor angle says it should be",
        "check the motor's zero, T_rig_board and [whisker] diameter_mm; see the overlays",
    ),
    Status(
        "fit_not_converged",
        REFUSAL,
        "the fit of wire and bar does not converge",
        "look at the frames of this trial; if they are sound, please report it with them",
    ),
    Status("no_pictures", NOTE, "no pictures", _GIVE_PICTURES),
    Status(
        "stated_in_other_unit",
        WARNING,
        "the stage's distance is what (10) estimates, in another unit",
        "write millimetres",
        reaches=(ESTIMATES,),
    ),
    Status(
        "slip_not_seen",
        NOTE,
        "the truth is a stage's: touch, slip and deflection are not seen",
        _GIVE_PICTURES,
    ),
    Status("stage_fits_nothing", NOTE, "a stage's truth rests on no fit"),
    Status(
        "stage_says_nothing",
        REFUSAL,
        "neither d_x_mm, point_mm of [object] nor stage.csv says where the object stands",
        "state one of them in trial.toml, or take [truth] out of session.toml",
    ),
    Status(
        "stage_unlike_pictures",
        WARNING,
        "the stage and the pictures have the contact in different places",
        "measure the stage's origin against the whisker's base; look at the overlays",
        reaches=(TRUTH,),
    ),
    Status(
        "stage_unlike_felt",
        WARNING,
        "touch felt is {apart}° from touch by the stage, as the other whisks have it: is the place of another trial?",
        "compare stage.csv or point_mm with those of its neighbours, and its unit and axes",
        reaches=(TRUTH,),
    ),
    Status(
        "distance_unlike_stated",
        WARNING,
        "the object's place and d_x_mm have the contact in different places",
        "take out the one that is not measured",
        reaches=(TRUTH,),
    ),
    Status(
        "object_points_not_read",
        WARNING,
        "{label} is not read: the object is found in the pictures, or there are no traces",
        _LOOK_AT_FILE,
    ),
    Status(
        "stage_not_read",
        WARNING,
        "{label} is not read; where it is the truth, {cure}",
        _LOOK_AT_FILE,
    ),
    Status(
        "motor_zero_unknown",
        NOTE,
        "the motor's angle counts from the recording's start, and pictures have another zero: no truth by them",
        "record motor_deg, or let a stage say where the contact is",
    ),
    Status("camera_unused", WARNING, "a camera of the manifest has no pictures", _GIVE_PICTURES),
    Status(
        "no_gauges",
        REFUSAL,
        "no gauges: there is no gauges.toml, [gauges] or usable gauge trial",
        _RECORD_GAUGES,
    ),
    Status(
        "own_gauges",
        REFUSAL,
        "not judged: without this trial the gauges are not known",
        _RECORD_GAUGES,
    ),
    Status(
        "gauge_rod_unconverged",
        NOTE,
        "no rod of the stated whisker is bent as this one is ({problem}): it is compared with no gauge",
        "look at the whisk's overlays, and at the whisker's sizes in session.toml",
    ),
    Status("gauge_moments_unknown", NOTE, "no moment is known of this whisk: no gauge rests on it"),
    Status(
        "gauge_push_short",
        NOTE,
        "a push of {degrees:.2g}° is not felt in this whisk: no gauge rests on it",
    ),
    Status(
        "gauges_undetermined",
        WARNING,
        "the gauge trials do not fix the gauges' coefficients",
        _RECORD_GAUGES,
    ),
    Status(
        "gauge_fault",
        WARNING,
        "felt moments are not those of the seen shape, by a fault of the gauges",
        _CHECK_CHANNELS,
    ),
    Status(
        "moments_implausible",
        WARNING,
        "moments are not of the size that this whisker can give",
        "check the unit of m_y_Nmm and m_z_Nmm, and [whisker]",
        reaches=(ESTIMATES,),
    ),
    Status(
        "force_reversed",
        WARNING,
        "no friction holds the whisker at this angle, unless a channel is reversed",
        _CHECK_CHANNELS,
    ),
    Status(
        "signals_exchanged",
        WARNING,
        "the signals of trials {names} look exchanged: "
        "each has the moments of the shape seen in the other",
        _CHECK_CHANNELS,
    ),
    Status(
        "pictures_exchanged",
        WARNING,
        "the pictures of trials {names} look exchanged, or their trial.toml: "
        "each shows the slope that the other states",
        "find the recordings that belong to these trials, and copy them anew",
    ),
    Status(
        "shape_not_felt",
        WARNING,
        "felt moments are not those of the seen shape, without a known cause",
        "compare the card's moments; check that the bar touches nothing but the whisker",
    ),
    Status(
        "beyond_calibration",
        WARNING,
        "a moment is beyond what the gauges were calibrated to",
        "calibrate the gauges with larger deflections, or push less",
    ),
    Status("samples_saturated", WARNING, "{samples} left out", "lower the amplifier's gain"),
    Status("onset_vague", REFUSAL, "no clear onset of the moments", _CLEARER_TOUCH),
    Status(
        "rise_too_short",
        REFUSAL,
        "touches too near the end of the stroke to fit the rise",
        _CLEARER_TOUCH,
    ),
    Status("too_few_samples", REFUSAL, "too few samples to find a touch", _CLEARER_TOUCH),
    Status(
        "past_whisker",
        WARNING,
        "gave {d_x_mm:.1f} mm, past the whisker's length of {length_mm:g} mm",
        "expected where its model leaves out what the push does; else look at its units",
    ),
    Status(
        "longer_than_whisker",
        WARNING,
        "the distance by (2) is longer than the whisker",
        "expected where the contact slips, which (2) ignores: take (10)",
    ),
    Status(
        "tip_contact",
        WARNING,
        "the distance came out longer than the whisker, and was set to its length",
        "take it as a contact near the tip; a touch nearer to the base is measured better",
    ),
    Status("no_distance_given", REFUSAL, "gave no distance and no reason", _LOOK_AT_ESTIMATOR),
    Status(
        "distance_impossible",
        REFUSAL,
        "gave {d_x_mm:g} mm, which is no distance",
        _LOOK_AT_ESTIMATOR,
    ),
    Status("estimator_raised", REFUSAL, "{name} raised {fault}", _LOOK_AT_ESTIMATOR),
    Status(
        "sigma_impossible",
        WARNING,
        "gave a sigma of {sigma_mm:g} mm, which is none",
        _LOOK_AT_ESTIMATOR,
    ),
    Status(
        "touch_apart",
        WARNING,
        "touch felt and touch seen differ by the same in all whisks",
        "check how frames are stamped, and record strokes at two speeds or with their way back",
    ),
    Status(
        "whisks_scatter",
        WARNING,
        "whisks of one recording scatter by more than their sigmas",
        "fasten bar and hub: whisks of one recording should give one d_x",
    ),
    Status("frames_damaged", WARNING, "pictures cannot be read", _FRAMES_LOST),
    Status(
        "exposure_changed",
        WARNING,
        "frames are far brighter or darker than most, and were left out",
        "fix exposure, gain and light, and record the trial again",
    ),
    Status(
        "rows_repeated", WARNING, "rows of frame times were repeated, and dropped", _FRAMES_LOST
    ),
    Status(
        "rate_unlike_header",
        WARNING,
        "frames come at another rate than a video's header says",
        "look which is right; frame_rate_Hz in trial.toml settles it",
    ),
    Status(
        "signals_copied",
        WARNING,
        "trials {names} have one and the same {file}: all but one have another's",
        "find the recordings that belong to these trials, and copy them anew",
        reaches=(TRUTH, ESTIMATES),
    ),
    Status("signals_mended", WARNING, "{label}: {count} {cause} mended", _LOOK_AT_FILE),
    Status(
        "whisker_curved",
        WARNING,
        "the whisker turns by {turn_deg:.0f}° up to its tip, and all estimates but the exact rod's take "
        "it as straight: touched there, (10) is off by up to {d_x_percent:.1f} %; nearer to the base by "
        "the square of the part of the length less",
        "take the exact rod's estimate, or touch it near its base",
    ),
    Status(
        "speed_unlike_stated",
        WARNING,
        "the motor goes at another speed than is stated",
        _LOOK_AT_FILE,
    ),
    Status(
        "frames_without_signals",
        WARNING,
        "frames were taken while no signals were",
        "start the DAQ before the cameras and stop it after them",
    ),
    Status(
        "no_forward_stroke",
        WARNING,
        "{label}: no forward stroke of the motor, so no whisk",
        "take the trial out, or let the motor turn forward in it",
    ),
    Status(
        "board_misplaced",
        WARNING,
        "the board and the free strokes place the rig differently",
        _MEASURE_BOARD,
        reaches=(TRUTH,),
    ),
    Status(
        "scale_unconfirmed",
        WARNING,
        "hardly any bar is seen where square_mm and T_rig_board place the whisker",
        _MEASURE_BOARD,
        reaches=(TRUTH,),
    ),
    Status(
        "swing_narrow",
        WARNING,
        "the free strokes that place the rig are narrow",
        "record wider free strokes, or measure T_rig_board",
    ),
    Status(
        "boards_not_at_once",
        WARNING,
        "the cameras disagree about the board's pose in views of one index",
        "record views of a board at rest, or trigger the cameras",
    ),
    Status(
        "boards_exchanged",
        REFUSAL,
        "the board views of cameras are exchanged",
        "give each camera the board views and the rig picture that it took",
    ),
    Status(
        "board_stretched",
        WARNING,
        "the board's print is longer along one direction than stretch_sigma lets it be",
        "measure many squares along x and along y; print without scaling, or state the difference",
    ),
    Status(
        "pixels_not_square",
        WARNING,
        "a camera squashes its pictures; taken into account",
        "state pixel_aspect in [[cameras]], or record without squashing",
    ),
    Status(
        "rig_file_contradicts",
        WARNING,
        "rig.toml: {alarm}; {counts}",
        _MEASURE_RIG,
        reaches=(TRUTH,),
    ),
    Status(
        "bar_width_unlike_board",
        WARNING,
        "the bar looks thicker or thinner than stated, or the board's squares are not as stated",
        _MEASURE_BOARD,
        reaches=(TRUTH,),
    ),
    Status(
        "bends_from_start", REFUSAL, "the whisker is seen to bend from the start", _BEGIN_EARLIER
    ),
    Status(
        "moving_object_not_straight",
        REFUSAL,
        "an object that moves or gives way is no straight bar",
        "record a straight bar where the object moves or gives way",
    ),
    Status(
        "moving_object_many_whisks",
        REFUSAL,
        "an object that moves is in a recording of several whisks",
        "record each whisk by itself",
    ),
    Status(
        "moving_object_from_one_side",
        REFUSAL,
        "an object that moves or gives way is seen from one side",
        _SECOND_CAMERA,
    ),
    Status(
        "object_from_one_side",
        REFUSAL,
        "an object that is no straight bar is seen from one side",
        _SECOND_CAMERA,
    ),
    Status("no_shared_frame", REFUSAL, "no frame is seen by every camera"),
    Status("no_shared_first_frame", REFUSAL, "no stroke's first frame is seen by every camera"),
    Status("too_few_frames", REFUSAL, "too few frames are seen by every camera"),
    Status("no_camera_with_frames", REFUSAL, "no camera has three frames or more"),
    Status("no_bar_seen", REFUSAL, "no bar is seen near the whisker"),
    Status(
        "bar_distance_unseen", REFUSAL, "one camera alone does not show how far away the bar is"
    ),
    Status(
        "trace_elsewhere",
        REFUSAL,
        "another program's trace is of something else than the wire",
        "look whether the trace is of this trial and camera, and neither mirrored nor turned",
    ),
    Status(
        "object_points_elsewhere",
        REFUSAL,
        "points or place of the object, given beside traces, are not where the whisker touches",
        "look whether both are of this trial, and points on the object's middle or on both its edges",
    ),
    Status("no_object_seen", REFUSAL, "no object of the stated form is seen near the whisker"),
    Status("object_in_two_places", REFUSAL, "the object may be in either of two places"),
    Status("no_object_edge", REFUSAL, "a camera shows no edge of the object"),
    Status("no_object_outline", REFUSAL, "no clear outline of the object is seen"),
    Status("picture_size_differs", REFUSAL, "frames of a camera differ in size"),
    Status("refused", REFUSAL, "nothing is seen, for the reason that the sentence gives"),
    Status(
        "trial_lost",
        REFUSAL,
        "no result: the process that looked at the trial died {deaths} times, as it does "
        "where memory runs out; the same command tries again",
    ),
    Status("light_unexplained", WARNING, "the wire's light differs from that of any lit wire"),
    Status("no_touching_frame", NOTE, "the whisker does not touch"),
    Status(
        "bar_width_unlike_stated",
        WARNING,
        "the bar looks thicker or thinner than said",
        reaches=(TRUTH,),
    ),
    Status(
        "wire_width_unlike_stated", WARNING, "the whisker looks thinner than said", reaches=(TRUTH,)
    ),
    Status(
        "length_unlike_stated",
        NOTE,
        "the whisker is seen to end elsewhere than length_mm says",
        "measure length_mm again: estimates end there",
    ),
    Status(
        "slope_unlike_stated",
        WARNING,
        "the bar's slope is seen other than stated",
        reaches=(TRUTH,),
    ),
    Status(
        "turns_unlike_motor",
        WARNING,
        "the whisker is not seen to turn as the motor does",
        reaches=(TRUTH,),
    ),
    Status(
        "friction_too_large",
        WARNING,
        "no friction holds the whisker at this angle",
        reaches=(TRUTH,),
    ),
    Status(
        "wire_off_its_base",
        WARNING,
        "its wire starts {beside_mm:.1f} mm beside its base, check base_mm",
        reaches=(TRUTH,),
    ),
    Status("wire_of_another", WARNING, "its wire may be that of {names}", reaches=(TRUTH,)),
    Status("no_free_force", REFUSAL, "no free stroke to read the force's zero from"),
    Status("angle_not_reached", REFUSAL, "the stroke does not reach the pushing angle"),
    Status(
        "gauges_at_rail",
        REFUSAL,
        "the gauges are at their rail at the pushing angle: "
        "raise their range, or ask for a smaller --theta-deg",
    ),
    Status("no_way_back", REFUSAL, "no way back was recorded"),
    Status("deflection_impossible", WARNING, "gave a deflection of {given}, which is none"),
    Status(
        "only_nearer_known",
        WARNING,
        "the distance is known only to be nearer than a bound",
        _GENTLER,
    ),
    Status(
        "two_distances", WARNING, "two distances explain the moments of an object that moves away"
    ),
    Status("motion_not_stated", REFUSAL, "it is not stated how the object moves"),
    Status("object_runs_away", REFUSAL, "an object that moves as stated would be touched nowhere"),
    Status("no_force_recorded", REFUSAL, "no force at the base was recorded"),
    Status("no_moment_rate", REFUSAL, "the rate of the moment is not known"),
    Status("phi_turns", WARNING, "the force's angle turns over the push"),
    Status(
        "frame_count_unlike_header", WARNING, "a video's header declares another number of frames"
    ),
    Status("first_frame_not_stated", WARNING, "first_frame_s is not given"),
    Status("clock_of_container", WARNING, "frame times are those of a video's container"),
    Status("surface_unused", WARNING, "a surface of the manifest is no trial's"),
    Status(
        "wire_not_shown",
        REFUSAL,
        "the camera shows nothing of this whisk's wire, or was left out",
    ),
    Status("value_missing", REFUSAL, "a measured value is missing or infinite"),
    Status("angle_not_positive", REFUSAL, "the pushing angle is not positive"),
    Status("angle_too_large", REFUSAL, "the pushing angle is 90 degrees or more"),
    Status("slope_too_steep", REFUSAL, "the slope beta is 90 degrees or more"),
    Status("not_pushing", REFUSAL, "m_z is not positive"),
    Status("moments_up_slope", REFUSAL, "m_y points up the slope, too strongly for a contact"),
    Status("beyond_friction", REFUSAL, "phi + alpha_est is 90 degrees or more", _GENTLER),
    Status(
        "rod_unconverged",
        REFUSAL,
        "no bent rod has these moments at this friction angle",
        "take (10) there, and look at the friction angle and at [whisker]",
    ),
    Status("distance_out_of_range", REFUSAL, "the distance is beyond the range of a float"),
    Status("force_unlike_moment", REFUSAL, "force and moment contradict each other"),
    Status("never_slipped", REFUSAL, "no slope is steeper than the friction angle"),
    Status("friction_vague", REFUSAL, "the data hardly constrain the friction angle"),
    Status("friction_at_zero", WARNING, "the best friction angle is 0"),
    Status("friction_below_zero", WARNING, "the friction angle came out below 0"),
    Status(
        "friction_at_bound",
        REFUSAL,
        "at the bound of the search, {bound_deg:.1f}°: no angle between fits",
    ),
    Status("tilts_one_sided", REFUSAL, "the slip angle does not leave zero on both sides"),
    Status("still_slips", WARNING, "the whisker still slips sideways", "turn the plane once more"),
    Status("whisker_does_not_ring", REFUSAL, "no ringing stands out of the noise"),
    Status("ring_not_of_a_prop", REFUSAL, "no contact makes the whisker ring at this frequency"),
    Status("not_a_straight_cylinder", REFUSAL, "the whisker is no straight cylinder"),
    Status("no_unfiltered_samples", REFUSAL, "no samples as recorded are kept"),
    Status("two_places_ring_alike", WARNING, "two distances give the same frequency"),
    Status("nothing_heard", REFUSAL, "no sound stands out of the noise", _LOUDER),
    Status(
        "moment_does_not_vanish",
        REFUSAL,
        "the moment does not fall to zero along the whisker",
        "calibrate the load cell, and state the whisker's stiffness",
    ),
    Status(
        "curved_unloaded",
        REFUSAL,
        "the elastica is of a whisker that is straight unloaded",
        "use (10) or exact_rod for a curved whisker",
    ),
    Status("contour_open", REFUSAL, "touches do not go all round", _TOUCH_ALL_ROUND),
    Status("whisks_slip_alike", REFUSAL, "the whisks slip alike"),
    Status("whisks_unconverged", REFUSAL, "friction and distance do not converge"),
    Status("whisk_not_pushing", REFUSAL, "a whisk does not push"),
    Status("ways_alike", REFUSAL, "there and back the moments are alike"),
    Status("no_push_one_way", REFUSAL, "no push on one of both ways"),
    Status("distance_nowhere", REFUSAL, "the distance comes out nowhere on the whisker"),
    Status("whisker_points_few", REFUSAL, "one camera shows too few points of the whisker"),
    Status("pushing_angle_unseen", REFUSAL, "one camera does not see the pushing angle"),
    Status("bending_plane_unknown", WARNING, "the plane of bending is not known"),
    Status("shape_unconverged", REFUSAL, "the fit of the seen shape does not converge"),
    Status("bend_end_unseen", REFUSAL, "the seen shape does not show where the bend ends"),
    Status(
        "angles_few",
        REFUSAL,
        "needs moments at {least} pushing angles a degree apart: push further",
    ),
    Status("phi_turns_far", REFUSAL, "phi turns by {degrees:.0f} degrees: too far"),
    Status("distances_missing", REFUSAL, "(10) gives no distance at one of the angles"),
    Status("no_lateral_slip", NOTE, "does not slip sideways: no lateral curvature"),
    Status("not_soft", NOTE, "no softer than a rigid object within the noise"),
    Status("compliances_contradict", REFUSAL, "no distance explains both compliances"),
    Status(
        "recordings_few",
        REFUSAL,
        "needs more recordings than it has unknowns to say how well it is known",
    ),
    Status("slopes_one_sided", REFUSAL, "needs nominal slopes (beta_deg) of both signs"),
    Status(
        "whisks_few",
        REFUSAL,
        "needs {least} whisks or more at one nominal distance (d_x_mm)",
    ),
    Status(
        "one_nominal_distance",
        REFUSAL,
        "needs whisks at two nominal distances (d_x_mm) or more",
    ),
    Status("no_push_on_object", REFUSAL, "a whisk is no push against an object"),
    Status("slip_angles_alike", REFUSAL, "the whisks do not span two slip angles"),
    Status("no_truth", REFUSAL, "no truth"),
    Status("effect_not_fitted", REFUSAL, "the fit does not show this effect"),
    Status(
        "clock_like_zero",
        REFUSAL,
        "strokes at one speed and in one direction do not separate a late clock from a shifted zero",
    ),
    Status("bar_radius_unknown", REFUSAL, "no bar diameter or friction angle is known"),
    Status("tilt_unknown", REFUSAL, "no tilt is known"),
    Status("slope_unknown", REFUSAL, "no slope is known"),
    Status("factors_unknown", REFUSAL, "no gauges with one factor a channel are known"),
    Status(
        "drift_not_removed",
        NOTE,
        "no free stroke before and after the contact: none was taken out",
    ),
    Status("no_stick_slip", NOTE, "the moments show no stick–slip"),
    Status("contacts_few", REFUSAL, "too few, of {distances}"),
    Status("size_open", REFUSAL, "contacts leave the size open"),
    Status("size_may_be_zero", WARNING, "not known: the interval holds 0"),
    Status(
        "contacts_off_surface",
        WARNING,
        "contacts lie farther off such a surface than their sigmas let them (chance {chance:.1g})",
    ),
    Status(
        "unnamed", WARNING, "a sentence without a code, such as that of an estimator of one's own"
    ),
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
    """Return of what is said those sentences whose code puts one of these numbers in doubt."""
    found = []
    for code, sentence in said.parts:
        if set(numbers).intersection(status_of_code(code).reaches):
            found.append((code, sentence))
    return Reason.of_parts(found)


def has_only_notes(text: str) -> bool:
    """Return whether all that a status says leaves distance and moments what they are."""
    return all(status_of_code(code).severity == NOTE for code in as_reason(text).codes)


def cure_of(codes: Iterable[str]) -> str:
    """Return what to do about these codes: the cure of the one that stands first in the table."""
    known = [code if code in STATUSES else UNNAMED for code in codes]
    first = min(known, key=_RANK.__getitem__, default=UNNAMED)
    return STATUSES[first].cure
