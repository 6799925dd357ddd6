"""`whisker-bench calibrate gauges`: gauges.toml from a session's gauge trials, with its certificate."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.base.atomic import whole_file
from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.gauges.certificate import Certificate, page
from bench.gauges.felt import FeltStroke
from bench.gauges.gauges_file import write_gauges
from bench.gauges.weights import scale_by_weights
from bench.session.session import Session
from bench.session.session_check import checked_session
from bench.session.signals import read_signals
from bench.session.trial import Trial
from bench.trials.of_session import fit_certificate, placed_units, session_drift, trials_with_whisks


def calibrate_gauges_command(
    session: Path,
    out: Path,
    *,
    every_trial: bool = False,
    workers: int = 1,
    progress: bool = False,
    follow_links: bool = False,
) -> int:
    """Calibrate, write `out` (TOML) and its certificate beside it as PDF, print it.

    Returns 0, or 1 where the session is doubtful. every_trial: all trials with whisks, not only those marked "gauge".
    Raises BadInput.
    """
    doubts = Doubts()
    loaded = checked_session(session, doubts, follow_links=follow_links)
    certificate = calibrate_gauges(
        loaded, chosen_trials(loaded, every_trial), doubts, workers=workers, progress=progress
    )
    header = certificate.lines()
    write_gauges(out, certificate.gauges, zeros(certificate.strokes), certificate.stiffness, header)
    with whole_file(out.with_suffix(".pdf")) as temporary:
        page(certificate).savefig(
            temporary, metadata={"CreationDate": None, "Producer": None, "Creator": None}
        )
    print(
        "\n".join(
            [
                *header,
                "",
                *(f"doubtful: {note}" for note in doubts.notes),
                f"written: {out}, {out.stem}.pdf",
            ]
        )
    )
    return 1 if doubts.notes else 0


def chosen_trials(session: Session, every_trial: bool) -> list[Trial]:
    """Trials with volts that the coefficients may rest on. Raises BadInput where there is none."""
    if all(read_signals(trial).kind == "Nmm" for trial in session.trials):
        raise BadInput(
            "all signals.csv hold moments already (m_y_Nmm,m_z_Nmm): no gauge to calibrate",
            file="trials",
        )
    wanted = ("gauge", "measure") if every_trial else ("gauge",)
    trials = [t for t in session.trials if t.purpose in wanted and read_signals(t).kind == "V"]
    if not trials:
        raise BadInput(
            'no trial with volts is marked purpose = "gauge"; mark them, or give --all',
            file="trials",
        )
    return trials


def calibrate_gauges(
    session: Session,
    trials: list[Trial],
    doubts: Doubts,
    *,
    workers: int = 1,
    progress: bool = False,
) -> Certificate:
    """Coefficients from what the cameras and the gauges show of these trials. Raises BadInput."""
    settings, names = Settings(), {trial.name for trial in trials}
    with TemporaryDirectory() as folder, Workers(workers, progress) as pool:
        every = trials_with_whisks(session)
        _, units = placed_units(session, every, Path(folder), settings, pool, doubts)
        rate, _ = session_drift(units, pool)
        made = fit_certificate(
            [unit for unit in units if unit.trial.name in names], rate, pool, doubts
        )
    return made.in_newtons_of(
        scale_by_weights(session.trials, made.gauges.all, *zeros(made.strokes))
    )


def zeros(strokes: tuple[FeltStroke, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Mean zero (2,) of the free strokes and the scatter of one, in volts."""
    levels = np.array(
        [touch.offset for touch in (stroke.touch() for stroke in strokes) if not touch.status]
    )
    scatter = levels.std(axis=0, ddof=1) if len(levels) > 1 else np.zeros(2)
    return levels.mean(axis=0), scatter
