"""`whisker-bench calibrate gauges`: gauges.toml from a session's gauge trials, with its certificate."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.base.atomic import whole_file
from bench.base.errors import BadInput
from bench.base.exit_codes import print_written
from bench.base.input_problems import InputProblems
from bench.base.settings import Settings
from bench.base.workers import Workers
from bench.gauges.certificate import Certificate, page
from bench.gauges.felt import FeltStroke
from bench.gauges.gauges_file import write_gauges
from bench.gauges.weights import scale_by_weights
from bench.session.session import Session
from bench.session.session_check import checked_session, trials_with_whisks
from bench.session.signals import read_signals
from bench.session.trial import Trial
from bench.trials.of_session import fit_certificate, placed_units, session_drift


def calibrate_gauges_command(
    session: Path,
    out: Path,
    *,
    every_trial: bool = False,
    workers: int = 1,
    follow_links: bool = False,
) -> int:
    """Calibrate the gauges, write `out` (TOML) and its certificate as PDF in the same folder, and print it.

    Return 0, or 1 with warnings. every_trial: all trials with whisks, not only those marked
    "gauge". Raise BadInput.
    """
    problems = InputProblems()
    loaded = checked_session(session, problems, follow_links=follow_links)
    trials = trials_to_use(loaded, every_trial)
    certificate = calibrate_gauges(loaded, trials, problems, workers=workers)
    header = certificate.lines()
    zeros = zeros_of(certificate.strokes)
    write_gauges(out, certificate.gauges, zeros, certificate.stiffness, header)
    with whole_file(out.with_suffix(".pdf")) as temporary:
        undated = {"CreationDate": None, "Producer": None, "Creator": None}
        page(certificate).savefig(temporary, metadata=undated)
    return print_written([*header, ""], problems.warnings, f": {out}, {out.stem}.pdf")


def trials_to_use(session: Session, every_trial: bool) -> list[Trial]:
    """Return the trials with volts that the coefficients are fitted to.

    every_trial: not only those marked "gauge". Raise BadInput where there is none.
    """
    if all(read_signals(trial).kind == "Nmm" for trial in session.trials):
        raise BadInput(
            "all signals.csv hold moments already (m_y_Nmm,m_z_Nmm): no gauge to calibrate",
            file="trials",
        )
    purposes = ("gauge", "measure") if every_trial else ("gauge",)
    trials = []
    for trial in session.trials:
        if trial.purpose in purposes and read_signals(trial).kind == "V":
            trials.append(trial)
    if not trials:
        raise BadInput(
            'no trial with volts is marked purpose = "gauge"; mark them, or give --all',
            file="trials",
        )
    return trials


def calibrate_gauges(
    session: Session,
    trials: list[Trial],
    problems: InputProblems,
    *,
    workers: int = 1,
) -> Certificate:
    """Fit the coefficients to what cameras and gauges show of these trials; return their
    certificate.

    The session's weight trials set its newtons. Raise BadInput.
    """
    names = {trial.name for trial in trials}
    recorded = trials_with_whisks(session)
    with TemporaryDirectory() as folder, Workers(workers) as pool:
        _, units = placed_units(session, recorded, Path(folder), Settings(), pool, problems)
        drift_rate, _ = session_drift(units, pool)
        chosen = [unit for unit in units if unit.trial.name in names]
        certificate = fit_certificate(chosen, drift_rate, pool, problems)
    zero_V, scatter_V = zeros_of(certificate.strokes)
    gauges = certificate.gauges.all
    weighed = scale_by_weights(session.trials, gauges, zero_V, scatter_V)
    return certificate.in_newtons_of(weighed)


def zeros_of(strokes: Sequence[FeltStroke]) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean zero (2,) of the free strokes and its standard deviation (2,), in volts."""
    touches = [stroke.touch for stroke in strokes]
    levels_V = np.array([touch.offset for touch in touches if not touch.status])
    if len(levels_V) < 2:
        return levels_V.mean(axis=0), np.zeros(2)
    return levels_V.mean(axis=0), levels_V.std(axis=0, ddof=1)
