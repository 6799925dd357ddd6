"""The whole truth of one trial, from its pictures alone.

    pictures → coarse bar → bar's line ┐
                                       ├→ one fit over cameras and frames → touch, contact, slip, with sigma
    pictures → coarse bends → wire's line points ┘

Nothing here knows of a gauge.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vision.bar.search import SeenBar, see_bar
from vision.fit.base_line import base_lines
from vision.fit.beam_check import check_beam
from vision.fit.quantities import jacobians
from vision.fit.uncertainty import uncertainty
from vision.geometry.camera import Cameras
from vision.geometry.errors import Misled, Refused
from vision.geometry.rods import Bar, Rods, Wire
from vision.geometry.settings import VisionSettings
from vision.lines.one_sided import Lit, one_sided_lines
from vision.pictures.pixel_noise import measure_noise
from vision.pictures.view import View
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.rows import to_whisk
from vision.truth.whisk import fit_whisk, free_stroke

_FEWEST_SHARE = 0.7  # of the frames that the best camera has: a camera with fewer costs more than it tells

_USUAL = VisionSettings()


def observe_trial(frames: Mapping[str, Mapping[int, np.ndarray]], time_s, motor_rad, whisks: Sequence[slice],
                  cameras: Cameras, wire: Wire, bar: Bar, background: Mapping[str, np.ndarray | None],
                  settings: VisionSettings = _USUAL) -> TrialTruth:
    """Truth of a trial: bar, first touch, contact and slip in each whisk.

    frames: per camera the grey pictures by frame index (a missing index is a lost frame); time_s, motor_rad (n,)
    at each frame; whisks: slices of frame indices, one a forward stroke; background: the scene without whisker and
    bar, or None. What keeps a whisk from having a truth is its status; raises Refused only for input that no
    trial could be seen with.
    """
    time_s, motor_rad = np.asarray(time_s, dtype=float), np.asarray(motor_rad, dtype=float)
    rods = Rods(wire, bar)
    try:
        views = _views(frames, cameras, background)
        used = cameras.subset([view.camera.name for view in views])
        bar_seen = see_bar(views, used, rods, motor_rad, settings)
    except Refused as reason:
        return _nothing(whisks, str(reason))
    lights = [{} for _ in whisks]
    rows = [_see_whisk(number, range(*where.indices(len(time_s))), views, used, rods, bar_seen, time_s, motor_rad,
                       lights[number], settings) for number, where in enumerate(whisks)]
    axis = bar_seen.axis
    return TrialTruth(axis.point_mm, axis.direction, np.full((4, 4), np.nan), tuple(rows), one_sided_lines(lights))


def _nothing(whisks, reason: str) -> TrialTruth:
    rows = tuple(WhiskTruth(number, None, status=reason) for number in range(len(whisks)))
    return TrialTruth(np.full(3, np.nan), np.full(3, np.nan), np.full((4, 4), np.nan), rows)


def _views(frames, cameras: Cameras, background) -> list[View]:
    views = []
    for camera in cameras:
        pictures = frames.get(camera.name, {})
        if len(pictures) < 3:
            continue
        first, second = list(pictures.values())[:2]
        known = background.get(camera.name)
        known = np.zeros(first.shape) if known is None else np.asarray(known, dtype=float)
        views.append(View(camera, pictures, known, measure_noise(first, second)))
    if not views:
        raise Refused("no camera has three frames or more")
    return views


def _see_whisk(number: int, indices, views, cameras, rods: Rods, bar: SeenBar, time_s, motor_rad,
               light: dict[str, Lit], settings: VisionSettings, misled: Sequence[str] = ()) -> WhiskTruth:
    """Truth of one whisk; its status where there is none. misled: lines on cameras that were left out already."""
    views, left_out = _with_frames(views, indices)
    left_out = [*left_out, *misled]
    seen = [f for f in indices if all(f in view.frames for view in views)]
    if len(seen) < 4:
        few = f"{len(seen)} frames seen by every camera, 4 are needed"
        return WhiskTruth(number, None, status="; ".join([few, *left_out]))
    cameras = cameras.subset([view.camera.name for view in views])
    motor = {f: float(motor_rad[f]) for f in seen}
    try:
        problem, state, answer, near = fit_whisk(views, cameras, rods, bar, motor, light, settings)
    except (Refused, np.linalg.LinAlgError) as reason:
        status = str(reason) if isinstance(reason, Refused) else "the fit of wire and bar does not settle"
        if isinstance(reason, Misled) and len(views) > 1:
            others = [view for view in views if view.camera.name != reason.camera]
            return _see_whisk(number, indices, others, cameras, rods, bar, time_s, motor_rad, light, settings,
                              [*left_out, status])
        return WhiskTruth(number, None, cameras=len(views), frames_used=len(seen),
                          status="; ".join([status, *left_out]))
    measured, by_parameter = jacobians(problem, state)
    known = uncertainty(problem, state, answer)
    far = set(motor) - set(near)
    whisk = to_whisk(number, indices, near, time_s, motor_rad, problem, state, measured, by_parameter, known,
                     views, rods.bar.radius_mm, settings, far)
    beam = check_beam(problem, state, known.covariance, measured, by_parameter)
    status = "; ".join(filter(None, [whisk.status, beam.alarm, *left_out]))
    stroke = free_stroke(views, rods, problem, state, motor, near, light, settings) if far else (problem, state)
    return replace(whisk, base=base_lines(*stroke, known.lens), beam=beam, status=status)


def _with_frames(views, indices) -> tuple[list[View], list[str]]:
    """The views that have most of the frames, and lines on those left out: one camera's gaps are not all cameras'."""
    counts = [sum(f in view.frames for f in indices) for view in views]
    kept = [view for view, count in zip(views, counts) if count > _FEWEST_SHARE * max(counts)]
    lost = [f"camera {view.camera.name} was left out: {count} frames of {len(indices)}"
            for view, count in zip(views, counts) if count <= _FEWEST_SHARE * max(counts)]
    return kept, lost


