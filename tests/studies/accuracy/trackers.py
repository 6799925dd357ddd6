"""Scores of trackers on sessions: one made here of scikit-image's skeletons, or files of any other.

    python tests/studies/accuracy/trackers.py OUT SESSION … [--trials 'b60*'] [--traces FOLDER]

The tracker made here takes the largest thing that differs from the median of a camera's pictures,
and of that the skeleton: whole pixels, nothing of the wire where it hardly moves. It writes
OUT/<session>/traces, and `score-traces` holds that, or FOLDER, against ours in OUT/<session>.
"""

import argparse
import sys
from pathlib import Path

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
    arguments = parser.parse_args()
    settings = Settings(trials=arguments.trials)
    for session in arguments.sessions:
        out = arguments.out / session.name
        traces = arguments.traces or out / "traces"
        if arguments.traces is None:
            track(session, traces, settings)
        scores, warnings = score_traces(session, traces, out, settings, workers=0)
        print(session.name, *scores, *warnings, sep="\n  ", flush=True)


def track(session: Path, traces: Path, settings: Settings) -> None:
    """Write trace_<camera>.csv for each trial of a session."""
    for trial in load_session(session).trials:
        if not settings.takes(trial.name):
            continue
        folder = traces / trial.name
        folder.mkdir(parents=True, exist_ok=True)
        for camera, source in trial.camera_sources.items():
            pictures = [grey.astype(float) for _, grey in Frames.open(source).read()]
            still = np.median(pictures, axis=0)
            rows = ["frame,u_px,v_px"]
            for frame, picture in enumerate(pictures):
                rows += [f"{frame},{u},{v}" for v, u in skeleton(picture - still)]
            (folder / f"trace_{camera}.csv").write_text("\n".join(rows) + "\n")


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
