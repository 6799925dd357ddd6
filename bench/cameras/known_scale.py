"""A second known length in the session, against a board whose squares were entered wrong: the bar's diameter."""

from collections.abc import Iterator

import numpy as np

from bench.base.errors import BadInput
from bench.session.angle_source import angle_source
from bench.session.file_names import SESSION_TOML
from bench.session.footage import read_frames, rig_picture
from bench.session.frame_times import frame_times
from bench.session.session import Session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from vision import SIGMA_SHARE, bar_diameter_mm
from vision.calibration import check_known_lengths
from vision.geometry import Bar, Cameras, Reason, Refused, spread

# [trials] Of which a median is taken, at most: a bound on time. Stated.
_MOST_TRIALS = 3
# [pictures] Of each camera and trial, at most: a bound on time. Stated.
_MOST_PICTURES = 11
# [1] Scatter of the share, of one trial alone. Stated.
_UNCONFIRMED = 0.05
# [1] Scatter of the share: at the right scale six sessions scatter by 0.014 at most, at wrong ones by 0.1 to
# 0.3. Stated.
_MOST_SCATTER = 0.1


def check_scale(session: Session, cameras: Cameras) -> tuple[list[str], list[Reason]]:
    """Return notes and warnings on the bars' apparent diameter; none where the session has no bar.

    cameras: in the rig frame. Raises BadInput at the wrong scale.
    """
    if session.whisker is None or session.board is None:
        return [], []
    trials = [trial for trial in session.trials if _has_measurable_bar(trial, session)]
    shares = np.array(list(_seen_over_given(session, cameras, spread(trials, _MOST_TRIALS))))
    if not len(shares):
        return [], []
    # at a wrong scale the bar is not where the whisker would touch it, and another thing may pass for it
    scatter = np.std(shares, ddof=1) if len(shares) > 1 else _UNCONFIRMED
    if scatter > _UNCONFIRMED:
        return [], [_scatter_warning(shares, scatter)]
    share = float(np.median(shares))
    sigma = float(np.hypot(SIGMA_SHARE, scatter) / np.sqrt(len(shares)))
    _check_bar_diameter(session, trials, share, sigma)
    times = f"{share:.3f} ± {sigma:.3f} times"
    return [
        f"A second length: bars look {times} as thick as stated; that agrees with square_mm."
    ], []


def _scatter_warning(shares: np.ndarray, scatter: float) -> Reason:
    """Return the warning on bars whose apparent diameters scatter. Raises BadInput where by much."""
    seen = (
        f"bars look {min(shares):.2f} to {max(shares):.2f} times as thick as stated, so hardly any bar "
        "is seen where square_mm and T_rig_board place the whisker"
    )
    if scatter > _MOST_SCATTER:
        cure = "measure a square of the board and enter it, then check T_rig_board"
        raise BadInput(f"{seen}: {cure}", file=SESSION_TOML)
    return Reason("scale_unconfirmed", f"A second length: {seen}: check both")


def _has_measurable_bar(trial: Trial, session: Session) -> bool:
    """Return whether a trial has a bar of known diameter before cameras with an empty rig picture."""
    cameras = set(session.rig_pictures) & set(trial.camera_sources)
    has_angle = not angle_source(trial).lacks(trial)
    return bool(trial.bar_diameter_mm and trial.is_bar and cameras and has_angle)


def _check_bar_diameter(
    session: Session, trials: list[Trial], share: float, share_sigma: float
) -> None:
    """Raise BadInput where bars appear another share of their given diameter than sigmas allow."""
    given_mm = trials[0].bar_diameter_mm
    given_sigma_mm = max(trial.bar_diameter_sigma_mm for trial in trials)
    diameter = (share * given_mm, share_sigma * share * given_mm, given_mm, given_sigma_mm)
    try:
        check_known_lengths({"bar diameter": diameter})
    except Refused as reason:
        square_mm = session.board.square_mm
        bar = f"a bar of {share * given_mm:.3g} mm would fit it"
        found = (
            f"square_mm is {square_mm:g}, some {square_mm / share:.3g} would fit the bar, or {bar}"
        )
        raise BadInput(f"{reason}; {found}", file=SESSION_TOML) from None


def _seen_over_given(session: Session, cameras: Cameras, trials: list[Trial]) -> Iterator[float]:
    """Yield the bar's diameter in the pictures over the given one, of each trial where it is seen."""
    rig = session.rig_pictures
    background = {name: rig_picture(rig[name]) for name in rig if name in cameras}
    for trial in trials:
        times = frame_times(trial)
        signals = read_signals(trial)
        motor_rad = signals.motor_nearest(times.time_s)
        pictures = {}
        for name in trial.camera_sources:
            if name in cameras:
                pictures[name] = _spread_pictures(trial, name, times.picture[name])
        span = (float(motor_rad.min()), float(motor_rad.max()))
        bar = Bar(trial.bar_diameter_mm)
        try:
            seen_mm = bar_diameter_mm(
                pictures, background, span, cameras, session.whisker.wire, bar
            )
        except Refused:
            continue
        if np.isfinite(seen_mm):
            yield seen_mm / bar.diameter_mm


def _spread_pictures(trial: Trial, camera: str, picture: np.ndarray) -> list[np.ndarray]:
    """Read some pictures of a camera, spread over the trial.

    picture (frames,): its pictures by frame, −1 where it dropped one.
    """
    chosen = spread(picture[picture >= 0].tolist(), _MOST_PICTURES)
    read = read_frames(trial.camera_sources[camera], chosen)
    return [grey for grey in read.values() if grey is not None]
