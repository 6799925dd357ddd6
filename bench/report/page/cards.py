"""A whisk's card: its pictures and numbers; and its row of the table."""

import math
from dataclasses import dataclass
from pathlib import Path

from bench.base.drawing import label_of
from bench.base.numbers import number_range
from bench.base.statuses import cure_of
from bench.gauges.felt import lateness
from bench.records.trial_result import BY_STAGE, EstimateRow, SeenWhisk
from bench.report.page.thumbnails import picture_source
from bench.report.page.words import MISSING, WhiskRow, distance_text, number, value_text
from bench.report.run_facts import plane_name
from bench.report.summary.warning_lines import SILENT, is_silent
from bench.report.whisk_rows import status_of
from vision import UNKNOWN, TruthAtAngle, Value
from vision.geometry import counted

SOUND = "sound"

_Quantity = tuple[str, Value, str]  # name, value, unit


@dataclass(frozen=True)
class Cell:
    """A cell of the table.

    value: a number to sort by; None: the text is sorted by. wide: only wide pages have it.
    """

    text: str
    value: float | None = None
    wide: bool = False


@dataclass(frozen=True)
class Card:
    """A whisk's card.

    numbers: (name, value with sigma). estimates: rows of the table of estimators. pictures: (alt
    text, source) of each. warnings: (sentence, cure) of each.
    """

    key: str
    title: str
    subtitle: str
    numbers: tuple[tuple[str, str], ...]
    estimates: tuple[tuple[str, ...], ...]
    pictures: tuple[tuple[str, str], ...]
    warnings: tuple[tuple[str, str], ...]


def card(row: WhiskRow, out: Path, whisks: int) -> Card:
    """Return the card of one whisk. whisks: how many the whole session has."""
    warnings = []
    for code, sentence in status_of(row.seen, row.felt).parts:
        if code not in SILENT:
            warnings.append((sentence, cure_of([code])))
    return Card(
        row.key,
        row.name,
        _subtitle(row),
        tuple(numbers(row)),
        tuple(_estimate(row, estimate) for estimate in row.felt.estimates),
        _pictures(row, out, whisks),
        tuple(warnings),
    )


def _subtitle(row: WhiskRow) -> str:
    """Return surface, speed, purpose and what the truth rests on, as far as they are known."""
    trial = row.result.trial
    parts = [trial.surface] if trial.surface else []
    if trial.speed_deg_s is not None:
        parts.append(f"{trial.speed_deg_s:g}°/s")
    parts += [
        trial.purpose,
        counted(row.seen.truth.cameras, "camera"),
        counted(row.seen.truth.frames_used, "frame"),
    ]
    return ", ".join(parts)


def _pictures(row: WhiskRow, out: Path, whisks: int) -> tuple[tuple[str, str], ...]:
    """Return (alt text, source) of the pictures of a whisk that are in the results' folder."""
    which = f"{row.trial}_{row.seen.whisk}.png"
    found = []
    if row.seen.overlay:
        alt = (
            "wire, bar and contact as found, drawn on the frames at touch and at θ of every camera"
        )
        found.append((alt, picture_source(out, f"overlays/{which}", whisks)))
    alt = "sensing plane, and slip, force angle and moments over the pushing angle"
    found.append((alt, picture_source(out, plane_name(row.trial, row.seen.whisk), whisks)))
    return tuple((f"{row.name}: {alt}", source) for alt, source in found if source)


def numbers(row: WhiskRow) -> list[tuple[str, str]]:
    """Return each quantity with one sigma; what is not known is left out."""
    beam = row.seen.truth.beam
    found = []
    for name, value, unit in (*_quantities(row), *_beam_changes(row)):
        text = value_text(value)
        if text != MISSING:
            found.append((name, f"{text} {unit}"))
    if beam is not None:
        chance = number(100.0 * beam.chance, 1)
        if chance != MISSING:
            found.append(("chance that a beam departs so far", f"{chance} %"))
    return found


def _quantities(row: WhiskRow) -> list[_Quantity]:
    """Return what was seen and felt of a whisk, known or not."""
    seen = row.seen
    felt = row.felt
    return [
        ("d_x by a stage" if seen.source == BY_STAGE else "d_x", seen.d_x_mm, "mm"),
        ("touch seen", seen.touch_rad.in_degrees(), "°"),
        ("touch felt", felt.touch_felt_rad.in_degrees(), "°"),
        ("slope β", seen.beta_rad.in_degrees(), "°"),
        ("tilt ψ", seen.psi_rad.in_degrees(), "°"),
        *(_quantities_at(seen.at) if seen.at is not None else ()),
        ("moment m_y felt", felt.m_y_Nmm, "N·mm"),
        ("moment m_z felt", felt.m_z_Nmm, "N·mm"),
        ("force angle φ felt", felt.phi_felt_rad.in_degrees(), "°"),
    ]


def _quantities_at(at: TruthAtAngle) -> list[_Quantity]:
    """Return what was seen at the pushing angle."""
    return [
        ("slip σ at θ", at.slip_mm, "mm"),
        ("slip along the whisker", at.longitudinal_slip_mm, "mm"),
        ("deflection d_y", at.d_y_mm, "mm"),
        ("deflection d_z", at.d_z_mm, "mm"),
        ("force angle φ seen", at.phi_rad.in_degrees(), "°"),
        ("friction angle α seen", at.alpha_rad.in_degrees(), "°"),
    ]


def _beam_changes(row: WhiskRow) -> list[_Quantity]:
    """Return by how much a curve left free moves what the beam with a point load gives, where it was tried."""
    beam = row.seen.truth.beam
    changes: list[_Quantity] = []
    if beam is None:
        return changes
    for name, compared, unit in (
        ("d_x", beam.d_x, "mm"),
        ("touch", beam.touch, "°"),
        ("slip", beam.slip, "mm"),
    ):
        change = Value(compared.spline - compared.beam, compared.difference_sigma)
        if unit == "°":
            change = change.in_degrees()
        changes.append((f"{name} by a spline, less by the beam", change, unit))
    return changes


def _estimate(row: WhiskRow, estimate: EstimateRow) -> tuple[str, ...]:
    """Return estimator, distance, 95 % interval, error in mm, in per cent, status."""
    truth = row.seen.d_x_mm
    interval = number_range(estimate.d_x_est_low_mm, estimate.d_x_est_high_mm, 1)
    error = estimate.error_mm(truth)
    percent = estimate.error_percent(truth)
    return (
        label_of(estimate.estimator),
        value_text(estimate.d_x_est_mm),
        interval,
        value_text(error, sign=True),
        value_text(percent, sign=True),
        estimate.status,
    )


def columns(estimators: list[str]) -> list[Cell]:
    """Return the table's head."""
    fixed = [
        Cell("trial"),
        Cell("surface", wide=True),
        _head("°/s", wide=True),
        _head("β [°]"),
        _head("d_x [mm], ± own ± shared"),
        _head("slip [mm]", wide=True),
        _head("felt − seen [°]", wide=True),
        _head("α seen [°]", wide=True),
    ]
    return [*fixed, *(_head(f"{label_of(name)} [%]") for name in estimators), Cell("status")]


def _head(text: str, *, wide: bool = False) -> Cell:
    """Return the head of a column of numbers."""
    return Cell(text, math.nan, wide)


def cells(row: WhiskRow, estimators: list[str]) -> list[Cell]:
    """Return the row of a whisk, in the columns' order, the trial's name apart."""
    seen = row.seen
    trial = row.result.trial
    speed = math.nan if trial.speed_deg_s is None else trial.speed_deg_s
    slip = seen.at.slip_mm if seen.at is not None else UNKNOWN
    fixed = [
        Cell(trial.surface, wide=True),
        Cell(f"{speed:g}" if math.isfinite(speed) else MISSING, speed, wide=True),
        _value_cell(seen.beta_rad.in_degrees()),
        _distance_cell(seen),
        _value_cell(slip, wide=True),
        _value_cell(lateness(seen, row.felt).in_degrees(), wide=True),
        _value_cell(seen.friction_rad.in_degrees(), wide=True),
    ]
    errors = [_error(row, name) for name in estimators]
    return [*fixed, *errors, Cell(status_of(seen, row.felt) or SOUND)]


def is_flagged(row: WhiskRow) -> bool:
    """Return whether a whisk has a warning that the user should read."""
    return not is_silent(status_of(row.seen, row.felt))


def _error(row: WhiskRow, estimator: str) -> Cell:
    """Return the error of one estimator, per cent of the true distance."""
    estimate = row.felt.estimate(estimator)
    if estimate is None:
        return Cell(MISSING, math.nan)
    percent = estimate.error_percent(row.seen.d_x_mm)
    return Cell(value_text(percent, sign=True), percent.value)


def _distance_cell(seen: SeenWhisk) -> Cell:
    """Return the cell of d_x with both parts of its sigma, sorted by d_x."""
    return Cell(distance_text(seen), float(seen.d_x_mm.value))


def _value_cell(value: Value, *, wide: bool = False) -> Cell:
    """Return the cell of a value with its sigma, sorted by the value."""
    return Cell(value_text(value), float(value.value), wide)
