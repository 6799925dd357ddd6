"""A second known length in the session, against a board whose squares were entered wrong: the bar's diameter."""

from collections.abc import Iterator

import numpy as np

from bench.base.errors import BadInput
from bench.cameras.first_look import spread
from bench.session.footage import read_frames, rig_picture
from bench.session.frame_times import frame_times
from bench.session.session import Session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from vision.calibration.known_lengths import check_known_lengths
from vision.geometry.camera import Cameras
from vision.geometry.refusals import Refused
from vision.geometry.rods import Bar
from vision.touched.width import SIGMA_SHARE, bar_diameter_mm

_MOST_TRIALS, _MOST_PICTURES = 3, 11  # trials and pictures of each: a median over them. Set by eye
_UNCONFIRMED = 0.05  # of one trial alone
# at the right scale six sessions scatter by 0.014 at most, at wrong ones by 0.1 to 0.3
_MOST_SCATTER = 0.1


def check_scale(session: Session, cameras: Cameras) -> tuple[list[str], list[str]]:
    """Notes and doubts on how thick the bars look; none where the session shows no bar. cameras: in the rig frame.

    Raises BadInput at the wrong scale.
    """
    if session.whisker is None or session.board is None:
        return [], []
    shown = set(session.rig_pictures)
    trials = [
        t
        for t in session.trials
        if t.bar_diameter_mm and t.is_bar and shown & set(t.camera_sources)
    ]
    shares = np.array(list(_seen_over_given(session, cameras, spread(trials, _MOST_TRIALS))))
    if not len(shares):
        return [], []
    # at a wrong scale the bar is not where the whisker would touch it, and another thing may pass for it
    scatter = np.std(shares, ddof=1) if len(shares) > 1 else _UNCONFIRMED
    share, sigma = (
        float(np.median(shares)),
        float(np.hypot(SIGMA_SHARE, scatter) / np.sqrt(len(shares))),
    )
    if scatter > _UNCONFIRMED:
        seen = (
            f"bars look {min(shares):.2f} to {max(shares):.2f} times as thick as given, so they are hardly seen "
            "where square_mm and T_rig_board have the whisker"
        )
        if scatter > _MOST_SCATTER:
            asked = "measure a square of the board and enter it, then check T_rig_board"
            raise BadInput(f"{seen}: {asked}", file="session.toml")
        return [], [f"Second length: {seen}: check both"]
    given_mm = trials[0].bar_diameter_mm
    given_sigma_mm = max(t.bar_diameter_sigma_mm for t in trials)
    try:
        check_known_lengths(
            {"bar diameter": (share * given_mm, sigma * share * given_mm, given_mm, given_sigma_mm)}
        )
    except Refused as reason:
        square_mm = session.board.square_mm
        found = f"square_mm is {square_mm:g}, some {square_mm / share:.3g} would fit the bar"
        raise BadInput(f"{reason}; {found}", file="session.toml") from None
    return [
        f"Second length: bars look {share:.3f} ± {sigma:.3f} times as thick as given; square_mm can be right."
    ], []


def _seen_over_given(session: Session, cameras: Cameras, trials: list[Trial]) -> Iterator[float]:
    background = {n: rig_picture(p) for n, p in session.rig_pictures.items() if n in cameras}
    for trial in trials:
        try:
            pictures = {n: _spread(trial, n) for n in trial.camera_sources if n in cameras}
            bar = Bar(trial.bar_diameter_mm)
            seen_mm = bar_diameter_mm(
                pictures, background, _motor_span(trial), cameras, session.whisker.wire, bar
            )
        except Refused:
            continue
        if np.isfinite(seen_mm):
            yield seen_mm / bar.diameter_mm


def _spread(trial: Trial, camera: str) -> list[np.ndarray]:
    """Some pictures of a camera, spread over the trial."""
    shown = frame_times(trial).picture[camera]
    shown = shown[shown >= 0]
    chosen = map(int, spread(shown, _MOST_PICTURES))
    return [
        grey
        for grey in read_frames(trial.camera_sources[camera], chosen).values()
        if grey is not None
    ]


def _motor_span(trial: Trial) -> tuple[float, float]:
    signals, times = read_signals(trial), frame_times(trial).time_s
    motor = np.interp(times, signals.time_s, signals.motor_rad)
    return float(motor.min()), float(motor.max())
