"""`whisker-bench view`: a trial as an annotated film, its frames with wire, bar and contact, and curves below them."""

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np

from bench.base.atomic import whole_file
from bench.base.errors import BadInput
from bench.base.progress import begin_step, count_parts
from bench.records.trial_result import SeenTrial, SeenWhisk, TrialResult, WhiskerFacts
from bench.report import painting
from bench.report.record import SESSION, read_record
from bench.report.run_facts import CameraFacts
from bench.report.run_folder import read_results
from bench.session.footage import read_frames
from bench.session.frame_times import FrameTimes, frame_times
from bench.session.session import load_session
from bench.session.trial import Trial
from vision.geometry import Camera, ProfiledWire, Wire, centrelines

FOURCC = {".webm": "VP90", ".avi": "MJPG"}
# Colours, BGR.
_CONTACT = (28, 26, 228)
_PATH = (142, 126, 31)
_NO_PICTURE = (60, 60, 60)
_FRAMES_READ = 32  # at once
_HALF_BAR_MM = 45.0


def write_video(
    out: Path,
    trial: str,
    path: Path | None = None,
    session: Path | None = None,
    rate_Hz: float = 10.0,
) -> Path:
    """Write the film of a trial of an evaluated run; return its path, by default OUT/video/<trial>.webm.

    session: where its pictures are, by default where they were. Raises BadInput where there is no
    such trial, no pictures, or OpenCV cannot write such a film.
    """
    record = read_record(out)
    result = _result(out, trial)
    path = out / "video" / f"{trial}.webm" if path is None else path
    codec_of(path)
    if not (math.isfinite(rate_Hz) and 0.1 <= rate_Hz <= 240.0):
        raise BadInput(f"--rate-Hz is {rate_Hz:g}; from 0.1 to 240 is allowed")
    source = _session_folder(out) if session is None else session
    links = record.settings.follow_links
    recorded = load_session(source, lenses_known=True, follow_links=links).trial(trial)
    cameras = [camera for camera in record.cameras if camera.name in recorded.camera_sources]
    if not cameras:
        raise BadInput("has no pictures of this trial; give --session", file=source)
    pictures = _film(recorded, cameras, result)
    write_pictures(path, pictures, rate_Hz)
    return path


def codec_of(path: Path) -> str:
    """Return the code of the film's codec by its suffix. Raises BadInput for another suffix."""
    code = FOURCC.get(path.suffix.lower())
    if code is None:
        raise BadInput(f"must end in {' or '.join(FOURCC)}", file=path)
    return code


def _result(out: Path, trial: str) -> TrialResult:
    """Return the result of a trial. Raise BadInput where there is none, or nothing was seen in it."""
    results = {result.trial.name: result for result in read_results(out)}
    if trial not in results:
        raise BadInput(f"there is no trial {trial!r}; there are {', '.join(results)}", file=out)
    whisks = results[trial].seen.whisks
    if all(whisk.frames is None for whisk in whisks):
        why = next((whisk.status for whisk in whisks if whisk.status), "nothing was seen")
        raise BadInput(f"trial {trial!r} has nothing to show: {why}", file=out)
    return results[trial]


def _session_folder(out: Path) -> Path:
    """Return where the session of a run was. Raise BadInput where that is not written down."""
    try:
        return Path((out / SESSION).read_text(encoding="utf-8").strip())
    except OSError:
        raise BadInput("does not say where its session is; give --session", file=out) from None


def write_pictures(path: Path, pictures: Iterator[np.ndarray], rate_Hz: float) -> None:
    """Write pictures as a film, whole. Raise BadInput where there are none, or OpenCV cannot."""
    first = next(pictures, None)
    if first is None:
        raise BadInput("no camera has a picture of these frames; give --session")
    height, width, _ = first.shape
    code = codec_of(path)
    fourcc = cv2.VideoWriter_fourcc(*code)
    with whole_file(path) as temporary:
        with _quiet_ffmpeg():
            writer = cv2.VideoWriter(str(temporary), fourcc, rate_Hz, (width, height))
        if not writer.isOpened():
            raise BadInput(
                f"this OpenCV writes no {code} film; try --out with .avi", file=path.name
            )
        writer.write(first)
        for picture in pictures:
            writer.write(picture)
        begin_step("encoding the film")  # its last frames all at once
        writer.release()


@contextmanager
def _quiet_ffmpeg() -> Iterator[None]:
    """Send descriptor 2 nowhere.

    OpenCV says there, whatever its log level, that WebM has no tag for VP9: it needs none.
    """
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def _film(
    trial: Trial, cameras: Sequence[CameraFacts], result: TrialResult
) -> Iterator[np.ndarray]:
    """Yield the pictures (h, w, 3) of the film, in the order of the frames."""
    from bench.report.film_curves import CurveStrip  # with all of Matplotlib

    times = frame_times(trial)
    for whisk in result.seen.whisks:
        if whisk.frames is None:
            continue
        strip = CurveStrip.draw(whisk, painting.FILM_WIDTH_PX * len(cameras))
        frames = enumerate(_frames_of(trial, times, cameras, whisk))
        count = len(whisk.frames.index)
        for k, greys in count_parts(frames, f"frames of whisk {whisk.whisk}", count):
            pictures = []
            for camera in cameras:
                pictures.append(_camera_picture(greys[camera.name], camera, result, whisk, k))
            yield strip.below(painting.side_by_side(pictures), k)


def _frames_of(
    trial: Trial, times: FrameTimes, cameras: Sequence[CameraFacts], whisk: SeenWhisk
) -> Iterator[dict[str, np.ndarray | None]]:
    """Yield the pictures of each frame of a whisk, by camera; None where a camera has none."""
    frames = whisk.frames.index
    for start in range(0, len(frames), _FRAMES_READ):
        chosen = frames[start : start + _FRAMES_READ]
        read = {}
        for camera in cameras:
            index = times.picture[camera.name][chosen]
            source = trial.camera_sources[camera.name]
            read[camera.name] = read_frames(source, index[index >= 0].tolist())
        for frame in chosen:
            greys = {}
            for name, pictures in read.items():
                greys[name] = pictures.get(int(times.picture[name][frame]))
            yield greys


def _camera_picture(
    grey: np.ndarray | None, facts: CameraFacts, result: TrialResult, whisk: SeenWhisk, k: int
) -> np.ndarray:
    """Return one camera's picture (h, w, 3), as wide as films have it, with what was found in the whisk's frame k."""
    if grey is None:
        width, height = facts.size_px
        size = (round(painting.FILM_WIDTH_PX / width * height), painting.FILM_WIDTH_PX, 3)
        picture = np.full(size, _NO_PICTURE, np.uint8)
        title = f"{facts.name}: no picture"
    else:
        picture = painting.shrink(grey, painting.FILM_WIDTH_PX)
        _draw_lines(picture, facts, result, whisk, k)
        title = f"{facts.name}, frame {int(whisk.frames.index[k])}"
    painting.put_text(picture, title, painting.TITLE_PLACE, painting.PAPER)
    return picture


def _draw_lines(
    picture: np.ndarray, facts: CameraFacts, result: TrialResult, whisk: SeenWhisk, k: int
) -> None:
    """Draw bar, wire, contact, and the contact's path up to frame k, into a camera's picture."""
    camera = Camera(
        facts.name, tuple(facts.size_px), facts.matrix, facts.distortion, facts.T_camera_rig
    )

    def project(points_mm: np.ndarray) -> np.ndarray:
        """Project points (n, 3) mm into the picture."""
        return painting.shrink_px(
            camera.project(points_mm), painting.FILM_WIDTH_PX / facts.size_px[0]
        )

    for edge in _bar_edges(camera, result.seen, whisk):
        painting.polyline(picture, project(edge), painting.BAR)
    path_mm = _contact_path(whisk, k)
    contact_mm = path_mm[-1] if whisk.frames.touching[k] else None
    painting.polyline(picture, project(_wire(result, whisk, k)), painting.WIRE)
    if len(path_mm) > 1:
        painting.polyline(picture, project(path_mm), _PATH)
    if contact_mm is not None:
        ((x, y),) = project(contact_mm[None])
        cv2.circle(picture, (round(x), round(y)), 5, _CONTACT, 1, cv2.LINE_AA)


def _contact_path(whisk: SeenWhisk, k: int) -> np.ndarray:
    """Return the contact (n, 3), mm, in those frames up to k in which the whisker touches."""
    touching = np.asarray(whisk.frames.touching[: k + 1], dtype=bool)
    return whisk.frames.point_mm.value[: k + 1][touching]


def _bar_edges(camera: Camera, seen: SeenTrial, whisk: SeenWhisk) -> list[np.ndarray]:
    """Return both edges (n, 3) mm of the bar as a camera sees them; none where no bar is known."""
    if seen.bar is None or not whisk.has_truth:
        return []
    axis = seen.bar.segment(whisk.point_mm.value, _HALF_BAR_MM, points=20)
    normal = np.cross(seen.bar.direction, axis[0] - camera.centre_mm)
    across = seen.bar_radius_mm * normal / np.linalg.norm(normal)
    return [axis - across, axis + across]


def _wire(result: TrialResult, whisk: SeenWhisk, k: int) -> np.ndarray:
    """Return the whisker (n, 3), mm, as it was fitted in frame k; unbent in frames that are not in the fit."""
    facts = result.whisker
    shape = whisk.truth.shape
    motor_rad = float(whisk.frames.motor_rad[k])
    wire = _wire_of(facts)
    bend_rad = np.zeros(2)
    arc_mm = facts.length_mm
    for row in np.flatnonzero(shape.index == whisk.frames.index[k]):
        bend_rad = shape.bend_rad[row]
        arc_mm = shape.arc_mm[row]
    return centrelines(shape.rest_mm, bend_rad, arc_mm, motor_rad, wire).points_mm


def _wire_of(facts: WhiskerFacts) -> Wire:
    """Return the wire of a whisker whose unloaded shape stands elsewhere."""
    sizes = (facts.shape, facts.length_mm, facts.diameter_mm, 0.0, 0.0, facts.tip_diameter_mm)
    return ProfiledWire(*sizes, widths=facts.widths) if facts.widths else Wire(*sizes)
