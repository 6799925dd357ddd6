"""How well a board on the rig shows a camera's transfer curve and lens blur, and what knowing them gives.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/optics.py SCENES [PATTERN]
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/optics.py boards SESSION

SCENES as for path_traced.py; truth.toml may say `gamma` and `psf_sigma_px`, the lens blur without the pixel's own width.
A row a camera whose rig picture shows the board: gamma and blur with their sigmas. A row a scene: d_x's error, sigma and
processor time with nothing known of the optics, with what the boards show, and with the true ones, as well known as by
a board. Of a SESSION with board views: gamma and blur of each camera in its rig picture, and over its views the median,
the lowest and the highest, and the medians of every other view.
"""

import sys
import time
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.session.footage import rig_picture
from bench.session.session import load_session
from tests.studies.accuracy import error_parts
from tests.studies.accuracy.bar_scenes import board_of, read_scene
from vision.boards.board_optics import estimate_optics
from vision.geometry.optics import UNKNOWN, Optics
from vision.geometry.refusals import Refused
from vision.pictures.frames import Frames

AS_BY_A_BOARD = {"log_gamma_sigma": 0.15, "log_blur_sigma": 0.1}
PIXEL_PX = 12**-0.5


def true_optics(folder: Path) -> Optics:
    """What a scene's cameras are; unknown where truth.toml does not say it."""
    truth = tomllib.loads((folder / "trials/w/truth.toml").read_text())
    if "gamma" not in truth:
        return UNKNOWN
    return Optics(
        truth["gamma"], blur_px=np.hypot(truth["psf_sigma_px"], PIXEL_PX), **AS_BY_A_BOARD
    )


def fit_with(folder: Path, optics: dict[str, Optics]) -> str:
    """d_x's error, sigma and seconds with cameras of these optics."""
    views, cameras, *rest = read_scene(folder)
    cameras = replace(
        cameras, cameras=tuple(replace(one, optics=optics[one.name]) for one in cameras)
    )
    views = [replace(view, camera=cameras[view.camera.name]) for view in views]
    true_mm = tomllib.loads((folder / "trials/w/truth.toml").read_text())["d_x_mm"]
    usual, error_parts.read_scene = error_parts.read_scene, lambda _: (views, cameras, *rest)
    began = time.process_time()
    try:
        d_x = error_parts.fit_scene(folder)[0].of_whisk("d_x")
    except Refused as reason:
        return f"{reason}"
    finally:
        error_parts.read_scene = usual
    seconds = time.process_time() - began
    return f"{d_x.value - true_mm:+.4f} ± {d_x.sigma:.4f} mm, {seconds:.1f} s"


def words(optics: Optics) -> str:
    """Gamma and blur with their sigmas, of their logarithms."""
    gamma = f"gamma {optics.gamma:.2f} ± {optics.log_gamma_sigma:.0%}"
    return f"{gamma}, blur {optics.blur_px:.2f} px ± {optics.log_blur_sigma:.0%}"


def of_scenes(scenes: Path, pattern: str) -> None:
    """Rows of all scenes."""
    for folder in sorted(path.parents[2] for path in scenes.glob(f"{pattern}/trials/w/truth.toml")):
        true = true_optics(folder)
        print(f"{folder.name:<6} {words(true) if true != UNKNOWN else 'truth not known'}")
        shown = {}
        for picture in sorted((folder / "boards/rig").iterdir()):
            shown[picture.stem] = estimate_optics(rig_picture(picture), board_of(folder))
            if shown[picture.stem] != UNKNOWN:
                print(f"       {picture.stem}: {words(shown[picture.stem])}")
        cases = {"nothing known": dict.fromkeys(shown, UNKNOWN), "by boards": shown}
        if true != UNKNOWN:
            cases["true"] = dict.fromkeys(shown, true)
        for name, optics in cases.items():
            print(f"       {name:<13} d_x {fit_with(folder, optics)}", flush=True)


def of_boards(folder: Path) -> None:
    """Rows of a session's cameras."""
    session = load_session(folder)
    for name, source in session.board_sources.items():
        if name in session.rig_pictures:
            rig = estimate_optics(rig_picture(session.rig_pictures[name]), session.board)
            print(f"{name}: on the rig {words(rig)}")
        pictures = (grey for _, grey in Frames.open(source).read() if grey is not None)
        every = [
            one for grey in pictures if (one := estimate_optics(grey, session.board)) != UNKNOWN
        ]
        for what in ("gamma", "blur_px"):
            value = np.array([getattr(one, what) for one in every])
            halves = [round(float(np.median(value[k::2])), 3) for k in range(2)]
            print(
                f"  {what} in {len(value)} views: {np.median(value):.2f}, {value.min():.2f} to {value.max():.2f}, "
                f"halves {halves}",
                flush=True,
            )


if __name__ == "__main__":
    if sys.argv[1] == "boards":
        of_boards(Path(sys.argv[2]))
    else:
        of_scenes(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "*")
