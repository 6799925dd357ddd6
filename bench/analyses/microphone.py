"""First touch by a microphone at the base (Table I): microphone.csv.

Where signals have its pressure, `estimator.microphone` finds when each forward stroke first touches.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading, Scored, TrueRun
from bench.analyses.cells import value_cells, whisk_cells
from bench.analyses.pooling import grouped, sound_measured_whisks
from bench.base.tables import SPEED, TRIAL, WHISK, Column, Table, status, with_sigma
from bench.records.trial_result import SeenWhisk, TrialResult
from bench.session.session import Session
from bench.session.signals import PRESSURE, forward_strokes, has_column, read_signals
from estimator.microphone import HeardTouch, heard_touch
from vision import UNKNOWN, Value

MICROPHONE = Table(
    "microphone",
    "A row a measured whisk with a microphone (`p_Pa`).",
    (
        TRIAL,
        WHISK,
        SPEED,
        *with_sigma("touch_heard_deg", "motor angle of first touch"),
        *with_sigma("delay_s", "how much later than in the pictures"),
        Column("signal_to_noise", "of the first loud sample"),
        status("why there is no touch"),
    ),
)


@dataclass(frozen=True, eq=False)
class Heard:
    """A whisk by its sound: a row of MICROPHONE. touch_rad: motor angle. delay_s: unknown without pictures."""

    result: TrialResult
    whisk: int
    heard: HeardTouch
    touch_rad: Value
    delay_s: Value


class Microphone(Analysis):
    """When a microphone at the base has first touch."""

    tables = (MICROPHONE,)
    in_every_run = False
    heading = Heading("microphone", "First touch by a microphone (microphone.csv)")
    needs_session = True

    def compute(self, run: EvaluatedRun) -> list[Heard]:
        """Return each whisk of each trial that has a microphone."""
        found: list[Heard] = []
        whisks = grouped(sound_measured_whisks(run.results), lambda one: one[0].trial.name)
        for name, mine in whisks.items():
            if has_column(run.session.trial(name), PRESSURE):
                seen = [(result, each) for result, each, _ in mine]
                found += heard_whisks(run.session, name, seen)
        return found

    def row(self, one: Heard) -> dict:
        """Return the row of a whisk."""
        return {
            **whisk_cells(one.result, one.whisk),
            **value_cells("touch_heard_deg", one.touch_rad),
            **value_cells("delay_s", one.delay_s),
            "signal_to_noise": one.heard.signal_to_noise,
            "status": one.heard.status,
        }

    def lines(self, found: Sequence[Heard]) -> Iterator[str]:
        """Yield a line a speed: how many touches are heard, and how late."""
        for speed, mine in grouped(found, lambda one: one.result.trial.speed_deg_s).items():
            sigmas_s = [one.heard.sigma_s for one in mine if not one.heard.status]
            delays_s = [one.delay_s.value for one in mine if one.delay_s.is_known]
            stated = f", to {1e3 * np.mean(sigmas_s):.2g} ms" if sigmas_s else ""
            late = ""
            if delays_s:
                late = f"; late by {1e3 * np.mean(delays_s):+.2g} ms"
            if len(delays_s) > 1:
                late += f", scatter {1e3 * np.std(delays_s, ddof=1):.2g} ms"
            at = "" if speed is None else f"at {speed:g}°/s "
            yield f"{at}{len(sigmas_s)} of {len(mine)} touches are heard{stated}{late}"

    def scored(self, run: TrueRun) -> Iterator[Scored]:
        """Yield the touches that are heard."""
        pairs = []
        for row in run.rows(MICROPHONE):
            truth = run.whisk(row)
            pairs.append((row, truth and truth["touch_deg"]))
        yield Scored("touch_heard_deg", pairs)


def heard_whisks(
    session: Session, trial: str, seen: Sequence[tuple[TrialResult, SeenWhisk]]
) -> Iterator[Heard]:
    """Yield the whisks of a trial by their sound. Raises BadInput as `read_signals` does."""
    signals = read_signals(session.trial(trial))
    strokes = forward_strokes(signals)
    for result, one in seen:
        stroke = strokes[one.whisk]
        heard = heard_touch(signals.time_s[stroke], signals.pressure_Pa[stroke])
        if heard.status:
            yield Heard(result, one.whisk, heard, UNKNOWN, UNKNOWN)
            continue
        speed_rad_s = np.ptp(signals.motor_rad[stroke]) / np.ptp(signals.time_s[stroke])
        touch_rad = float(signals.motor_at(np.array(heard.time_s)))
        late_rad = touch_rad - one.touch_rad.value
        delay_sigma_s = math.hypot(heard.sigma_s, one.touch_rad.sigma / speed_rad_s)
        yield Heard(
            result,
            one.whisk,
            heard,
            Value(touch_rad, float(heard.sigma_s * speed_rad_s)),
            Value(late_rad / speed_rad_s, delay_sigma_s),
        )
