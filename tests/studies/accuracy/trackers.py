"""Scores of trackers on sessions: one made here of scikit-image's skeletons, or files of any other.

    python tests/studies/accuracy/trackers.py OUT SESSION … [--trials 'b60*'] [--whisk TRACE | --traces FOLDER]

The tracker made here takes the largest thing that differs from the median of a camera's pictures,
and of that the skeleton: whole pixels, nothing of the wire where it hardly moves. With --whisk it is Janelia's, by the
program `trace` of whisk (of PyPI's whisk-janelia), as it is installed. Either is written to OUT/<session>/traces, and
`score-traces` holds that, or FOLDER, against ours in OUT/<session>.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from skimage.filters import apply_hysteresis_threshold, gaussian
from skimage.measure import label
from skimage.morphology import skeletonize

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.settings import Settings
from bench.session.session import load_session
from bench.workflows.trace_scores import score_traces
from vision.pictures import Frames

BLUR_PX = 1.0
# sigmas of a pixel's noise: what certainly differs, and what may where that goes on
SURE, POSSIBLE = 12.0, 5.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("sessions", type=Path, nargs="+")
    parser.add_argument("--trials", default="*")
    parser.add_argument("--traces", type=Path)
    parser.add_argument("--whisk", type=Path)
    arguments = parser.parse_args()
    settings = Settings(trials=arguments.trials)
    for session in arguments.sessions:
        out = arguments.out / session.name
        traces = arguments.traces or out / "traces"
        if arguments.traces is None:
            track(session, traces, settings, arguments.whisk)
        scores, warnings = score_traces(session, traces, out, settings, workers=0)
        print(session.name, *scores, *warnings, sep="\n  ", flush=True)


def track(session: Path, traces: Path, settings: Settings, whisk: Path | None) -> None:
    """Write the trace of each camera for each trial of a session. whisk: its program, or None."""
    for trial in load_session(session).trials:
        if not settings.takes(trial.name):
            continue
        folder = traces / trial.name
        folder.mkdir(parents=True, exist_ok=True)
        for camera, source in trial.camera_sources.items():
            pictures = [grey for _, grey in Frames.open(source).read()]
            if whisk is None:
                (folder / f"trace_{camera}.csv").write_text(skeletons(pictures))
            else:
                trace_by_whisk(whisk, pictures, folder / f"trace_{camera}")


def trace_by_whisk(whisk: Path, pictures: list[np.ndarray], target: Path) -> None:
    """Write <target>.whiskers by whisk's own program, of a stack of the pictures."""
    with tempfile.TemporaryDirectory() as work:
        stack = Path(work) / "pictures.tif"
        none = [cv2.IMWRITE_TIFF_COMPRESSION, 1]
        assert cv2.imwritemulti(str(stack), [np.uint8(grey) for grey in pictures], none)
        command = [str(whisk.resolve()), stack.name, "traced.whiskers"]
        subprocess.run(command, cwd=work, check=True, capture_output=True)
        shutil.copyfile(Path(work) / "traced.whiskers", target.with_suffix(".whiskers"))


def skeletons(pictures: list[np.ndarray]) -> str:
    """Return the table of a camera's trace by skeletons."""
    still = np.median(np.array(pictures, dtype=float), axis=0)
    rows = ["frame,u_px,v_px"]
    for frame, picture in enumerate(pictures):
        rows += [f"{frame},{u},{v}" for v, u in skeleton(picture - still)]
    return "\n".join(rows) + "\n"


def skeleton(difference: np.ndarray) -> np.ndarray:
    """Return the pixels (n, 2), row and column, of the middle of the largest thing that differs."""
    smooth = np.abs(gaussian(difference, BLUR_PX))
    noise = np.median(smooth) / 0.6745
    differs = apply_hysteresis_threshold(smooth, POSSIBLE * noise, SURE * noise)
    parts = label(differs)
    if parts.max() == 0:
        return np.zeros((0, 2), dtype=int)
    largest = 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    return np.argwhere(skeletonize(parts == largest))


if __name__ == "__main__":
    main()
