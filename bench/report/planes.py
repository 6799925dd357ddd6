"""One whisk's figure: its sensing plane, and slip, force angle and moments over its stroke."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bench.base.drawing import is_drawn, save
from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.report.run_facts import plane_name
from bench.report.sensing_plane import draw_sensing_plane
from bench.session.whisker import Whisker
from vision import FrameTruth, Value

_SEEN = "#2166ac"
_CHANNELS = ("#b2182b", "#2166ac")  # m_y, m_z
# [in] A layout: the plane at the left, three curves at the right of it. Found by
# `constrained_layout`, the places of the axes would cost as much again as their drawing.
_SIZE_IN = (10.4, 5.8)
_PLANE = (0.055, 0.17, 0.535, 0.77)  # left, bottom, width, height, of the figure
_CURVES = ((0.68, 0.72, 0.305, 0.225), (0.68, 0.41, 0.305, 0.225), (0.68, 0.10, 0.305, 0.225))
# [rad] Below, the direction of the deflection is not drawn: of 0.3 mm there, 0.003 mm of slip's sigma are
# 0.6° of direction, and more below. Derived.
_LEAST_THETA_RAD = np.radians(0.3)


@dataclass(frozen=True)
class Curve:
    """A quantity over the pushing angle, and where it was felt: (θ, value, sigma) at one angle."""

    theta_deg: np.ndarray  # (n,)
    values: np.ndarray  # (n,)
    sigmas: np.ndarray  # (n,)
    colour: str
    label: str
    felt: tuple[float, float, float] | None = None


def draw_planes(
    result: TrialResult, whisker: Whisker, friction: tuple[float, str], out: Path, stamp: str
) -> list[str]:
    """Draw planes/<trial>_<whisk>.png of each whisk that was seen to be pushed; return their names."""
    names = []
    for _, seen, felt in whisks([result]):
        if not (seen.has_truth and seen.at.d_y_mm.is_known):
            continue
        name = plane_name(result.trial.name, seen.whisk)
        names.append(name)
        if not is_drawn(out / name, stamp):
            save(whisk_figure(result, seen, felt, whisker, friction), out / name, stamp, dpi=120)
    return names


def whisk_figure(
    result: TrialResult,
    seen: SeenWhisk,
    felt: FeltWhisk,
    whisker: Whisker,
    friction: tuple[float, str],
) -> Figure:
    """Draw one whisk: its sensing plane, and slip, force angle and moments over the pushing angle."""
    figure = Figure(figsize=_SIZE_IN)
    draw_sensing_plane(figure.add_axes(_PLANE), result, seen, friction)
    slip, angle, moments = map(figure.add_axes, _CURVES)
    draw_curves(slip, "slip σ  [mm]", slip_over_stroke(seen))
    draw_curves(angle, "force angle φ  [°]", force_angle_over_stroke(seen))
    draw_curves(moments, "moment  [N·mm]", moments_over_stroke(result, seen, felt, whisker))
    moments.set_xlabel("pushing angle θ  [°]")
    return figure


def slip_over_stroke(seen: SeenWhisk) -> list[Curve]:
    """Return the slip in each touching frame."""
    frames = seen.frames
    return [] if frames is None else [_seen_curve(frames, frames.slip_mm)]


def force_angle_over_stroke(seen: SeenWhisk) -> list[Curve]:
    """Return the direction of the deflection in each touching frame, deg."""
    frames = seen.frames
    if frames is None:
        return []
    return [_seen_curve(frames, frames.phi_rad.in_degrees(), _LEAST_THETA_RAD)]


def _seen_curve(frames: FrameTruth, quantity: Value, above_rad: float = -np.inf) -> Curve:
    """Return a quantity (frames,) of the touching frames above a pushing angle."""
    theta_rad = frames.theta_rad.value
    known = np.asarray(frames.touching, dtype=bool) & (theta_rad > above_rad)
    values = quantity.value[known]
    return Curve(np.degrees(theta_rad[known]), values, quantity.sigma[known], _SEEN, "seen")


def moments_over_stroke(
    result: TrialResult, seen: SeenWhisk, felt: FeltWhisk, whisker: Whisker
) -> list[Curve]:
    """Return m_y and m_z at the base: of the seen shape over the stroke, and felt at θ."""
    if seen.deflection is None:
        return []
    reference = reference_from_pictures(seen, whisker)
    if reference is None:
        return []
    theta_deg = np.degrees(reference.theta_rad)
    sigmas = reference.moments_sigma
    curves = []
    for channel, (name, value) in enumerate((("m$_y$", felt.m_y_Nmm), ("m$_z$", felt.m_z_Nmm))):
        at = (result.theta_deg, float(value.value), float(value.sigma))
        moments = reference.moments[:, channel]
        curves.append(
            Curve(theta_deg, moments, sigmas[:, channel], _CHANNELS[channel], name, felt=at)
        )
    return curves


def draw_curves(axes: Axes, label: str, curves: Sequence[Curve]) -> None:
    """Draw curves with a band of one sigma, and as points what was felt."""
    axes.set_ylabel(label)
    axes.axhline(0.0, color="0.7", lw=0.7)
    for curve in curves:
        low = curve.values - curve.sigmas
        high = curve.values + curve.sigmas
        axes.fill_between(curve.theta_deg, low, high, color=curve.colour, alpha=0.22, lw=0)
        axes.plot(curve.theta_deg, curve.values, color=curve.colour, lw=1.3, label=curve.label)
        if curve.felt is not None:
            theta_deg, value, sigma = curve.felt
            axes.errorbar(theta_deg, value, sigma, fmt="D", ms=4, color=curve.colour, capsize=2.5)
    if len(curves) > 1:
        axes.legend(loc="upper left", ncols=2, title="lines seen, points felt", title_fontsize=7)
