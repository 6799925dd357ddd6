"""The truth of one trial, from its pictures alone.

    pictures → coarse bar → bar's line ┐
                                       ├→ one fit over cameras and frames → touch, contact, slip, with sigma
    pictures → coarse bends → wire's line points ┘

Nothing here knows of a gauge.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from vision.fit.base_line import base_lines
from vision.fit.beam_check import BeamCheck, check_beam
from vision.fit.camera_delays import camera_delays
from vision.fit.converged_fit import ConvergedFit
from vision.fit.motion import Gives, StatedVelocity
from vision.fit.one_camera_less import contradiction
from vision.fit.refinements import LeftOut, left_out
from vision.fit.turns import frame_turns
from vision.geometry.base_lines import BaseLines
from vision.geometry.camera import Cameras
from vision.geometry.centreline import REST_POWERS, Curves, is_before
from vision.geometry.contact import BarAxis
from vision.geometry.number_words import counted
from vision.geometry.reasons import Reason, joined
from vision.geometry.refusals import Misled, Refused
from vision.geometry.rods import Rods, Wire
from vision.geometry.vision_settings import VisionSettings
from vision.pictures.others import RodLines
from vision.pictures.pyramid import shrunk_cameras
from vision.pictures.view import View
from vision.touched.search import SeenBar, find_object, with_lines
from vision.touched.search_scene import SearchScene
from vision.touched.width import measure_relative_widths
from vision.truth.explanations import Explanation, explain, fit_again
from vision.truth.given_traces import traces_as_lines
from vision.truth.kept_fit import KeptFit
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.trial_pictures import TrialPictures
from vision.truth.truth_rows import to_whisk
from vision.truth.value import as_values
from vision.truth.whisk_fit import coarse_curves, coarse_shapes, free_stroke
from vision.truth.whisk_pictures import FittedWhisk, WhiskPictures
from vision.truth.wire_end import wire_ends
from vision.truth.wire_width import wire_widths
from vision.wire.one_sided import one_sided_widths
from vision.wire.trace import lines_of

# [frames] Of a whisk that every camera sees: two of free stroke, two that touch. Derived.
_FEWEST_FRAMES = 4

# Refusals of a thinned stroke whose frames between may be what is missing.
_TOO_LITTLE_FREE = ("starts_touching", "bends_from_start")

# Why a whisk has no truth whose fit diverges.
NOT_CONVERGED = Reason("fit_not_converged", "the fit of wire and bar does not settle")

_USUAL = VisionSettings()


def observe_trial(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings = _USUAL,
    fits: Sequence[KeptFit] = (),
) -> TrialTruth:
    """Measure the truth of a trial: object, first touch, contact and slip in each whisk.

    whisks: slices of frame indices, one a forward stroke. fits: of all whisks in these pictures, by cameras that
    stood a little elsewhere; their lines are fitted again, and not traced. What keeps a whisk from having a truth is
    its status; raises Refused only for input that no trial could be seen with.
    """
    # Where one was refused, pictures are asked again for all that speaks against it.
    if len(fits) < len(whisks):
        fits = ()
    try:
        axis = BarAxis(fits[0].point_mm, fits[0].direction) if fits else None
        scene = _prepare_scene(pictures, whisks, cameras, rods, settings, axis)
    except Refused as reason:
        return nothing_seen(whisks, reason.reason)
    seen = _see_in_turn(scene, fits)
    axis = seen.found.axis.as_bar()
    light = [whisk.light for whisk in scene.whisks]
    bars = {}
    if settings.measure_sizes:
        bars = measure_relative_widths(with_lines(scene.search, seen.found))
    return TrialTruth(
        axis.point_mm,
        axis.direction,
        tuple(seen.rows),
        one_sided_widths(light),
        as_values(bars),
        tuple(seen.kept),
    )


def wire_lines(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings = _USUAL,
) -> dict[str, RodLines]:
    """Return where the wire is in the pictures of each camera, coarsely: to a pixel or two.

    It is straight, as the motor has it, in whisks in which it is not seen. Arguments and errors as
    of `observe_trial`.
    """
    scene = _prepare_scene(pictures, whisks, cameras, rods, settings)
    curves: dict[int, Curves] = {}
    for whisk in scene.whisks:
        curves |= _coarse_curves(whisk.without_gaps())
    if not curves:
        return {}
    cameras = scene.search.cameras
    return {camera.name: lines_of(camera, rods.wire, curves) for camera in cameras}


def _coarse_curves(whisk: WhiskPictures) -> dict[int, Curves]:
    """Return the wire's centreline in each frame, coarsely."""
    try:
        rest, bends = coarse_shapes(whisk)
    except Refused:
        rest = np.zeros((2, REST_POWERS))
        bends = dict.fromkeys(whisk.frames, np.zeros(2))
    return coarse_curves(whisk, rest, bends)[0]


@dataclass(frozen=True)
class _TrialScene:
    """A trial before any wire is known: its whisks, the object, and what that was searched in."""

    whisks: list[WhiskPictures]
    found: SeenBar
    search: SearchScene


@dataclass
class _WhisksInTurn:
    """The truths of a trial's whisks so far, fits that are kept, and the object as the last fit has it."""

    found: SeenBar
    rows: list[WhiskTruth] = field(default_factory=list)
    kept: list[KeptFit] = field(default_factory=list)


def _see_in_turn(scene: _TrialScene, fits: Sequence[KeptFit]) -> _WhisksInTurn:
    """Measure one whisk after another, each from where the one before has the object.

    fits: of whisks that are not traced, but fitted again.
    """
    again = {fit.number: partial(fit_again, fit) for fit in fits}
    seen = _WhisksInTurn(scene.found)
    earlier = None
    for whisk in scene.whisks:
        whisk = replace(whisk, bar=seen.found, earlier=earlier)
        explain_by = again.get(whisk.number, explain)
        measures_sizes = earlier is None and whisk.settings.measure_sizes
        truth_of = _first_truth if measures_sizes else fitted_truth
        row, explained = see_whisk(whisk, explain_by, truth_of)
        seen.rows.append(row)
        if explained is not None:
            seen.found = explained.whisk.bar
            kept = explained.kept
            if kept is not None:
                seen.kept.append(kept)
            earlier = explained.as_earlier
    return seen


def _prepare_scene(
    pictures: TrialPictures,
    whisks: Sequence[slice],
    cameras: Cameras,
    rods: Rods,
    settings: VisionSettings,
    axis: BarAxis | None = None,
) -> _TrialScene:
    """Return the whisks with all that is known before a wire is traced.

    axis: of the bar where that is known, else it is searched for. Raises Refused where the object is not found.
    """
    pictures = pictures.shrunk(settings.picture_scale)
    cameras = shrunk_cameras(cameras, settings.picture_scale)
    time_s = np.asarray(pictures.time_s, dtype=float)
    motor_rad = np.asarray(pictures.motor_rad, dtype=float)
    views, used, left_out = views_facing(pictures, cameras, rods.wire, motor_rad)
    strokes = strokes_of(whisks, len(time_s), settings.every_frame)
    velocity, standing = _stated_motion(pictures, strokes, views, rods)
    search = SearchScene(standing, used, rods, motor_rad, settings)
    found = find_object(search) if axis is None else SeenBar(axis, {})
    seen = []
    for number, stroke in enumerate(strokes):
        whisk = WhiskPictures(
            number=number,
            indices=stroke,
            time_s=time_s,
            motor_rad=motor_rad,
            views=views,
            cameras=used,
            rods=rods,
            bar=found,
            settings=settings,
            left_out=tuple(left_out),
            stated_velocity=velocity,
            gives=Gives() if pictures.object_gives_way else None,
            make_lines=traces_as_lines(pictures.traces),
            picture_of=pictures.picture_of,
        )
        seen.append(whisk)
    return _TrialScene(seen, found, search)


def strokes_of(whisks: Sequence[slice], count: int, every_frame: int) -> list[range]:
    """Return the frames of each whisk that are evaluated, of so many frames of the trial."""
    return [range(*whisk.indices(count))[::every_frame] for whisk in whisks]


def views_facing(
    pictures: TrialPictures, cameras: Cameras, wire: Wire, motor_rad: np.ndarray
) -> tuple[Sequence[View], Cameras, list[Reason]]:
    """Return the views of cameras that have the whisker before them, the cameras of these, and a
    reason for each camera that is left out.

    Raises Refused where none has.
    """
    facing, left_out = cameras_facing(cameras, wire, motor_rad)
    views = pictures.views(facing)
    return views, facing.subset([view.camera.name for view in views]), left_out


def _stated_motion(
    pictures: TrialPictures,
    strokes: Sequence[Sequence[int]],
    views: Sequence[View],
    rods: Rods,
) -> tuple[StatedVelocity | None, Sequence[View]]:
    """Return the stated velocity of an object that moves, and the views in which it stands.

    Its place is counted from a frame in the middle of its whisk; it stands in that frame alone.
    Raises Refused where such an object cannot be evaluated.
    """
    velocity_mm_s = pictures.object_velocity_mm_s
    moves = pictures.object_gives_way or velocity_mm_s is not None
    if moves and not rods.bar.may_move:
        raise Refused(
            "an object that moves or gives way is seen where it is a straight bar; this one is none",
            code="moving_object_not_straight",
        )
    if pictures.object_gives_way:
        return None, _at_first(views, strokes)
    if velocity_mm_s is None:
        return None, views
    if len(strokes) != 1:
        raise Refused(
            "an object that moves is seen in recordings of one whisk; record each by itself",
            code="moving_object_many_whisks",
        )
    shared = [frame for frame in strokes[0] if all(frame in view.frames for view in views)]
    if not shared:
        raise Refused("no frame is seen by every camera", code="no_shared_frame")
    middle = shared[len(shared) // 2]
    stated = StatedVelocity(
        np.asarray(velocity_mm_s),
        pictures.object_velocity_sigma_mm_s,
        float(pictures.time_s[middle]),
    )
    return stated, [view.in_frame(middle) for view in views]


def _at_first(views: Sequence[View], strokes: Sequence[Sequence[int]]) -> list[View]:
    """Return the views in the frame that a stroke begins with, before it touches.

    Raises Refused where no such frame is seen by every camera.
    """
    for stroke in strokes:
        for frame in stroke[:1]:
            if all(frame in view.frames for view in views):
                return [view.in_frame(frame) for view in views]
    raise Refused("no stroke's first frame is seen by every camera", code="no_shared_first_frame")


def nothing_seen(whisks: Sequence[slice], reason: Reason) -> TrialTruth:
    """Return the truth of a trial that is not seen, with the reason as each whisk's status."""
    rows = tuple(WhiskTruth(number, None, status=reason) for number in range(len(whisks)))
    return TrialTruth(np.full(3, np.nan), np.full(3, np.nan), rows)


def cameras_facing(
    cameras: Cameras, wire: Wire, motor_rad: np.ndarray
) -> tuple[Cameras, list[Reason]]:
    """Return the cameras that have the whisker before them, and a reason for each of the others.

    Raises Refused where none has.
    """
    facing = []
    left_out = []
    for camera in cameras:
        if is_before(camera, wire, motor_rad):
            facing.append(camera.name)
            continue
        line = (
            f"camera {camera.name} was left out: by its pose the whisker is behind it, "
            "check T_camera_rig"
        )
        left_out.append(Reason("whisker_behind_camera", line))
    if not facing:
        raise Refused("; ".join(left_out), code="whisker_behind_camera")
    return cameras.subset(facing), left_out


def see_whisk(
    whisk: WhiskPictures,
    explain_by: Callable[[WhiskPictures], Explanation],
    truth_of: Callable[[Explanation], WhiskTruth],
) -> tuple[WhiskTruth, Explanation | None]:
    """Return the truth of one whisk, or its status where there is none, and the fit to begin the next
    whisk from, None without one.

    explain_by: fits a whisk. truth_of: makes the row of the fit. A camera that shows something else
    than the others is left out, and the others are evaluated again. A whisk that cannot begin as an earlier
    one ended begins by itself.
    """
    while True:
        whisk = whisk.without_gaps()
        try:
            _require_frames(whisk)
            explained = explain_by(whisk)
            break
        except (Refused, np.linalg.LinAlgError) as reason:
            begins_anew = _again(whisk, reason)
            if begins_anew is None:
                return _refused(whisk, why_failed(reason)), None
            whisk = begins_anew
    return truth_of(explained), explained


def _require_frames(whisk: WhiskPictures) -> None:
    """Raise Refused where too few frames are seen by every camera."""
    seen = len(whisk.frames)
    if seen < _FEWEST_FRAMES:
        few = f"{counted(seen, 'frame')} seen by every camera, {_FEWEST_FRAMES} are needed"
        raise Refused(few, code="too_few_frames")


def why_failed(error: Refused | np.linalg.LinAlgError) -> Reason:
    """Return why a fit gave no truth: its refusal, or that it has not converged."""
    return error.reason if isinstance(error, Refused) else NOT_CONVERGED


def _again(whisk: WhiskPictures, reason: Exception) -> WhiskPictures | None:
    """Return how a whisk that was refused is evaluated again; None where it is not."""
    if whisk.earlier is not None:
        return replace(whisk, earlier=None)
    if isinstance(reason, Misled) and len(whisk.views) > 1:
        return whisk.without(reason.camera, reason.reason)
    if isinstance(reason, Refused) and whisk.is_thinned and reason.code in _TOO_LITTLE_FREE:
        return whisk.with_all_frames()
    return None


def _refused(whisk: WhiskPictures, status: Reason) -> WhiskTruth:
    """Return the row of a whisk without a truth."""
    return WhiskTruth(
        whisk.number,
        None,
        cameras=len(whisk.views),
        frames_used=len(whisk.frames),
        status=joined(status, *whisk.left_out),
    )


def _first_truth(explained: Explanation) -> WhiskTruth:
    """Return the truth of a trial's first whisk, with what its pictures show of the wire's end and
    width: the others have the same wire.
    """
    whisk = explained.whisk
    return replace(
        fitted_truth(explained),
        ends=wire_ends(whisk, explained.fitted),
        widths=wire_widths(whisk, explained.fitted) if whisk.settings.check_beam else {},
    )


def fitted_truth(explained: Explanation) -> WhiskTruth:
    """Return the truth of a fitted whisk, with its checks and the whisker's base before touch."""
    fitted = explained.fitted
    whisk = explained.whisk.yielding_as(fitted)
    truth = to_whisk(whisk, fitted)
    beam = check_beam(fitted, fitted.covariance) if whisk.settings.check_beam else None
    status = joined(truth.status, explained.warning, *warnings_of(whisk, fitted, beam))
    return replace(
        truth,
        refinements=_refinements(whisk, fitted) if truth.d_x_mm.is_known else {},
        status=status,
        turns=frame_turns(fitted, fitted.frames),
        delays=as_values(camera_delays(fitted, whisk.picture_of)),
        base=_base_of(whisk, fitted) if whisk.settings.read_base else None,
        beam=beam,
    )


def _base_of(whisk: WhiskPictures, fitted: FittedWhisk) -> BaseLines | None:
    """Return the whisker's base in all frames before touch."""
    free: ConvergedFit = fitted
    if len(fitted.frames) < len(whisk.frames):
        free = free_stroke(whisk, fitted)
    return base_lines(free)


def warnings_of(
    whisk: WhiskPictures, fitted: FittedWhisk, beam: BeamCheck | None
) -> Iterator[Reason]:
    """Yield the reasons, some empty, for which the truth of a fitted whisk may be wrong."""
    yield Reason("cameras_contradict", contradiction(fitted.one_less))
    yield Reason("no_beam", beam.alarm if beam else "")
    for name, appearance in whisk.light.items():
        yield Reason("light_unexplained", appearance.warning(name))
    yield from whisk.left_out


def _refinements(whisk: WhiskPictures, fitted: FittedWhisk) -> dict[str, LeftOut]:
    """Return what the truth would be without each refinement; nothing where that is unresolved."""
    try:
        return left_out(fitted, whisk.light)
    except np.linalg.LinAlgError:
        return {}
