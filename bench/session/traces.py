"""The lines that another program has traced in a trial's pictures: which files, and whether they are
of these pictures.

A trial's folder holds `trace_<camera>` with the suffix of the tracker (`trace_files.KINDS`), or
Anipose's points in space, `trace_3d.csv`, with its cameras, `trace_3d.toml`. Points of the object are in
`object_<camera>`, or are joints of a trace that are named for it, where there are no pictures to find it in.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from bench.base.errors import BadInput
from bench.session.trace_files import IN_SPACE
from bench.session.trace_readers import DrawnLines, read_lines
from bench.session.trial import Trial
from vision import Trace
from vision.geometry import Crop, counted
from vision.pictures import Frames, PicturePart

# [1] Of the points: a tracker may draw a line a little beyond the picture's edge; more are of other
# pictures. Stated.
_MOST_OUTSIDE = 0.05
# [px] Of all points of a trace together, across and down: a line of a wire is longer. Stated.
_LEAST_SPAN_PX = 10.0


@dataclass(frozen=True, eq=False)
class TracedCamera:
    """What a camera's trace is of.

    count: of its pictures, in words `pictures`. size_px: width, height; None where no file says it.
    picture (n,): index of its picture in each frame, −1 where it dropped that. crop: of a camera that is a
    part of a picture, whose traces are in that whole picture, unless they are of points in space.
    """

    count: int
    size_px: tuple[int, int] | None
    picture: np.ndarray
    pictures: str
    crop: Crop | None = None

    @classmethod
    def of_pictures(
        cls, frames: Frames, crop: Crop | None, picture: np.ndarray, camera: str
    ) -> Self:
        """Return what a trace in a folder of pictures or a video is of."""
        has = f"camera {camera} has {counted(frames.count, 'picture')}"
        return cls(frames.count, frames.size_px, picture, has, crop)

    @classmethod
    def of_rows(cls, count: int, size_px: tuple[int, int] | None, crop: Crop | None) -> Self:
        """Return what a trace without pictures is of: the rows of frames.csv."""
        has = f"frames.csv has {counted(count, 'row')}"
        return cls(count, size_px, np.arange(count), has, crop)


class _Drawn(NamedTuple):
    """The lines of a file. label: how messages name it. is_in_space: whether a camera's own lens has projected them."""

    lines: DrawnLines
    label: str
    is_in_space: bool


@dataclass(frozen=True, eq=False)
class Traced:
    """A camera's trace. has_identity: its lines have the same number in all frames."""

    trace: Trace
    has_identity: bool


def read_traces(
    files: Mapping[str, Path],
    sources: Mapping[str, Path | PicturePart],
    pictures: Mapping[str, np.ndarray],
    label: str,
) -> dict[str, Traced]:
    """Return the traces of a trial by camera, their frames counted as the trial counts.

    files: as of `bench.session.trace_files`. sources: pictures of each camera. pictures: by camera the index of its
    picture in each frame (n,), −1 where it dropped that. Raises BadInput where a file cannot be read
    or is not of these pictures.
    """
    frames = {name: Frames.open(source) for name, source in sources.items()}
    sizes_px = {name: of_camera.size_px for name, of_camera in frames.items()}
    traces = {}
    for name, drawn in _drawn(files, sizes_px, label).items():
        if name not in sources:
            found = f"there are no pictures of camera {name}; there are those of"
            raise BadInput(f"{found} {', '.join(sources) or 'none'}", file=drawn.label)
        source = sources[name]
        crop = source.crop if isinstance(source, PicturePart) else None
        camera = TracedCamera.of_pictures(frames[name], crop, pictures[name], name)
        traces[name] = _checked(drawn.lines.of_wire, name, camera, drawn)
    return traces


class TracesAlone(NamedTuple):
    """What a trial without pictures has, by camera: the wire's traces, and the points of its object."""

    wire: dict[str, Traced]
    object_points: dict[str, Traced]


def read_traces_alone(
    trial: Trial, count: int, sizes_px: Mapping[str, tuple[int, int]], crops: Mapping[str, Crop]
) -> TracesAlone:
    """Return the traces of a trial that has no pictures.

    Points of the object are in files of their own, or else joints of the wire's traces that are named for it. count: of the
    trial's frames. sizes_px: of the pictures of the cameras that are calibrated, empty where none is known. crops: of
    those that are parts of a picture. Raises BadInput where a file cannot be read or is not of these frames.
    """
    of_wire = _drawn(trial.trace_files, sizes_px, trial.place)
    of_object = _drawn(trial.object_files, sizes_px, trial.place)
    _require_known(of_wire, sizes_px)
    _require_known(of_object, sizes_px)
    cameras = {}
    for name in {**of_wire, **of_object}:
        cameras[name] = TracedCamera.of_rows(count, sizes_px.get(name), crops.get(name))
    points = {}
    for name, drawn in of_object.items():
        points[name] = _checked(drawn.lines, name, cameras[name], drawn)
    wire = {}
    for name, drawn in of_wire.items():
        wire[name] = _checked(drawn.lines.of_wire, name, cameras[name], drawn)
        joints = drawn.lines.of_object
        if len(joints.frame) and name not in points:
            points[name] = _checked(joints, name, cameras[name], drawn)
    return TracesAlone(wire, points)


def _require_known(drawn: Mapping[str, _Drawn], names: Collection[str]) -> None:
    """Raise BadInput for a file of none of the cameras that are calibrated; names: empty where none is known."""
    for name, file in drawn.items():
        if names and name not in names:
            found = f"there is no camera {name}; there are {', '.join(names)}"
            raise BadInput(found, file=file.label)


def has_points_in_one_camera(trial: Trial) -> bool:
    """Return whether one camera alone has points of the object, in a file of their own or as joints of its trace.

    Raises BadInput where a file cannot be read.
    """
    found = set(trial.object_files)
    if IN_SPACE in {*found, *trial.trace_files}:
        return False
    for name, path in trial.trace_files.items():
        drawn = read_lines(path, trial.label(path.name))
        if len(drawn.of_object.frame):
            found.add(name)
    return len(found) == 1


def _drawn(
    files: Mapping[str, Path], sizes_px: Mapping[str, tuple[int, int]], label: str
) -> dict[str, _Drawn]:
    """Return by camera the lines of its file. Raise BadInput.

    sizes_px: of the pictures of those that see points in space.
    """
    drawn: dict[str, _Drawn] = {}
    for name, path in files.items():
        of_file = f"{label}/{path.name}"
        if name != IN_SPACE:
            drawn[name] = _Drawn(read_lines(path, of_file), of_file, is_in_space=False)
            continue
        from bench.session.traces_in_space import lines_in_space  # with calibration's solvers

        for camera, lines in lines_in_space(path, sizes_px, of_file).items():
            drawn.setdefault(camera, _Drawn(lines, of_file, is_in_space=True))
    return drawn


def _checked(lines: DrawnLines, name: str, camera: TracedCamera, drawn: _Drawn) -> Traced:
    """Return a camera's lines as a trace. Raise BadInput where they are not of its pictures.

    drawn: what they were read with.
    """
    label = drawn.label
    _require_frames(lines.frame, camera, label)
    px = lines.px
    is_inside = np.ones(len(px), dtype=bool)
    if camera.crop is not None and not drawn.is_in_space:
        px = camera.crop.in_part(px)
        is_inside = _inside_part(px, name, camera.crop, label)
    elif camera.size_px is not None:
        is_inside = _inside(px, name, camera.size_px, label)
    _require_span(px, label)
    frame = _frames_of(lines.frame.astype(int), camera.picture)
    trace = Trace(frame, px, lines.line, lines.sigma_px)
    return Traced(trace.select(is_inside & (frame >= 0)), lines.has_identity)


def _frames_of(number: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Return the frames (n,) of pictures by their numbers; −1 for a picture that no frame has.

    picture: as of `TracedCamera`.
    """
    frame_of = np.full(int(np.max(picture, initial=0)) + 1, -1)
    recorded = np.flatnonzero(picture >= 0)
    frame_of[picture[recorded]] = recorded
    return np.where(number < len(frame_of), frame_of[np.minimum(number, len(frame_of) - 1)], -1)


def _require_frames(frame: np.ndarray, camera: TracedCamera, label: str) -> None:
    """Raise BadInput where frames (n,) are no numbers of the camera's pictures."""
    if len(frame) == 0:
        raise BadInput("holds no point", file=label)
    broken = frame[frame != np.round(frame)]
    if len(broken):
        rule = "pictures are counted from 0; are these times in seconds?"
        raise BadInput(f"frame {broken[0]:g} is no whole number; {rule}", file=label)
    absent = frame[(frame < 0) | (frame >= camera.count)]
    if len(absent):
        there = f"{camera.pictures}, counted from 0"
        other = "is it of another trial?"
        raise BadInput(f"frame {absent[0]:g} is not there; {there}; {other}", file=label)


def _require_span(px: np.ndarray, label: str) -> None:
    """Raise BadInput where all points (n, 2) are at one spot."""
    span_px = float(np.max(np.ptp(px, axis=0)))
    if span_px < _LEAST_SPAN_PX:
        found = f"all of its points are within {span_px:.2g} px"
        raise BadInput(f"{found}; are u_px and v_px in pixels, and of a line?", file=label)


def _inside_part(px: np.ndarray, camera: str, crop: Crop, label: str) -> np.ndarray:
    """Return which points (n, 2) are in a part of a picture; others may be of another part. Raise BadInput for none."""
    is_inside = _are_in(px, crop.size_px)
    if not np.any(is_inside):
        found = f"none of its points is in camera {camera}'s part of {crop.of}'s picture"
        raise BadInput(f"{found}; give them in pixels of the whole picture", file=label)
    return is_inside


def _inside(px: np.ndarray, camera: str, size_px: tuple[int, int], label: str) -> np.ndarray:
    """Return which points (n, 2) are in the picture. Raise BadInput where too many are not."""
    is_inside = _are_in(px, size_px)
    outside = 1.0 - np.mean(is_inside)
    if outside <= _MOST_OUTSIDE:
        return is_inside
    u, v = px[int(np.argmin(is_inside))]
    width, height = size_px
    found = f"{outside:.0%} of its points are outside the picture of camera {camera}"
    hint = "is it of another camera?"
    if np.mean(_are_in(px[:, ::-1], size_px)) >= 1.0 - _MOST_OUTSIDE:
        hint = "are u and v exchanged?"
    first = f"such as u {u:.1f}, v {v:.1f} px of {width} x {height}"
    raise BadInput(f"{found}, {first}; {hint}", file=label)


def _are_in(px: np.ndarray, size_px: tuple[int, int]) -> np.ndarray:
    """Return which points (n, 2) are in a picture."""
    return np.all((px >= -0.5) & (px <= np.array(size_px) - 0.5), axis=1)
