"""The whole truth of one trial, from its pictures alone.

    pictures → coarse bar → bar's line ┐
                                       ├→ one fit over cameras and frames → touch, contact, slip, with sigma
    pictures → coarse bends → wire's line points ┘

Nothing here knows of a gauge.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vision.fit.base_line import base_lines
from vision.fit.beam_check import BeamCheck, check_beam
from vision.fit.first_bends import contact_arc
from vision.fit.motion import Gives, StatedVelocity
from vision.fit.one_camera_less import contradiction
from vision.fit.refinements import Fit, LeftOut, left_out
from vision.fit.turns import frame_turns
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, is_before, one_curve
from vision.geometry.counted import counted
from vision.geometry.reasons import Reason, joined
from vision.geometry.refusals import Misled, Refused, TooFewFrames
from vision.geometry.rods import Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.others import RodLines
from vision.pictures.pyramid import shrunk_cameras
from vision.pictures.view import View
from vision.touched.search import SeenBar, find_object
from vision.touched.search_scene import SearchScene
from vision.touched.width import measure_relative_widths
from vision.truth.moving_bar import in_one_frame
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.trial_pictures import TrialPictures
from vision.truth.truth_rows import to_whisk
from vision.truth.value import Value
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.whisk_truth import coarse_shapes, fit_whisk, free_stroke
from vision.truth.wire_end import wire_ends
from vision.truth.wire_width import wire_looks
from vision.wire.one_sided import one_sided_lines
from vision.wire.trace import lines_of

# [frames] Of a whisk that every camera sees: two of free stroke, two that touch. Derived.
_FEWEST_FRAMES = 4

# Why a whisk has no truth whose fit diverges.
NOT_CONVERGED = Reason("fit_not_converged", "the fit of wire and bar does not settle")

_USUAL = VisionSettings()


def observe_trial(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings = _USUAL,
) -> TrialTruth:
    """Truth of a trial: bar, first touch, contact and slip in each whisk.

    whisks: slices of frame indices, one a forward stroke. What keeps a whisk from having a truth is its status; raises
    Refused only for input that no trial could be seen with.
    """
    try:
        seen, bar_seen, _ = _whisks_of(pictures, whisks, cameras, rods, settings)
    except Refused as reason:
        return _nothing(whisks, reason.reason)
    rows = tuple(_see_whisk(whisk) for whisk in seen)
    axis = bar_seen.axis.as_bar()
    light = [whisk.light for whisk in seen]
    looks = measure_relative_widths(bar_seen)
    bars = {name: Value(*share) for name, share in looks.items()}
    return TrialTruth(axis.point_mm, axis.direction, rows, one_sided_lines(light), bars)


def wire_lines(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings = _USUAL,
) -> dict[str, RodLines]:
    """Where the wire is in the pictures of each camera, by a first look, to a pixel or two; straight, as the motor has
    it, in whisks in which it is not seen. Arguments and errors as of `observe_trial`."""
    seen, _, stands = _whisks_of(pictures, whisks, cameras, rods, settings)
    curves = {
        frame: curve
        for whisk in seen
        for frame, curve in _first_curves(whisk.without_gaps()).items()
    }
    return {view.camera.name: lines_of(view.camera, rods.wire, curves) for view in stands if curves}


def _first_curves(whisk: WhiskPictures) -> dict[int, Curves]:
    """The wire's centreline in each frame by a first look."""
    try:
        rest, bends = coarse_shapes(whisk)
    except Refused:
        rest, bends = np.zeros((2, REST_POWERS)), dict.fromkeys(whisk.frames, np.zeros(2))
    axis, wire = whisk.bar.axis, whisk.rods.wire
    arcs = {f: contact_arc(rest, bends[f], motor, axis, wire) for f, motor in whisk.motor.items()}
    return {f: one_curve(rest, bends[f], arcs[f], motor, wire) for f, motor in whisk.motor.items()}


def _whisks_of(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings,
) -> tuple[list[WhiskPictures], SeenBar, Sequence[View]]:
    """The whisks with all that is known before a wire is looked for, the bar, and views in which it stands. Raises
    Refused."""
    pictures, cameras = (
        pictures.shrunk(settings.picture_scale),
        shrunk_cameras(cameras, settings.picture_scale),
    )
    time_s, motor_rad = (
        np.asarray(values, dtype=float) for values in (pictures.time_s, pictures.motor_rad)
    )
    cameras, behind = _that_face_it(cameras, rods.wire, motor_rad)
    views = pictures.views(cameras)
    used = cameras.subset([view.camera.name for view in views])
    strokes = [range(*where.indices(len(time_s)))[:: settings.every_frame] for where in whisks]
    told, stands = _told(pictures, strokes, views, rods.bar.may_move)
    bar_seen = find_object(SearchScene(stands, used, rods, motor_rad, settings))
    gives = Gives() if pictures.object_gives_way else None
    return (
        [
            WhiskPictures(
                number,
                stroke,
                time_s,
                motor_rad,
                views,
                used,
                rods,
                bar_seen,
                settings,
                left_out=tuple(behind),
                told=told,
                gives=gives,
            )
            for number, stroke in enumerate(strokes)
        ],
        bar_seen,
        stands,
    )


def _told(
    pictures: TrialPictures, strokes, views: Sequence[View], may_move: bool
) -> tuple[StatedVelocity | None, Sequence[View]]:
    """What is said of a bar that moves, counted from a frame in the middle of its whisk, and the views in which it
    stands: of that frame alone. Raises Refused for what is not told of it."""
    moves = pictures.object_gives_way or pictures.object_velocity_mm_s is not None
    if moves and not may_move:
        raise Refused(
            "an object that moves or gives way is seen where it is a straight bar; this one is none",
            code="moving_object_not_straight",
        )
    if pictures.object_gives_way:
        return None, _at_first(views, strokes)
    if pictures.object_velocity_mm_s is None:
        return None, views
    if len(strokes) != 1:
        raise Refused(
            "an object that moves is seen in recordings of one whisk; record each by itself",
            code="moving_object_many_whisks",
        )
    both = [frame for frame in strokes[0] if all(frame in view.frames for view in views)]
    if not both:
        raise Refused("no frame is seen by every camera", code="no_shared_frame")
    middle = both[len(both) // 2]
    velocity, sigma = np.asarray(pictures.object_velocity_mm_s), pictures.object_velocity_sigma_mm_s
    return StatedVelocity(velocity, sigma, float(pictures.time_s[middle])), in_one_frame(
        views, middle
    )


def _at_first(views: Sequence[View], strokes: Sequence[Sequence[int]]) -> list[View]:
    """The views in the frame that a stroke begins with, before it touches. Raises Refused where there is none."""
    for frame in (frame for stroke in strokes for frame in stroke[:1]):
        if all(frame in view.frames for view in views):
            return in_one_frame(views, frame)
    raise Refused("no stroke's first frame is seen by every camera", code="no_shared_first_frame")


def _nothing(whisks, reason: Reason) -> TrialTruth:
    rows = tuple(WhiskTruth(number, None, status=reason) for number in range(len(whisks)))
    return TrialTruth(np.full(3, np.nan), np.full(3, np.nan), rows)


def _that_face_it(cameras: Cameras, wire: Wire, motor_rad) -> tuple[Cameras, list[Reason]]:
    """The cameras that have the whisker before them, and lines on the others. Raises Refused where none has."""
    faces = {camera.name: is_before(camera, wire, motor_rad) for camera in cameras}
    lines = [
        Reason(
            "whisker_behind_camera",
            f"camera {name} was left out: by its pose the whisker is behind it, check T_camera_rig",
        )
        for name, faced in faces.items()
        if not faced
    ]
    if not any(faces.values()):
        raise Refused("; ".join(lines), code="whisker_behind_camera")
    return cameras.subset([name for name, faced in faces.items() if faced]), lines


def _see_whisk(whisk: WhiskPictures) -> WhiskTruth:
    """Truth of one whisk; its status where there is none. A camera that shows something else than the others is left
    out, and the others are asked again."""
    while True:
        whisk = whisk.without_gaps()
        if len(whisk.frames) < _FEWEST_FRAMES:
            few = f"{counted(len(whisk.frames), 'frame')} seen by every camera, {_FEWEST_FRAMES} are needed"
            status = joined(Reason("too_few_frames", few), *whisk.left_out)
            return WhiskTruth(whisk.number, None, status=status)
        try:
            fitted = fit_whisk(whisk)
            break
        except TooFewFrames:
            whisk = whisk.with_all_frames()
        except Misled as reason:
            if len(whisk.views) == 1:
                return _refused(whisk, reason.reason)
            whisk = whisk.without(reason.camera, reason.reason)
        except Refused as reason:
            return _refused(whisk, reason.reason)
        except np.linalg.LinAlgError:
            return _refused(whisk, NOT_CONVERGED)
    return _truth(whisk, fitted)


def _refused(whisk: WhiskPictures, status: Reason) -> WhiskTruth:
    return WhiskTruth(
        whisk.number,
        None,
        cameras=len(whisk.views),
        frames_used=len(whisk.frames),
        status=joined(status, *whisk.left_out),
    )


def _truth(whisk: WhiskPictures, fitted: FittedWhisk) -> WhiskTruth:
    """What a fit tells of its whisk, how it would look without a beam, and the whisker's base before touch."""
    whisk = whisk.yielding_as(fitted.problem, fitted.state)
    truth, unexplained = (
        to_whisk(whisk, fitted),
        [Reason("light_unexplained", looks.doubt(name)) for name, looks in whisk.light.items()],
    )
    beam = _beam(fitted) if whisk.settings.check_beam else None
    without = _refinements(whisk, fitted) if np.isfinite(truth.d_x_mm.value) else {}
    stroke = fitted.problem, fitted.state
    if len(fitted.frames) < len(whisk.frames):
        stroke = free_stroke(whisk, fitted)
    status = joined(
        truth.status,
        Reason("cameras_contradict", contradiction(fitted.one_less)),
        Reason("no_beam", beam.alarm if beam else ""),
        *unexplained,
        *whisk.left_out,
    )
    turns = frame_turns(fitted.problem, fitted.state, fitted.frames)
    base, ends = base_lines(*stroke, fitted.uncertainty.lens), wire_ends(whisk, fitted)
    looks = wire_looks(whisk, fitted) if whisk.settings.check_beam and whisk.number == 0 else {}
    told = {
        "base": base,
        "beam": beam,
        "turns": turns,
        "refinements": without,
        "ends": ends,
        "looks": looks,
    }
    return replace(truth, **told, status=status)


def _refinements(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, LeftOut]:
    """What the truth would be without each; nothing where the fit does not tell."""
    fit = Fit(
        fitted.problem,
        fitted.state,
        fitted.uncertainty.inverse_normal,
        fitted.measured,
        fitted.by_parameter,
    )
    try:
        return left_out(fit, whisk.light)
    except np.linalg.LinAlgError:
        return {}


def _beam(fitted: FittedWhisk) -> BeamCheck:
    return check_beam(
        fitted.problem, fitted.state, fitted.covariance, fitted.measured, fitted.by_parameter
    )
