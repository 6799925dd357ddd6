"""What a threshold of boards and calibration moves, for each of some values.

    python tests/studies/accuracy/thresholds.py boards.edge_pixels _BAND_PX 3 4 6 8 12
    python tests/studies/accuracy/thresholds.py calibration.corner_noise REJECT_SIGMA 3.5 6

A line a value, the present one marked. Of boards: corners kept in the twenty board views of fixtures/small-session;
the two rig pictures' corners against the true cameras, RMS error in px and over the stated sigma; the same of a drawn
board in noise of 8 levels with a rod before it (tests/scenes/board_pictures.py). Of calibration: where the cameras
calibrated from that session project points of the rig, against the true ones, RMS in px and over the stated sigma. Of
pictures.scene_match: peaks of frames against their own rig pictures, the largest against another's, and by how much a
known change of brightness is missed, RMS. Of lines between two ends (BETWEEN_ENDS): those of the wire in
fixtures/scenes, as real_wires.py has them. Of all other folders: two whisks of that session and one of each scene in
fixtures/scenes, through their true cameras (of live: pushes in these scenes); by how much of its usual sigma touch,
d_x, slope or slip at 3° changes most, and which sigma by what factor; or a status. `--cameras 1` shows the first camera
alone. `--sessions FOLDER` takes the first trial of each session in a folder in their place, as of
`tests/studies/net.py sessions FOLDER`, whose objects are rings, spheres and cones, too.
"""

import argparse
import importlib
import inspect
import io
import json
import sys
from ast import literal_eval
from contextlib import redirect_stdout
from functools import partial
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.session.frame_times import frame_times, read_trial
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals
from bench.trials.trial_frames import stated_object
from tests.scenes.board_pictures import picture, true_px
from tests.scenes.recorded import exact_cameras
from tests.studies.accuracy.board_scenes import BOARD
from tests.studies.real_wires import trace_scenes
from tests.studies.speed.live import Recording
from vision.boards.corners import find_corners
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Cameras
from vision.geometry.rods import Rods
from vision.geometry.rotation import apply
from vision.pictures import scene_match
from vision.pictures.files import read_picture
from vision.pictures.frames import Frames
from vision.truth.observe import observe_trial
from vision.truth.records import TrialTruth
from vision.truth.trial_pictures import TrialPictures

SESSION = Path(__file__).resolve().parents[3] / "fixtures" / "small-session"
SCENES = SESSION.parent / "scenes"
RIG_POINTS_MM = np.array(
    [[x, 0.0, z] for x in np.linspace(0, 100, 11) for z in (-30.0, -15.0, 0.0, 15.0, 30.0)]
)
BETWEEN_ENDS = ("wire.between_ends", "wire.ridge_path", "wire.free_width", "wire.steepest_edges")
ROD = ((300, 40), (420, 540))  # crosses the drawn board


def rms(values) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def of_views(session) -> int:
    """Corners found in all board views."""
    pictures = (
        grey for source in session.board_sources.values() for _, grey in Frames.open(source).read()
    )
    return sum(len(find_corners(grey, session.board)) for grey in pictures)


def of_rig(session) -> tuple[np.ndarray, np.ndarray]:
    """Errors (n, 2) of the rig pictures' corners against the true cameras, px, and over their sigmas."""
    T_rig_board = np.array(json.loads((SESSION / "truth.json").read_text())["T_rig_board"])[:3]
    points = apply(T_rig_board, session.board.corners_mm)
    errors, z = [], []
    for camera in exact_cameras(SESSION):
        found = find_corners(read_picture(session.rig_pictures[camera.name]), session.board)
        errors.append(found.px - camera.project(points)[found.ids])
        z.append(errors[-1] / found.sigma_px[:, None])
    return np.concatenate(errors), np.concatenate(z)


def of_drawn() -> tuple[int, float, float]:
    """Corners kept beside a rod, their RMS error in px, and over their sigmas."""
    grey = picture(BOARD, np.random.default_rng(1), noise=8.0)
    cv2.line(grey, *ROD, 90, 20, cv2.LINE_AA)
    found = find_corners(grey, BOARD)
    error = found.px - true_px(BOARD)[found.ids]
    return len(found), rms(error), rms(error / found.sigma_px[:, None])


def of_boards(session) -> str:
    (errors, z), drawn = of_rig(session), of_drawn()
    return (
        f"{of_views(session)} corners in the views; rig: {len(errors)}, {rms(errors):.4f} px, z {rms(z):.2f}; "
        f"drawn: {drawn[0]}, {drawn[1]:.4f} px, z {drawn[2]:.2f}"
    )


def of_calibration(session) -> str:
    cameras = calibrate_from(session, read_board_views(session)).cameras
    errors, z = [], []
    for camera, true in zip(cameras, exact_cameras(SESSION)):
        px, _, by_camera = camera.project_with_jacobians(RIG_POINTS_MM)
        own = cameras.parameters_of(camera.name)
        variance = np.einsum("nij,jk,nik->ni", by_camera, cameras.covariance[own, own], by_camera)
        errors.append(px - true.project(RIG_POINTS_MM))
        z.append(errors[-1] / np.sqrt(variance))
    return f"points of the rig: {rms(errors):.4f} px, z {rms(z):.2f}"


def of_still_scenes(_session) -> str:
    """Peaks of frames against rig pictures, and how far a known brightness is off, by this session and the scenes."""
    frames, rigs, errors = [], [], []
    rng = np.random.default_rng(1)
    for folder in (SESSION, *sorted(SCENES.iterdir())):
        session = load_session(folder)
        trial = session.trials[-1]
        for camera, own in read_trial(trial, frame_times(trial)).items():
            pictures = list(own.values())
            frames.append(pictures[0])
            rigs.append(read_picture(session.rig_pictures[camera]))
            gains = rng.uniform(0.85, 1.15, len(pictures))
            brighter = [np.clip(np.rint(one * g), 0, 255) for one, g in zip(pictures, gains)]
            found = scene_match.exposures(brighter, 255.0)
            errors.append(found / np.median(found) / (gains / np.median(gains)) - 1.0)
    height, width = np.min([one.shape for one in (*frames, *rigs)], axis=0)
    textures = [
        [scene_match.texture(one[:height, :width]) for one in some] for some in (frames, rigs)
    ]
    peaks = np.array(
        [[scene_match.likeness(one, rig).peak for rig in textures[1]] for one in textures[0]]
    )
    same = np.eye(len(frames), dtype=bool)
    own = ", ".join(f"{peak:.0f}" for peak in sorted(peaks[same]))
    return (
        f"peaks of their own scene {own}; of {peaks[~same].size} others {peaks[~same].max():.1f} at most; "
        f"brightness off by {100 * rms(np.concatenate(errors)):.2f} %"
    )


def of_lines(_session) -> str:
    """What lines between two ends of the wire in the scenes are off by."""
    said = io.StringIO()
    with redirect_stdout(said):
        trace_scenes(SCENES, np.random.default_rng(5))
    return said.getvalue().splitlines()[-1]


def whisks(cameras: int | None = None, folder: Path | None = None) -> dict[str, partial]:
    """By name, a call that looks at a trial, by its first cameras alone, and gives the truth of its one whisk.

    folder: of sessions in place of the fixtures'.
    """
    chosen = {}
    if folder is None:
        for trial in ("b30_3", "b60_4"):
            chosen[trial] = (SESSION, trial, exact_cameras(SESSION))
        for path in sorted(SCENES.iterdir()):
            chosen[path.name] = (path, "w", read_cameras(path / "cameras.toml"))
    else:
        for path in sorted(one.parent for one in folder.glob("*/session.toml")):
            chosen[path.name] = (path, load_session(path).trials[0].name, exact_cameras(path))
    found = {}
    for name, (path, trial, calibrated) in chosen.items():
        found[name] = look_at(path, trial, calibrated.subset(calibrated.names[:cameras]))
    return found


def look_at(folder: Path, name: str, cameras: Cameras) -> partial:
    session = load_session(folder)
    trial = session.trial(name)
    times, signals = frame_times(trial), read_signals(trial)
    background = {
        name: read_picture(path).astype(float) for name, path in session.rig_pictures.items()
    }
    return partial(
        observe_trial,
        TrialPictures(
            read_trial(trial, times), times.time_s, signals.motor_at(times.time_s), background
        ),
        [times.frames_in(signals, stroke) for stroke in forward_strokes(signals)],
        cameras,
        Rods(session.whisker.wire, stated_object(trial)),
    )


def pushes() -> dict[str, partial]:
    """By name, a call that evaluates a scene's push as if it were recorded: at once, or once it has stood."""
    found = {}
    for path in sorted(SCENES.iterdir()):
        recording = Recording(path)
        at_leisure_s = 1e3 * np.arange(len(recording.time_s))
        found[f"{path.name} live"] = partial(play, recording, at_leisure_s)
        found[f"{path.name} standing"] = partial(play, recording, at_leisure_s, stands=True)
    return found


def play(recording: Recording, arrivals_s: np.ndarray, *, stands: bool = False) -> TrialTruth:
    """The truth of a push as that of a trial of one whisk."""
    nowhere = np.full(3, np.nan)
    return TrialTruth(nowhere, nowhere, (recording.play(arrivals_s, stands=stands).truth,))


def seen_values(look: partial) -> dict[str, tuple[float, float]]:
    """Values and sigmas of a whisk by name; nothing where there is no truth."""
    (whisk,) = look().whisks
    if np.isnan(whisk.d_x_mm.value):
        return {}
    slip = whisk.at(np.radians(3.0)).slip_mm
    found = {"d_x": whisk.d_x_mm, "touch": whisk.touch_rad, "slope": whisk.beta_rad, "slip": slip}
    return {name: (value.value, value.sigma) for name, value in found.items()}


def compared(before: dict[str, dict], after: dict[str, dict]) -> str:
    """The largest move in usual sigmas, the largest change of a sigma; whisks that lost or gained their truth."""
    changed = [name for name in before if bool(before[name]) != bool(after[name])]
    lost = [f"{name} {'lost' if before[name] else 'gained'} its truth" for name in changed]
    both = [(name, q) for name in before if before[name] and after[name] for q in before[name]]
    moves = {
        key: abs(after[key[0]][key[1]][0] - v) / s
        for key in both
        for v, s in [before[key[0]][key[1]]]
    }
    ratios = {key: after[key[0]][key[1]][1] / before[key[0]][key[1]][1] for key in both}
    most, widest = max(moves, key=moves.get), max(ratios, key=lambda key: abs(np.log(ratios[key])))
    line = f"{moves[most]:.2f} sigma ({' '.join(most)}), a sigma times {ratios[widest]:.2f} ({' '.join(widest)})"
    return "; ".join([line, *lost])


def put(module, constant: str, value) -> None:
    """Set the constant in its module, in what its functions take unless told, and in all of vision that took it by name.

    What was made of it on import stays.
    """
    usual = getattr(module, constant)
    for function in filter(inspect.isfunction, vars(module).values()):
        given = function.__kwdefaults__ or {}
        same = [key for key, one in given.items() if isinstance(one, tuple) and one is usual]
        given.update(dict.fromkeys(same, value))
    if constant.startswith("_"):  # others' of that name, the same small number, are not this one
        setattr(module, constant, value)
        return
    for name, other in list(sys.modules.items()):
        if name.startswith("vision.") and getattr(other, constant, None) is usual:
            setattr(other, constant, value)


def sweep_whisks(module, constant: str, options: argparse.Namespace) -> None:
    is_live = module.__name__.startswith("vision.live")
    looks = pushes() if is_live else whisks(options.cameras, options.sessions)
    usual = {name: seen_values(look) for name, look in looks.items()}
    for value in map(literal_eval, options.values):
        is_array = isinstance(getattr(module, constant), np.ndarray)
        put(module, constant, np.asarray(value) if is_array else value)
        moved = {name: seen_values(look) for name, look in looks.items()}
        print(f"{value!s:>20}   {compared(usual, moved)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("module")
    parser.add_argument("constant")
    parser.add_argument("values", nargs="+")
    parser.add_argument("--cameras", type=int)
    parser.add_argument("--sessions", type=Path)
    options = parser.parse_args()
    name, constant, values = options.module, options.constant, options.values
    module, session = importlib.import_module(f"vision.{name}"), load_session(SESSION)
    measures = {
        "boards": of_boards,
        "calibration": of_calibration,
        "pictures.scene_match": of_still_scenes,
        **dict.fromkeys(BETWEEN_ENDS, of_lines),
    }
    measure = measures.get(name) or measures.get(name.partition(".")[0])
    if measure is None:
        return sweep_whisks(module, constant, options)
    usual = getattr(module, constant)
    print(constant)
    for value in (usual, *map(literal_eval, values)):
        put(module, constant, value)
        print(f"{value!s:>20} {'*' if value == usual else ' '} {measure(session)}", flush=True)


if __name__ == "__main__":
    main()
