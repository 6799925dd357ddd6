"""A tracker's lines held against ours: bias and scatter across the wire, frame by frame.

Ours is the curve that the bench's own fit has by the pictures, never by the traces. Offsets are
signed: positive to the right of the way from base to tip, as the picture shows it. The bias is what
frames have in common, the scatter what single points are off by about that. A tracker that follows
one edge of the wire has a bias of half its width and little scatter.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.atomic import lock_output
from bench.base.drawing import OTHER_COLOURS, publish, style
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table, alike, with_sigma
from bench.base.workers import Workers
from bench.records.trial_result import SeenTrial
from bench.session.footage import visible
from bench.session.frame_times import frame_times
from bench.session.inside import check_outside
from bench.session.session import Session
from bench.session.session_check import checked_session, trials_with_whisks
from bench.session.trace_files import trace_files
from bench.session.traces import Traced, read_traces
from bench.session.trial import Trial
from bench.trials.lost import see_units
from bench.trials.of_session import placed_units, require_some
from bench.trials.unit import Unit
from vision import (
    NEAR_CLAMP_MM,
    WIRE_OFFSET_PX,
    BesideWire,
    WhiskTruth,
    beside_wire,
    lines_along_wire,
    points_of_wire,
)
from vision.geometry import Camera, Wire, centrelines, counted, unbent_curves

FIGURE = "trace_scores"
NEAR = "near"
ABSENT = "no trace"
ELSEWHERE = "elsewhere"
# [mm] Of the wire: bins of the figure. Stated.
_BIN_MM = 5.0
# [1] Neighbouring frames more alike than this count as this much alike. Stated.
_MOST_ALIKE = 0.9
# [percentiles] Between which two thirds of the points are.
_TWO_THIRDS = (16.0, 50.0, 84.0)
_CAMERA = Column("camera", "name of the camera", Kind.TEXT)

TRACE_FRAMES = Table(
    "trace_frames",
    "A row a frame of a whisk with a truth and a camera with a trace, by `score-traces`.",
    (
        TRIAL,
        WHISK,
        _CAMERA,
        Column("frame", "index of the frame", Kind.WHOLE),
        Column("state", f"{NEAR}; {ABSENT}; {ELSEWHERE}: no line within 6 px of ours", Kind.TEXT),
        Column("line", "number of the tracker's line that is nearest to ours"),
        Column("points", "how many of its points are within 6 px of ours", Kind.WHOLE),
        Column("coverage_percent", "of the wire beyond the hub that is in the picture"),
        Column("bias_px", "mean offset across the wire"),
        Column("scatter_px", "standard deviation about that"),
    ),
)
TRACE_SCORES = Table(
    "trace_scores",
    "A row a camera and trial, then a row a camera over all trials, without a trial's name.",
    (
        TRIAL,
        _CAMERA,
        Column("frames", "how many frames of whisks with a truth", Kind.WHOLE),
        *alike(
            ("frames_without", "frames_elsewhere"), "of these, see trace_frames.csv", Kind.WHOLE
        ),
        Column(
            "identity_mistakes",
            "frames in which another of the tracker's lines is on the wire than in most; empty where "
            "it knows none again",
        ),
        Column("coverage_percent", "of the wire, over frames with a line near it"),
        *with_sigma("bias_px", "mean offset across the wire; the sigma holds that of our line"),
        *with_sigma("scatter_px", "standard deviation of points about the bias"),
    ),
)


@dataclass(frozen=True)
class FrameScore:
    """A tracker's line in one frame of one camera; NaN where none is near ours."""

    trial: str
    whisk: int
    camera: str
    frame: int
    state: str
    line: float = np.nan
    points: int = 0
    coverage_percent: float = np.nan
    bias_px: float = np.nan
    scatter_px: float = np.nan


@dataclass(frozen=True, eq=False)
class TrialScores:
    """A trial's frames, and by camera places (n,) mm along the wire and offsets (n,) px of points.

    has_identity: by camera, whether its lines have the same number in all frames. unseen: how many
    whisks have no truth.
    """

    frames: tuple[FrameScore, ...]
    points: Mapping[str, tuple[np.ndarray, np.ndarray]]
    has_identity: Mapping[str, bool]
    unseen: int = 0


@dataclass(frozen=True)
class TraceScore:
    """A tracker in one camera, in one trial or ('') over all."""

    trial: str
    camera: str
    frames: int
    frames_without: int
    frames_elsewhere: int
    identity_mistakes: float
    coverage_percent: float
    bias_px: float
    bias_sigma_px: float
    scatter_px: float
    scatter_sigma_px: float

    def __str__(self) -> str:
        """Say the result in a sentence."""
        without = counted(self.frames_without, "frame")
        missing = f"{without} of {self.frames} without a trace"
        if self.frames_elsewhere:
            missing += f", {self.frames_elsewhere} with one elsewhere"
        if np.isfinite(self.identity_mistakes):
            missing += f", {counted(int(self.identity_mistakes), 'identity mistake')}"
        if not np.isfinite(self.bias_px):
            return f"{self.camera}: no line on the wire; {missing}"
        bias = f"bias {self.bias_px:+.2f} ± {self.bias_sigma_px:.2f} px"
        scatter = f"scatter {self.scatter_px:.2f} ± {self.scatter_sigma_px:.2f} px"
        return f"{self.camera}: {bias}, {scatter} over {self.coverage_percent:.0f} % of the wire; {missing}"


def score_traces(
    session_path: Path, traces: Path, out: Path, settings: Settings, *, workers: int = 1
) -> tuple[list[TraceScore], list[str]]:
    """Write tables and figure into `out`; return the scores of each camera, and warnings.

    traces: a folder with one a trial, of the trials' names. What `out` holds of the session's truth
    is not made again. Raises BadInput.
    """
    check_outside(out, session_path)
    problems = InputProblems()
    session = _by_pictures(
        checked_session(session_path, problems, follow_links=settings.follow_links)
    )
    recorded = trials_with_whisks(session)
    require_some(recorded, settings)
    read = _read_all(traces, recorded, settings)
    with lock_output(out), Workers(workers) as pool:
        _, units = placed_units(session, recorded, out, settings, pool, problems)
        chosen = [unit for unit in units if unit.trial.name in read]
        seen = see_units(chosen, pool, "trials seen by their pictures", problems)
        scored = _score_trials(chosen, seen, read)
    scores = list(_scores(scored))
    _write_scores(out, scored, scores)
    pooled = [score for score in scores if not score.trial]
    return pooled, list(_warnings(scored, pooled))


def _read_all(
    traces: Path, recorded: Sequence[Trial], settings: Settings
) -> dict[str, dict[str, Traced]]:
    """Return by trial the traces of the folder, of the trials that the settings take. Raises BadInput."""
    files = _files_by_trial(traces, [trial for trial in recorded if settings.takes(trial.name)])
    read = {}
    for trial in recorded:
        if trial.name in files:
            read[trial.name] = _read(trial, files[trial.name])
    return read


def _score_trials(
    units: Sequence[Unit], seen: Iterable[SeenTrial], read: Mapping[str, Mapping[str, Traced]]
) -> list[TrialScores]:
    """Return the scores of trials as seen; read: traces by trial and camera."""
    scored = []
    for unit, trial_seen in zip(units, seen):
        scored.append(score_trial(unit, trial_seen, read[unit.trial.name]))
    return scored


def _write_scores(out: Path, scored: Sequence[TrialScores], scores: Sequence[TraceScore]) -> None:
    """Write the tables of frames and of scores, and the figure."""
    TRACE_FRAMES.write(out, [vars(frame) for trial in scored for frame in trial.frames])
    TRACE_SCORES.write(out, [vars(score) for score in scores])
    with style():
        publish(draw(scored), out / FIGURE)


def _by_pictures(session: Session) -> Session:
    """Return the session without traces of its own, so that its truth is by its pictures alone."""
    trials = tuple(replace(trial, trace_files={}) for trial in session.trials)
    return replace(session, trials=trials)


def _files_by_trial(traces: Path, trials: Sequence[Trial]) -> dict[str, dict[str, Path]]:
    """Return the files of traces of each trial that has some. Raise BadInput where none has."""
    if not traces.is_dir():
        raise BadInput("is no folder", file=traces)
    found = {}
    for trial in trials:
        files = trace_files(traces / trial.name, f"{traces.name}/{trial.name}")
        if files:
            found[trial.name] = files
    if found:
        return found
    there = ", ".join(path.name for path in visible(traces)) or "nothing"
    wanted = f"{trials[0].name}/trace_<camera>.csv" if trials else "a trial"
    raise BadInput(f"holds no trace of a trial, such as {wanted}; found {there}", file=traces)


def _read(trial: Trial, files: Mapping[str, Path]) -> dict[str, Traced]:
    """Return the traces of a trial by camera. Raise BadInput."""
    picture = frame_times(trial).picture
    return read_traces(files, trial.camera_sources, picture, trial.name)


def score_trial(unit: Unit, seen: SeenTrial, traces: Mapping[str, Traced]) -> TrialScores:
    """Return the scores of a trial's traces against its truth."""
    frames = []
    points: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    known = [whisk.truth for whisk in seen.whisks if whisk.truth.shape is not None]
    for name, traced in traces.items():
        camera = unit.calibration.cameras[name]
        of_camera = []
        for truth in known:
            beside, rows = _score_whisk(unit, truth, camera, traced)
            of_camera.append(beside)
            frames += rows
        if of_camera:
            near = BesideWire.join(of_camera)
            points[name] = near.place_mm, near.offset_px
    identity = {name: traced.has_identity for name, traced in traces.items()}
    return TrialScores(tuple(frames), points, identity, len(seen.whisks) - len(known))


def _score_whisk(
    unit: Unit, truth: WhiskTruth, camera: Camera, traced: Traced
) -> tuple[BesideWire, list[FrameScore]]:
    """Return a camera's points on the wire in one whisk, and the score of each frame."""
    curves = wire_curves(truth, unit.session.whisker.wire)
    beside = beside_wire(traced.trace, camera, curves)
    beyond_hub = beside.select(beside.place_mm > NEAR_CLAMP_MM)
    near = points_of_wire(beyond_hub)
    line = lines_along_wire(beyond_hub)
    with_trace = set(traced.trace.frame.tolist())
    of_frame = partial(FrameScore, unit.trial.name, truth.whisk, camera.name)
    rows = []
    for frame, curve in curves.items():
        own = near.select(near.frame == frame)
        if len(own.offset_px):
            scored = _offsets_in_frame(own, camera, curve)
            rows.append(of_frame(frame, NEAR, line=float(line[frame]), **scored))
        else:
            rows.append(of_frame(frame, ELSEWHERE if frame in with_trace else ABSENT))
    return near, rows


def _offsets_in_frame(own: BesideWire, camera: Camera, curve: np.ndarray) -> dict[str, float]:
    """Return the fields of a FrameScore that a frame's points on the wire give."""
    return {
        "points": len(own.offset_px),
        "coverage_percent": _coverage_percent(own, camera, curve),
        "bias_px": float(np.mean(own.offset_px)),
        "scatter_px": float(np.std(own.offset_px)),
    }


def _coverage_percent(own: BesideWire, camera: Camera, curve) -> float:
    """Return the share of the wire in the picture, from its first point of a trace to its last."""
    first_mm, last_mm = _in_picture_mm(camera, curve)
    covered_mm = np.ptp(np.clip(own.place_mm, first_mm, last_mm))
    return 100.0 * covered_mm / max(last_mm - first_mm, _BIN_MM)


def wire_curves(truth: WhiskTruth, wire: Wire) -> dict:
    """Return the wire's curve by frame: as fitted, and unbent in the frames before the fit's first."""
    shape = truth.shape
    frames = truth.frames
    motor_rad = dict(zip(frames.index.tolist(), frames.motor_rad.tolist()))
    fitted = {}
    for k, frame in enumerate(shape.index.tolist()):
        fitted[frame] = centrelines(
            shape.rest_mm, shape.bend_rad[k], shape.arc_mm[k], motor_rad[frame], wire
        )
    first = min(fitted)
    before = {frame: angle for frame, angle in motor_rad.items() if frame < first}
    return unbent_curves(shape.rest_mm, before, wire) | fitted


def _in_picture_mm(camera: Camera, curve) -> tuple[float, float]:
    """Return from where to where, mm, the wire beyond the hub is in the picture."""
    px = camera.project(curve.points_mm)
    is_inside = np.all((px >= 0.0) & (px <= np.array(camera.size_px) - 1.0), axis=1)
    arcs_mm = curve.arc_mm[is_inside & (curve.arc_mm > NEAR_CLAMP_MM)]
    return (float(arcs_mm[0]), float(arcs_mm[-1])) if len(arcs_mm) else (0.0, 0.0)


def _scores(scored: Sequence[TrialScores]) -> Iterator[TraceScore]:
    """Yield the score of each camera in each trial, then over all."""
    cameras = dict.fromkeys(frame.camera for trial in scored for frame in trial.frames)
    for trial in scored:
        for camera in cameras:
            own = _frames_of(camera, [trial])
            if own:
                yield _score(own[0].trial, camera, [trial])
    for camera in cameras:
        yield _score("", camera, scored)


def _score(name: str, camera: str, scored: Sequence[TrialScores]) -> TraceScore:
    """Return the score of a camera over some trials."""
    frames = _frames_of(camera, scored)
    states = Counter(frame.state for frame in frames)
    near = [frame for frame in frames if frame.state == NEAR]
    offset_px = _offsets_px(camera, scored)
    bias_px, bias_sigma_px = _mean_of_frames(near, lambda frame: frame.bias_px)
    scatter_px, scatter_sigma_px = np.nan, np.nan
    if near:
        scatter_px = float(np.sqrt(np.mean((offset_px - bias_px) ** 2)))
        _, scatter_sigma_px = _mean_of_frames(near, lambda frame: frame.scatter_px)
    return TraceScore(
        trial=name,
        camera=camera,
        frames=len(frames),
        frames_without=states[ABSENT],
        frames_elsewhere=states[ELSEWHERE],
        identity_mistakes=_identity_mistakes(scored, camera),
        coverage_percent=_mean([frame.coverage_percent for frame in near]),
        bias_px=bias_px,
        bias_sigma_px=math.hypot(bias_sigma_px, WIRE_OFFSET_PX),
        scatter_px=scatter_px,
        scatter_sigma_px=scatter_sigma_px,
    )


def _frames_of(camera: str, scored: Iterable[TrialScores]) -> list[FrameScore]:
    """Return the scores of a camera's frames over some trials."""
    frames = []
    for trial in scored:
        frames += [frame for frame in trial.frames if frame.camera == camera]
    return frames


def _offsets_px(camera: str, scored: Iterable[TrialScores]) -> np.ndarray:
    """Return the offsets (n,) of a camera's points from the wire over some trials, px."""
    offsets = [trial.points[camera][1] for trial in scored if camera in trial.points]
    return np.concatenate(offsets) if offsets else np.zeros(0)


def _identity_mistakes(scored: Iterable[TrialScores], camera: str) -> float:
    """Return in how many frames another line is on the wire than in most of the trial's; NaN where
    the tracker knows no line again.
    """
    mistakes = np.nan
    for trial in scored:
        if not trial.has_identity.get(camera, False):
            continue
        lines = []
        for frame in trial.frames:
            if frame.camera == camera and frame.state == NEAR:
                lines.append(frame.line)
        usual = max(Counter(lines).values(), default=0)
        mistakes = np.nansum([mistakes, len(lines) - usual])
    return float(mistakes)


def _mean(values: Sequence[float]) -> float:
    """Return the mean; NaN of none."""
    return float(np.mean(values)) if values else np.nan


def _mean_of_frames(
    frames: Sequence[FrameScore], value_of: Callable[[FrameScore], float]
) -> tuple[float, float]:
    """Return the mean over frames and its sigma, neighbouring frames being alike; NaN of none."""
    values = np.array([value_of(frame) for frame in frames])
    if len(values) == 0:
        return np.nan, np.nan
    mean = float(np.mean(values))
    if len(values) < 2:
        return mean, np.nan
    variance = np.var(values, ddof=1)
    products = _neighbour_products(frames, value_of, mean)
    alike_share = np.mean(products) / variance if products and variance > 0.0 else 0.0
    alike_share = float(np.clip(alike_share, 0.0, _MOST_ALIKE))
    inflation = (1.0 + alike_share) / (1.0 - alike_share)
    return mean, float(np.sqrt(variance * min(inflation, len(values)) / len(values)))


def _neighbour_products(
    frames: Sequence[FrameScore], value_of: Callable[[FrameScore], float], mean: float
) -> list[float]:
    """Return the products of the deviations of neighbouring frames of a whisk from the mean."""
    products = []
    for _, whisk in groupby(frames, key=lambda frame: (frame.trial, frame.whisk)):
        deviation = np.array([value_of(frame) for frame in whisk]) - mean
        products += (deviation[1:] * deviation[:-1]).tolist()
    return products


def _warnings(scored: Sequence[TrialScores], pooled: Sequence[TraceScore]) -> Iterator[str]:
    """Yield what a reader of the scores must know."""
    unseen = sum(trial.unseen for trial in scored)
    if unseen:
        yield f"{counted(unseen, 'whisk')} without a truth, and so without a score"
    if not pooled:
        yield "no whisk with a trace has a truth: nothing is scored"
    for score in pooled:
        lost = score.frames_without + score.frames_elsewhere
        if 2 * lost > score.frames:
            yield f"camera {score.camera}: {lost} of {score.frames} frames have no line on the wire"


def draw(scored: Sequence[TrialScores]) -> Figure:
    """Draw each camera's offsets: left along the wire, right the bias of each frame in its order."""
    cameras = dict.fromkeys(name for trial in scored for name in trial.points)
    count = max(len(cameras), 1)
    figure = Figure(figsize=(9.0, 0.6 + 2.4 * count), layout="constrained")
    panels = figure.subplots(count, 2, squeeze=False, sharey="row")
    for (along, in_time), camera, colour in zip(panels, cameras, OTHER_COLOURS * count):
        _draw_along(along, scored, camera, colour)
        frames = _frames_of(camera, scored)
        order = np.arange(len(frames))
        bias_px = [frame.bias_px for frame in frames]
        scatter_px = [frame.scatter_px for frame in frames]
        in_time.errorbar(order, bias_px, scatter_px, fmt="o", ms=3, lw=0.8, color=colour)
        in_time.axhline(0.0, color="0.6", lw=0.8)
        in_time.set(xlabel="frames, trial by trial", title=f"{camera}: bias, bars scatter")
    return figure


def _draw_along(axes: Axes, scored: Sequence[TrialScores], camera: str, colour: str) -> None:
    """Draw the median offset along the wire, and the range of two thirds of the points."""
    own = [trial.points[camera] for trial in scored if camera in trial.points]
    place_mm = np.concatenate([place for place, _ in own])
    offset_px = np.concatenate([offset for _, offset in own])
    bins = np.floor(place_mm / _BIN_MM).astype(int)
    middles_mm = []
    ranges = []
    for number in np.unique(bins):
        middles_mm.append((number + 0.5) * _BIN_MM)
        ranges.append(np.percentile(offset_px[bins == number], _TWO_THIRDS))
    if ranges:
        low, median, high = np.transpose(ranges)
        axes.fill_between(middles_mm, low, high, color=colour, alpha=0.2, lw=0)
        axes.plot(middles_mm, median, color=colour)
    axes.axhline(0.0, color="0.6", lw=0.8)
    title = f"{camera}: median, and two thirds of the points"
    axes.set(xlabel="along the wire, mm", ylabel="offset, px", title=title)
