"""`whisker-bench view`: a trial as an annotated film: its frames with wire, bar and contact, the curves below them."""

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bench.base.atomic import whole_file
from bench.base.errors import BadInput
from bench.records.trial_result import SeenWhisk, TrialResult
from bench.report.painting import as_8_bit, polyline
from bench.report.pooled import read_run
from bench.report.record import SESSION, read_record
from bench.report.run_facts import CameraFacts
from bench.session.footage import read_frames
from bench.session.frame_times import frame_times
from bench.session.session import load_session
from bench.session.trial import Trial
from vision.geometry.camera import Camera
from vision.geometry.centreline import one_curve
from vision.geometry.rods import Wire

FOURCC = {".webm": "VP90", ".avi": "MJPG"}
_WIDTH_PX = 720  # of each camera's picture
_STRIP_PX = 190  # of the curves below
_WIRE, _BAR, _CONTACT, _TRAIL = (
    (47, 217, 255),
    (74, 175, 77),
    (28, 26, 228),
    (142, 126, 31),
)  # blue, green, red
_INK, _GREY, _PAPER = (30, 30, 30), (170, 170, 170), (255, 255, 255)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_AT_ONCE = 32  # frames
_HALF_BAR_MM = 45.0
# [1] A layout: of the reach of a curve, on either side.
_MARGIN = 0.06


@dataclass(frozen=True)
class Curve:
    """A quantity over the motor angle: name with unit, and a value a frame (n,), NaN where it is not known."""

    name: str
    values: np.ndarray


def write_video(
    out: Path,
    trial: str,
    path: Path | None = None,
    session: Path | None = None,
    rate_Hz: float = 10.0,
) -> Path:
    """The film of a trial of an evaluated run; where it was written (by default OUT/video/<trial>.webm).

    session: where its pictures are, by default where they were. Raises BadInput where there is no such trial, no
    pictures, or OpenCV cannot write such a film.
    """
    record = read_record(out)
    result = _result(out, trial)
    path = out / "video" / f"{trial}.webm" if path is None else path
    code = FOURCC.get(path.suffix.lower())
    if code is None:
        raise BadInput(f"must end in {' or '.join(FOURCC)}", file=path)
    if not (math.isfinite(rate_Hz) and 0.1 <= rate_Hz <= 240.0):
        raise BadInput(f"--rate-Hz is {rate_Hz:g}; from 0.1 to 240 is allowed")
    source = _session_folder(out) if session is None else session
    recorded = load_session(
        source, lenses_known=True, follow_links=record.settings.follow_links
    ).trial(trial)
    cameras = {c.name: c for c in record.cameras if c.name in recorded.camera_sources}
    if not cameras:
        raise BadInput("has no pictures of this trial; give --session", file=source)
    pictures = _frames(recorded, cameras, result)
    with whole_file(path) as temporary:
        _write(temporary, pictures, code, rate_Hz)
    return path


def _result(out: Path, trial: str) -> TrialResult:
    results = {result.trial.name: result for result in read_run(out)}
    if trial not in results:
        raise BadInput(f"there is no trial {trial!r}; there are {', '.join(results)}", file=out)
    if not any(whisk.frames is not None for whisk in results[trial].seen.whisks):
        said = next((w.status for w in results[trial].seen.whisks if w.status), "nothing was seen")
        raise BadInput(f"trial {trial!r} has nothing to show: {said}", file=out)
    return results[trial]


def _session_folder(out: Path) -> Path:
    try:
        return Path((out / SESSION).read_text(encoding="utf-8").strip())
    except OSError:
        raise BadInput("does not say where its session is; give --session", file=out) from None


def _write(path: Path, pictures: Iterator[np.ndarray], code: str, rate_Hz: float) -> None:
    writer = None
    for picture in pictures:
        if writer is None:
            size = picture.shape[1], picture.shape[0]
            with _quiet_ffmpeg():
                writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*code), rate_Hz, size)
            if not writer.isOpened():
                raise BadInput(
                    f"this OpenCV writes no {code} film; try --out with .avi", file=path.name
                )
        writer.write(picture)
    if writer is None:
        raise BadInput("no camera has a picture of these frames; give --session")
    writer.release()


@contextmanager
def _quiet_ffmpeg() -> Iterator[None]:
    """OpenCV says on descriptor 2, whatever its log level, that WebM has no tag for VP9: it needs none."""
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _frames(
    trial: Trial, cameras: Mapping[str, CameraFacts], result: TrialResult
) -> Iterator[np.ndarray]:
    """Pictures (h, w, 3) of the film, in the order of the frames."""
    times = frame_times(trial)
    for whisk in result.seen.whisks:
        frames = whisk.frames
        for start in range(0, 0 if frames is None else len(frames.index), _AT_ONCE):
            rows = range(start, min(start + _AT_ONCE, len(frames.index)))
            read = {}
            for name in cameras:
                index = [int(times.picture[name][frames.index[k]]) for k in rows]
                found = read_frames(trial.camera_sources[name], [i for i in index if i >= 0])
                read[name] = [found.get(i) for i in index]
            for place, k in enumerate(rows):
                shown = [
                    _picture(read[name][place], camera, result, whisk, k)
                    for name, camera in cameras.items()
                ]
                yield _with_curves(_beside(shown), whisk, k)


def _picture(grey, facts: CameraFacts, result: TrialResult, whisk: SeenWhisk, k: int) -> np.ndarray:
    """One camera's picture, (h, _WIDTH_PX, 3), with what was found in frame k."""
    width, height = facts.size_px
    scale = _WIDTH_PX / width
    size = (_WIDTH_PX, round(scale * height))
    if grey is None:
        picture = np.full((size[1], size[0], 3), 60, np.uint8)
        _text(picture, f"{facts.name}: no picture", (12, 24), _PAPER)
        return picture
    picture = cv2.cvtColor(
        cv2.resize(as_8_bit(grey), size, interpolation=cv2.INTER_AREA), cv2.COLOR_GRAY2BGR
    )
    camera = Camera(
        facts.name, tuple(facts.size_px), facts.matrix, facts.distortion, facts.T_camera_rig
    )
    for points, colour in _lines(camera, result, whisk, k):
        polyline(picture, scale * (camera.project(points) + 0.5) - 0.5, colour)
    if whisk.frames.touching[k]:
        ((x, y),) = scale * (camera.project(whisk.frames.point_mm.value[k : k + 1]) + 0.5) - 0.5
        cv2.circle(picture, (round(x), round(y)), 5, _CONTACT, 1, cv2.LINE_AA)
    _text(picture, f"{facts.name}, frame {int(whisk.frames.index[k])}", (12, 24), _PAPER)
    return picture


def _lines(camera: Camera, result: TrialResult, whisk: SeenWhisk, k: int):
    """Points (n, 3), mm, of each line to draw with its colour: bar's edges, the wire, the contact's way so far."""
    seen, frames = result.seen, whisk.frames
    if seen.bar is not None and whisk.has_truth:
        along = seen.bar.direction
        nearest = seen.bar.point_mm + ((whisk.point_mm.value - seen.bar.point_mm) @ along) * along
        axis = nearest + np.linspace(-_HALF_BAR_MM, _HALF_BAR_MM, 20)[:, None] * along
        sight = np.cross(along, nearest - camera.centre_mm)
        across = seen.bar_radius_mm * sight / np.linalg.norm(sight)
        yield from ((axis + side * across, _BAR) for side in (-1, 1))
    contact = frames.point_mm.value[k] if frames.touching[k] else None
    yield _wire(result, whisk, k, contact), _WIRE
    past = frames.point_mm.value[: k + 1][np.asarray(frames.touching[: k + 1], dtype=bool)]
    if len(past) > 1:
        yield past, _TRAIL


def _wire(
    result: TrialResult, whisk: SeenWhisk, k: int, contact_mm: np.ndarray | None
) -> np.ndarray:
    """The whisker (n, 3), mm, as it was fitted in frame k; unbent in frames that are not in the fit."""
    motor = float(whisk.frames.motor_rad[k])
    if whisk.truth.shape is None:
        return wire_between(motor, contact_mm, result.whisker.length_mm)
    facts, shape = result.whisker, whisk.truth.shape
    wire = Wire(
        facts.shape, facts.length_mm, facts.diameter_mm, tip_diameter_mm=facts.tip_diameter_mm
    )
    mine = np.flatnonzero(shape.index == whisk.frames.index[k])
    bend, arc = (
        (shape.bend_rad[mine[0]], shape.arc_mm[mine[0]])
        if len(mine)
        else (np.zeros(2), facts.length_mm)
    )
    return one_curve(shape.rest_mm, bend, arc, motor, wire).points_mm


def wire_between(motor_rad: float, contact_mm: np.ndarray | None, length_mm: float) -> np.ndarray:
    """The whisker (n, 3), mm, drawn as a beam with a point load: clamped at the base along the motor's angle, through
    the contact (3,), straight beyond it: where no fitted curve is kept."""
    along = np.array([np.cos(motor_rad), np.sin(motor_rad), 0.0])
    if contact_mm is None:
        return np.linspace(0.0, length_mm, 30)[:, None] * along
    reach = float(contact_mm @ along)
    s = np.linspace(0.0, length_mm / reach, 40)
    bend = np.where(s < 1, 0.5 * (3 * s**2 - s**3), 1 + 1.5 * (s - 1))
    return (s * reach)[:, None] * along + bend[:, None] * (contact_mm - reach * along)


def _beside(pictures: list[np.ndarray]) -> np.ndarray:
    """Pictures of one width side by side, the lower ones filled up."""
    height = max(picture.shape[0] for picture in pictures)
    return np.hstack([np.pad(p, ((0, height - p.shape[0]), (0, 0), (0, 0))) for p in pictures])


def _with_curves(picture: np.ndarray, whisk: SeenWhisk, k: int) -> np.ndarray:
    """The picture with strips of curves below it, up to frame k dark, what comes grey."""
    strip = np.full((_STRIP_PX, picture.shape[1], 3), 255, np.uint8)
    curves = curves_of(whisk)
    width = strip.shape[1] // len(curves)
    theta = np.degrees(whisk.frames.theta_rad.value)
    for place, curve in enumerate(curves):
        _plot(strip[:, place * width : (place + 1) * width], theta, curve, k)
    whole = np.vstack([picture, strip])
    return whole[: whole.shape[0] // 2 * 2, : whole.shape[1] // 2 * 2]  # coders want even sizes


def curves_of(whisk: SeenWhisk) -> tuple[Curve, ...]:
    """What runs below the pictures."""
    frames = whisk.frames
    on = np.asarray(frames.touching, dtype=bool)
    return (
        Curve("slip [mm]", np.where(on, frames.slip_mm.value, np.nan)),
        Curve("phi [deg]", np.where(on, np.degrees(frames.phi_rad.value), np.nan)),
    )


def _plot(panel: np.ndarray, theta: np.ndarray, curve: Curve, k: int) -> None:
    """Draw one curve into its panel (h, w, 3)."""
    height, width = panel.shape[:2]
    left, right, top, bottom = 56, width - 14, 30, height - 26
    theta_limits = _limits(theta)
    limits = _limits(np.append(curve.values[np.isfinite(curve.values)], 0.0))
    x = np.interp(theta, theta_limits, (left, right))
    y = np.interp(curve.values, limits, (bottom, top))
    for value in _ticks(limits, 3):
        row = round(float(np.interp(value, limits, (bottom, top))))
        cv2.line(panel, (left, row), (right, row), (225, 225, 225), 1)
        _text(panel, f"{value:g}", (6, row + 4), _INK)
    for value in _ticks(theta_limits, 5):
        column = round(float(np.interp(value, theta_limits, (left, right))))
        _text(panel, f"{value:g}", (column - 6, height - 8), _INK)
    points = np.stack([x, y], axis=1)
    polyline(panel, points, _GREY)
    polyline(panel, points[: k + 1], _INK)
    cv2.line(panel, (round(x[k]), top), (round(x[k]), bottom), _CONTACT, 1)
    now = f" = {curve.values[k]:.3f}" if np.isfinite(curve.values[k]) else ""
    _text(panel, f"{curve.name}{now}  at theta = {theta[k]:.2f} deg", (left, 18), _INK)


def _limits(values: np.ndarray) -> tuple[float, float]:
    """Return limits that hold all values, with a margin on either side."""
    low = float(values.min())
    high = float(values.max())
    margin = _MARGIN * ((high - low) or abs(high) or 1.0)
    return low - margin, high + margin


def _ticks(limits: tuple[float, float], most: int) -> list[float]:
    """Return round values within limits."""
    from matplotlib.ticker import MaxNLocator  # with all of matplotlib

    found = MaxNLocator(most, steps=[1, 2, 5, 10]).tick_values(*limits)
    return [value for value in found if limits[0] <= value <= limits[1]]


def _text(picture: np.ndarray, text: str, place: tuple[int, int], colour) -> None:
    cv2.putText(picture, text, place, _FONT, 0.45, colour, 1, cv2.LINE_AA)
