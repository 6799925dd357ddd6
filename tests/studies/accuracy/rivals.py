"""What the methods that the paper argues against or beside are worth, on the same simulated contacts with equal noise.

    python tests/studies/accuracy/rivals.py [--count 6] [--seed 0] [--figure PICTURE.png]
    python tests/studies/accuracy/rivals.py --rotations [--count 6] [--seed 0]
    python tests/studies/accuracy/rivals.py --curved [--count 6] [--seed 0]

Each contact is pushed at 90°/s by the exact mechanics of the rig, with ringing, noise, hum and a load cell; its
ringing is taken out (`tests/scenes/without_ringing.py`) before any but the vibration is read. Drawn anew are its
distance (30 to 80 mm) and the lean of the bar (N(0, 5°)); the bar is 6 mm thick, θ is 3°, α_est = 10 ± 4°. By friction
angle and slope (the figure has five of them): RMS error and stated sigma (RMS) of d_x in % of the truth, and over all
contacts how often the 95 % interval holds, and error over sigma. Reorientation turns the plane of rotation until the
slip that is left does not matter, at most four times; its pushes are counted, and the seconds of these strokes.

--rotations: error of (2) after each rotation instead, with noise as stated and four times as much, the slope that
friction then still hides, and (10) by as many pushes in the first plane. --curved: (2), (2) less rolling and (10) on
bars of 6, 20 and 60 mm whose radius is known.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.base.drawing import nested_size, save, style
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD
from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import (
    GaugesTable,
    LoadCellTable,
    MotorTable,
    PicturesTable,
    TrialTable,
)
from estimator.builtin import no_slip, with_friction
from estimator.longitudinal import compliance_with_rolling
from estimator.reorientation import next_turn_rad, reoriented
from estimator.sensors import SENSORS
from estimator.uncertainty import Z_95
from estimator.vibration import vibration
from estimator.whisk import Estimate, EstimatorSettings, Whisk
from tests.scenes.without_ringing import without_ringing
from tests.studies.accuracy.sensors import felt_whisk, recorded_stroke

ALPHAS_DEG = (3.0, 10.0, 20.0)
SLOPES_DEG = (0.0, 20.0, 40.0, 60.0, 75.0)
TABLE_SLOPES_DEG = (0.0, 40.0, 75.0)
BARS_MM = (6.0, 20.0, 60.0)
BAR_SLOPES_DEG = (0.0, 20.0, 40.0)
STYLES = ("s-", "o-", "D--", "v-", "^-", "P-", "x-")
THETA_RAD = np.radians(3.0)
MOST_PUSHES = 4
SPEED_DEG_S = 90.0
BEFORE_DEG = 20.0
AFTER_DEG = 6.0
PUSH_S = (BEFORE_DEG + AFTER_DEG) / SPEED_DEG_S
BAR_MM = 6.0
# [V, N] Of a sample.
NOISE_V = 0.0064
NOISE_N = 0.003
SETTINGS = EstimatorSettings(
    np.radians(10.0), np.radians(4.0), OBJECT_REACH_MM, TILT_SIGMA_RAD, np.nan, 0.5
)
KNOWN_BAR = replace(SETTINGS, object_radius_mm=BAR_MM / 2)


@dataclass(frozen=True)
class Contact:
    """A contact to be pushed against: slope, friction angle, distance, lean along the whisker, and the bar's diameter.

    noise: of gauges and load cell, in parts of the stated.
    """

    beta_deg: float
    alpha_deg: float
    d_x_mm: float
    psi_deg: float
    bar_mm: float = BAR_MM
    noise: float = 1.0


@dataclass(frozen=True)
class Answer:
    """What one method says of a contact, and how many pushes it took; the truth is that of its last push."""

    estimate: Estimate
    truth_mm: float
    pushes: int

    @property
    def error(self) -> float:
        """Return the relative error."""
        return self.estimate.d_x_mm / self.truth_mm - 1

    @property
    def is_inside(self) -> bool:
        """Return whether the 95 % interval holds the truth."""
        low = self.estimate.low_mm
        high = self.estimate.high_mm
        if np.isnan(low):
            low = self.estimate.d_x_mm - Z_95 * self.estimate.sigma_mm
            high = self.estimate.d_x_mm + Z_95 * self.estimate.sigma_mm
        return bool(low <= self.truth_mm <= high)


Push = Callable[[float], tuple[Whisk, float] | None]


@dataclass(frozen=True)
class Method:
    """One of the table's columns: what it needs, and how it answers by pushes in planes that it may turn."""

    title: str
    axes: int
    sensors: str
    answer: Callable[[Push], Answer | None]


def by_one_push(estimator: Callable, settings: EstimatorSettings = SETTINGS) -> Callable:
    """Return the answer of an estimator to one push."""

    def answer(push: Push) -> Answer | None:
        pushed = push(0.0)
        return pushed and Answer(estimator(pushed[0], settings), pushed[1], 1)

    return answer


@dataclass(frozen=True)
class Rotation:
    """What is known after a rotation, and how far its plane was turned."""

    answer: Answer
    turn_rad: float


def rotations(push: Push) -> list[Rotation]:
    """Push, turn the plane by the slip that is felt, and push again until it does not matter."""
    found: list[Rotation] = []
    turn_rad = 0.0
    while len(found) < MOST_PUSHES:
        pushed = push(np.degrees(turn_rad))
        if pushed is None:
            break
        whisk, truth_mm = pushed
        estimate = reoriented(whisk, SETTINGS)
        found.append(Rotation(Answer(estimate, truth_mm, len(found) + 1), turn_rad))
        further_rad = next_turn_rad(whisk, SETTINGS)
        if further_rad == 0.0:
            break
        turn_rad += further_rad
    return found


def by_reorientation(push: Push) -> Answer | None:
    """Return what the last rotation says."""
    found = rotations(push)
    return found[-1].answer if found else None


METHODS = (
    Method("touch alone [24]–[26], [33]", 1, "a switch", by_one_push(SENSORS["touch_alone"])),
    Method("compliance (2) [19]", 1, "m_z", by_one_push(no_slip)),
    Method(
        "(2) less rolling [19]", 1, "m_z, radius", by_one_push(compliance_with_rolling, KNOWN_BAR)
    ),
    Method("reorientation [19], [37]", 2, "m_y, m_z", by_reorientation),
    Method("vibration [35]", 1, "m_z, fast", by_one_push(vibration)),
    Method("force and moment [21], [37]", 1, "six axes", by_one_push(SENSORS["force_and_moment"])),
    Method("(10), this paper", 1, "m_y, m_z", by_one_push(with_friction)),
)


def pushes_of(contact: Contact, rng: np.random.Generator) -> Push:
    """Return the function that pushes against a contact, the plane of rotation turned by some degrees."""

    def push(turn_deg: float) -> tuple[Whisk, float] | None:
        table = TrialTable(
            beta_deg=contact.beta_deg - turn_deg,
            psi_deg=contact.psi_deg,
            d_x_mm=contact.d_x_mm,
            bar_diameter_mm=contact.bar_mm,
            speed_deg_s=SPEED_DEG_S,
            before_deg=BEFORE_DEG,
            after_deg=AFTER_DEG,
            friction=float(np.tan(np.radians(contact.alpha_deg))),
            beta_scatter_deg=0.0,
            d_x_scatter_mm=0.0,
        )
        protocol = Protocol(
            trials=[table],
            gauges=GaugesTable(
                matrix_Nmm_per_V=((10.0, 0.0), (0.0, 10.0)),
                noise_V=NOISE_V * contact.noise,
                known=True,
                vibration=True,
            ),
            load_cell=LoadCellTable(noise_N=NOISE_N * contact.noise),
            motor=MotorTable(ramp_s=0.01),
            pictures=PicturesTable(step_deg=3.0),
        )
        return felt(protocol, rng)

    return push


def felt(protocol: Protocol, rng: np.random.Generator) -> tuple[Whisk, float] | None:
    """Return a push as it is felt, its ringing taken out, and its true distance.

    None where it finds no hold or is not felt.
    """
    found = recorded_stroke(protocol, rng)
    if found is None:
        return None
    truth_mm, stroke = found
    whisk = felt_whisk(stroke, THETA_RAD)
    return None if whisk is None else (without_ringing(whisk), truth_mm)


def contacts(
    count: int, seed: int, alphas_deg: Sequence[float]
) -> Iterator[tuple[Contact, np.random.Generator]]:
    """Yield the contacts of the table, `count` a cell, each cell with a random stream of its own."""
    for alpha_deg in alphas_deg:
        for beta_deg in SLOPES_DEG:
            rng = np.random.default_rng([seed, int(alpha_deg), int(beta_deg)])
            for _ in range(count):
                contact = Contact(beta_deg, alpha_deg, rng.uniform(30.0, 80.0), 5.0 * rng.normal())
                yield contact, rng


def answers(
    count: int, seed: int, alphas_deg: Sequence[float] = ALPHAS_DEG
) -> dict[tuple[str, float, float], list[Answer]]:
    """Return what each method says, by its title, friction angle and slope."""
    found = {}
    for contact, rng in contacts(count, seed, alphas_deg):
        push = cache(pushes_of(contact, rng))  # the first is one and the same for all
        for method in METHODS:
            answer = method.answer(push)
            if answer is not None:
                key = (method.title, contact.alpha_deg, contact.beta_deg)
                found.setdefault(key, []).append(answer)
    return found


def rms_percent(values: list[float]) -> float:
    """Return the root mean square of what is known, %; NaN of nothing."""
    known = [value for value in values if np.isfinite(value)]
    return 100.0 * float(np.sqrt(np.mean(np.square(known)))) if known else float("nan")


def stated_percent(said: list[Answer]) -> float:
    """Return the root mean square of the stated sigmas, %."""
    return rms_percent([one.estimate.sigma_mm / one.truth_mm for one in said])


def cell(said: list[Answer]) -> str:
    """Return RMS error, stated sigma, and how many have none, as the table has them."""
    error = rms_percent([one.error for one in said])
    none = sum(np.isnan(one.error) for one in said)
    without = f" ({none} none)" if none else ""
    return f"{two_digits(error)} ± {two_digits(stated_percent(said))}{without}"


def two_digits(value: float) -> str:
    """Return a number to two digits, without an exponent.

    >>> two_digits(1234.0), two_digits(0.123)
    ('1200', '0.12')
    """
    return f"{float(f'{value:.2g}'):g}"


def table_lines(found: dict) -> Iterator[str]:
    """Yield a line a method: its need, error ± sigma by friction angle and slope, and how often intervals hold."""
    columns = [(alpha, beta) for alpha in ALPHAS_DEG for beta in TABLE_SLOPES_DEG]
    by_cell = [f"α {alpha:g}°, β {beta:g}°" for alpha, beta in columns]
    titles = ("method", "pushes", "s", "axes", "sensors", *by_cell, "95 % hold", "z RMS")
    yield "| " + " | ".join(titles) + " |"
    yield "|---" * len(titles) + "|"
    for method in METHODS:
        said = [one for key, cell in found.items() if key[0] == method.title for one in cell]
        pushes = np.mean([one.pushes for one in said])
        known = [one.is_inside for one in said if np.isfinite(one.error)]
        z = 0.01 * rms_percent([one.error * one.truth_mm / one.estimate.sigma_mm for one in said])
        cells = [cell(found.get((method.title, *column), [])) for column in columns]
        values = (
            method.title,
            f"{pushes:.1f}",
            f"{pushes * PUSH_S:.2f}",
            f"{method.axes}",
            method.sensors,
            *cells,
            f"{100 * np.mean(known):.0f} % of {len(known)}",
            f"{z:.2f}",
        )
        yield "| " + " | ".join(values) + " |"


def after_each_rotation(
    count: int, seed: int, alphas_deg: Sequence[float] = ALPHAS_DEG
) -> Iterator[str]:
    """Yield a line a friction angle, slope and noise: what is known after each rotation."""
    yield "| noise | α | β | rotations | (2) after 1, 2, … | slope left | (10) in that time |"
    yield "|---|---|---|---|---|---|---|"
    for noise in (1.0, 4.0):
        cells: dict[tuple[float, float], list] = {}
        for contact, rng in contacts(count, seed, alphas_deg):
            push = pushes_of(replace(contact, noise=noise), rng)
            found = rotations(push)
            if not found:
                continue
            again = [push(0.0) for _ in found]
            by_10 = [with_friction(one[0], SETTINGS).d_x_mm / one[1] - 1 for one in again if one]
            left_deg = contact.beta_deg - np.degrees(found[-1].turn_rad)
            key = (contact.alpha_deg, contact.beta_deg)
            cells.setdefault(key, []).append((found, left_deg, float(np.mean(by_10))))
        for (alpha_deg, beta_deg), mine in cells.items():
            after = []
            for number in range(max(len(found) for found, *_ in mine)):
                errors = [found[number].answer.error for found, *_ in mine if number < len(found)]
                after.append(f"{rms_percent(errors):.1f} ({len(errors)})")
            needed = np.mean([len(found) for found, *_ in mine])
            left = np.mean([left_deg for _, left_deg, _ in mine])
            by_10 = rms_percent([error for *_, error in mine])
            yield (
                f"| {noise:g} | {alpha_deg:g}° | {beta_deg:g}° | {needed:.1f} | {', '.join(after)} | "
                f"{left:.1f}° | {by_10:.1f} |"
            )


def on_curved_objects(count: int, seed: int) -> Iterator[str]:
    """Yield a line a bar and slope: (2), (2) less rolling and (10), on a bar whose radius is known."""
    methods = {"(2)": no_slip, "(2) less rolling": compliance_with_rolling, "(10)": with_friction}
    yield "| bar | β | " + " | ".join(methods) + " |"
    yield "|---" * (2 + len(methods)) + "|"
    for bar_mm in BARS_MM:
        settings = replace(SETTINGS, object_radius_mm=bar_mm / 2)
        for beta_deg in BAR_SLOPES_DEG:
            rng = np.random.default_rng([seed, int(bar_mm), int(beta_deg)])
            said: dict[str, list[Answer]] = {title: [] for title in methods}
            for _ in range(count):
                contact = Contact(beta_deg, 10.0, rng.uniform(30.0, 80.0), 0.0, bar_mm)
                pushed = pushes_of(contact, rng)(0.0)
                if pushed is None:
                    continue
                for title, estimator in methods.items():
                    said[title].append(Answer(estimator(pushed[0], settings), pushed[1], 1))
            cells = " | ".join(cell(mine) for mine in said.values())
            yield f"| {bar_mm:g} mm | {beta_deg:g}° | {cells} |"


def draw(found: dict, path: Path) -> None:
    """Draw RMS error and, below, stated sigma over the slope, a column a friction angle."""
    from matplotlib.figure import Figure

    with style():
        figure = Figure(figsize=(9.0, 6.0), layout="constrained")
        panels = figure.subplots(2, len(ALPHAS_DEG), sharey=True, sharex=True)
        for column, alpha_deg in enumerate(ALPHAS_DEG):
            for number, method in enumerate(METHODS):
                errors = []
                sigmas = []
                for beta_deg in SLOPES_DEG:
                    said = found.get((method.title, alpha_deg, beta_deg), [])
                    errors.append(rms_percent([one.error for one in said]))
                    sigmas.append(stated_percent(said))
                for panel, values in zip(panels[:, column], (errors, sigmas)):
                    # Those that coincide show beside each other: what is drawn first is wider.
                    panel.plot(
                        SLOPES_DEG,
                        values,
                        STYLES[number],
                        lw=nested_size(number, len(METHODS), 1.0, 0.5),
                        ms=nested_size(number, len(METHODS), 4.0, 0.6),
                        color=f"C{number}",
                        label=method.title,
                    )
            panels[0, column].set(yscale="log", title=f"α = {alpha_deg:g}°")
            panels[1, column].set(xlabel="slope β, °", xticks=SLOPES_DEG)
        panels[0, 0].set_ylabel("error of d$_x$, RMS, %")
        panels[1, 0].set_ylabel("stated sigma of d$_x$, %")
        handles = panels[0, 0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=4)
        save(figure, path, "tests/studies/accuracy/rivals.py")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--rotations", action="store_true")
    parser.add_argument("--curved", action="store_true")
    options = parser.parse_args()
    if options.rotations:
        print(*after_each_rotation(options.count, options.seed), sep="\n")
        return
    if options.curved:
        print(*on_curved_objects(options.count, options.seed), sep="\n")
        return
    found = answers(options.count, options.seed)
    print(*table_lines(found), sep="\n")
    if options.figure:
        draw(found, options.figure)


if __name__ == "__main__":
    main()
