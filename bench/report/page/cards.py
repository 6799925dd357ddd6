"""A whisk's card: its picture, plane, curves and numbers; and its row of the table."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

from markupsafe import Markup

from bench.analyses.alphas import seen_friction
from bench.base.drawing import label_of
from bench.base.statuses import cure_of
from bench.gauges.felt import lateness
from bench.records.trial_result import EstimateRow
from bench.report.assembly import status_of
from bench.report.page.plane import (
    force_angle_over_stroke,
    moments_over_stroke,
    sensing_plane,
    slip_over_stroke,
)
from bench.report.page.thumbnails import picture_source
from bench.report.page.words import MISSING, Row, number, told, with_sigma
from bench.report.summary.warning_lines import SILENT, is_silent
from bench.session.whisker import Whisker
from vision.fit.beam_check import BeamCheck
from vision.geometry.counted import counted

SOUND = "sound"
_DEGREES = math.degrees(1.0)


@dataclass(frozen=True)
class Cell:
    """What stands in the table: text, a number to sort by (None: by the text), and whether narrow pages show it."""

    text: str
    value: float | None = None
    wide: bool = False


@dataclass(frozen=True)
class Card:
    """A whisk's card. numbers: (name, value with sigma); estimates: rows of the table of estimators; pictures: alt text
    and source; plots: drawings; doubts: (what, cure)."""

    key: str
    title: str
    subtitle: str
    numbers: tuple[tuple[str, str], ...]
    estimates: tuple[tuple[str, ...], ...]
    picture: tuple[str, str] | None
    plots: tuple[Markup, ...]
    doubts: tuple[tuple[str, str], ...]


def card(row: Row, whisker: Whisker, out: Path, whisks: int) -> Card:
    """The card of one whisk. whisks: of the whole session."""
    trial, seen = row.result.trial, row.seen
    said = [
        trial.surface,
        "" if trial.speed_deg_s is None else f"{trial.speed_deg_s:g}°/s",
        trial.purpose,
    ]
    rests_on = counted(seen.truth.cameras, "camera"), counted(seen.truth.frames_used, "frame")
    subtitle = ", ".join([*filter(None, said), *rests_on])
    source = (
        picture_source(out, f"overlays/{row.trial}_{seen.whisk}.png", whisks)
        if seen.overlay
        else ""
    )
    alt = f"{row.name}: wire, bar and contact as found, drawn on the frames at touch and at θ of every camera"
    plots = (
        sensing_plane(row),
        slip_over_stroke(row),
        force_angle_over_stroke(row),
        moments_over_stroke(row, whisker),
    )
    status = status_of(seen, row.felt)
    return Card(
        row.key,
        row.name,
        subtitle,
        tuple(numbers(row)),
        tuple(_estimate(row, answer) for answer in row.felt.estimates),
        (alt, source) if source else None,
        tuple(filter(None, plots)),
        tuple((said, cure_of([code])) for code, said in status.parts if code not in SILENT),
    )


def numbers(row: Row) -> list[tuple[str, str]]:
    """Each quantity with one sigma, what is not known left out."""
    seen, felt, at = row.seen, row.felt, row.seen.at
    found = [
        ("d_x", told(seen.d_x_mm), "mm"),
        ("touch seen", told(seen.touch_rad, degrees=True), "°"),
        ("touch felt", told(felt.touch_felt_rad, degrees=True), "°"),
        ("slope β", told(seen.beta_rad, degrees=True), "°"),
        ("tilt ψ", told(seen.psi_rad, degrees=True), "°"),
    ]
    if at is not None:
        found += [
            ("slip σ at θ", told(at.slip_mm), "mm"),
            ("slip along the whisker", told(at.longitudinal_slip_mm), "mm"),
            ("deflection d_y", told(at.d_y_mm), "mm"),
            ("deflection d_z", told(at.d_z_mm), "mm"),
            ("force angle φ seen", told(at.phi_rad, degrees=True), "°"),
            ("friction angle α seen", told(at.alpha_rad, degrees=True), "°"),
        ]
    found += [
        ("moment m_y felt", told(felt.m_y_Nmm), "N·mm"),
        ("moment m_z felt", told(felt.m_z_Nmm), "N·mm"),
        ("force angle φ felt", told(felt.phi_felt_rad, degrees=True), "°"),
    ]
    found += [] if seen.truth.beam is None else _beam_numbers(seen.truth.beam)
    return [(name, f"{text} {unit}") for name, text, unit in found if text != MISSING]


def _beam_numbers(beam: BeamCheck) -> list[tuple[str, str, str]]:
    """By how much a curve left free moves what the beam with a point load gives."""
    compared = (
        ("d_x", beam.d_x, 1.0, "mm"),
        ("touch", beam.touch, _DEGREES, "°"),
        ("slip", beam.slip, 1.0, "mm"),
    )
    return [
        (
            f"{name} by a spline, less by the beam",
            with_sigma(scale * (found.spline - found.beam), scale * found.difference_sigma),
            unit,
        )
        for name, found, scale, unit in compared
    ] + [("chance that a beam departs so far", number(100.0 * beam.chance, 1), "%")]


def _estimate(row: Row, answer: EstimateRow) -> tuple[str, ...]:
    """Estimator, distance, 95 % interval, error in mm, in per cent, status."""
    truth, d_x = row.seen.d_x_mm, answer.d_x_est_mm
    sigma = math.hypot(d_x.sigma, truth.sigma)
    low, high = answer.d_x_est_low_mm, answer.d_x_est_high_mm
    interval = (
        f"{number(low, 1)} to {number(high, 1)}"
        if math.isfinite(low) and math.isfinite(high)
        else MISSING
    )
    error = d_x.value - truth.value
    percent = 100.0 / truth.value
    return (
        label_of(answer.estimator),
        told(d_x),
        interval,
        with_sigma(error, sigma, sign=True),
        with_sigma(percent * error, percent * sigma, sign=True),
        answer.status,
    )


def columns(estimators: list[str]) -> list[Cell]:
    """The table's head."""
    fixed = [
        Cell("trial"),
        Cell("surface", wide=True),
        _head("°/s", wide=True),
        _head("β [°]"),
        _head("d_x [mm]"),
        _head("slip [mm]", wide=True),
        _head("felt − seen [°]", wide=True),
        _head("α seen [°]", wide=True),
    ]
    return [*fixed, *(_head(f"{label_of(name)} [%]") for name in estimators), Cell("status")]


def _head(text: str, *, wide: bool = False) -> Cell:
    """Of a column of numbers."""
    return Cell(text, math.nan, wide)


def cells(row: Row, estimators: list[str]) -> list[Cell]:
    """The row of a whisk, in the columns' order, the trial's name apart."""
    seen, trial = row.seen, row.result.trial
    late, (alpha, alpha_sigma) = lateness(seen, row.felt), seen_friction(seen)
    speed = math.nan if trial.speed_deg_s is None else trial.speed_deg_s
    slip = seen.at.slip_mm if seen.at is not None else replace(seen.d_x_mm, value=math.nan)
    fixed = [
        Cell(trial.surface, wide=True),
        Cell(f"{speed:g}" if math.isfinite(speed) else MISSING, speed, wide=True),
        _cell(told(seen.beta_rad, degrees=True), _DEGREES * seen.beta_rad.value),
        _cell(told(seen.d_x_mm), seen.d_x_mm.value),
        _cell(told(slip), slip.value, wide=True),
        _cell(told(late, degrees=True), _DEGREES * late.value, wide=True),
        _cell(with_sigma(_DEGREES * alpha, _DEGREES * alpha_sigma), _DEGREES * alpha, wide=True),
    ]
    return [
        *fixed,
        *(_error(row, name) for name in estimators),
        Cell(status_of(seen, row.felt) or SOUND),
    ]


def is_flagged(row: Row) -> bool:
    """Return whether the user should look at a whisk."""
    return not is_silent(status_of(row.seen, row.felt))


def _error(row: Row, estimator: str) -> Cell:
    answer = next((a for a in row.felt.estimates if a.estimator == estimator), None)
    truth = row.seen.d_x_mm
    if answer is None or not math.isfinite(answer.d_x_est_mm.value - truth.value):
        return Cell(MISSING, math.nan)
    percent = 100.0 / truth.value
    error = percent * (answer.d_x_est_mm.value - truth.value)
    return Cell(
        with_sigma(error, percent * math.hypot(answer.d_x_est_mm.sigma, truth.sigma), sign=True),
        error,
    )


def _cell(text: str, value: float, *, wide: bool = False) -> Cell:
    return Cell(text, float(value), wide)
