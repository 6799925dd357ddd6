"""One whisk in lines: its sensing plane as in Fig. 4, and slip, force angle and moments over its stroke."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon, Wedge

from bench.base.drawing import is_drawn, save
from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import FeltWhisk, SeenTrial, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker

_WIRE, _BAR, _FORCE, _CONE, _PATH = "#2166ac", "#bdbdbd", "#b2182b", "#fddbc7", "#1b7837"
_CHANNELS = ("#b2182b", "#2166ac")  # m_y, m_z
_MARGIN_MM = 2.2
# [in] A layout: the plane at the left, three curves at the right of it. Found by
# `constrained_layout`, the places of the axes would cost as much again as their drawing.
_SIZE_IN = (10.4, 5.8)
_PLANE = (0.055, 0.17, 0.535, 0.77)  # left, bottom, width, height, of the figure
_CURVES = ((0.68, 0.72, 0.305, 0.225), (0.68, 0.41, 0.305, 0.225), (0.68, 0.10, 0.305, 0.225))
# [rad] Below this pushing angle the direction of the deflection is noise. Set by eye.
_LEAST_THETA_RAD = np.radians(0.3)
_LEAST_DEG, _ROOM_DEG = 3.0, 25.0  # of an angle that is drawn, and of one that its name fits into
_LABEL_MM = 0.4  # of room that a name takes
_LEG = {"fontsize": 9, "color": "0.25"}


@dataclass(frozen=True)
class Curve:
    """A quantity over the pushing angle, and where it was felt: (θ, value, sigma) at one angle."""

    theta_deg: np.ndarray  # (n,)
    values: np.ndarray  # (n,)
    sigmas: np.ndarray  # (n,)
    colour: str
    label: str
    felt: tuple[float, float, float] | None = None


def plane_name(trial: str, whisk: int) -> str:
    """Return the name of a whisk's figure in the results' folder."""
    return f"planes/{trial}_{whisk}.png"


def draw_planes(
    result: TrialResult, whisker: Whisker, friction: tuple[float, str], out: Path, stamp: str
) -> list[str]:
    """Draw planes/<trial>_<whisk>.png of each whisk that was seen to be pushed; return their names."""
    names = []
    for _, seen, felt in whisks([result]):
        if not (seen.has_truth and np.isfinite(seen.at.d_y_mm.value)):
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
    sensing_plane(figure.add_axes(_PLANE), result, seen, friction)
    slip, angle, moments = (figure.add_axes(place) for place in _CURVES)
    _draw_curves(slip, "slip σ  [mm]", slip_over_stroke(seen))
    _draw_curves(angle, "force angle φ  [°]", force_angle_over_stroke(seen))
    _draw_curves(moments, "moment  [N·mm]", moments_over_stroke(result, seen, felt, whisker))
    moments.set_xlabel("pushing angle θ  [°]")
    return figure


def slip_over_stroke(seen: SeenWhisk) -> list[Curve]:
    """Return the slip in each touching frame."""
    frames = seen.frames
    if frames is None:
        return []
    touching = np.asarray(frames.touching, dtype=bool)
    theta_deg = np.degrees(frames.theta_rad.value[touching])
    slip = frames.slip_mm
    return [Curve(theta_deg, slip.value[touching], slip.sigma[touching], _WIRE, "seen")]


def force_angle_over_stroke(seen: SeenWhisk) -> list[Curve]:
    """Return the direction of the deflection in each touching frame, deg."""
    frames = seen.frames
    if frames is None:
        return []
    known = np.asarray(frames.touching, dtype=bool) & (frames.theta_rad.value > _LEAST_THETA_RAD)
    theta_deg = np.degrees(frames.theta_rad.value[known])
    phi_deg = np.degrees(frames.phi_rad.value[known])
    sigma_deg = np.degrees(frames.phi_rad.sigma[known])
    return [Curve(theta_deg, phi_deg, sigma_deg, _WIRE, "seen")]


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
    sigmas = np.sqrt(np.diag(reference.covariance)).reshape(-1, 2)
    curves = []
    for channel, (name, value) in enumerate((("m$_y$", felt.m_y_Nmm), ("m$_z$", felt.m_z_Nmm))):
        at = (result.theta_deg, float(value.value), float(value.sigma))
        moments = reference.moments[:, channel]
        curves.append(
            Curve(theta_deg, moments, sigmas[:, channel], _CHANNELS[channel], name, felt=at)
        )
    return curves


def _draw_curves(axes: Axes, label: str, curves: Sequence[Curve]) -> None:
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


def sensing_plane(
    axes: Axes, result: TrialResult, whisk: SeenWhisk, friction: tuple[float, str]
) -> None:
    """Draw the sensing plane of one whisk: y to the right, z up, in the contact frame from P0 on."""
    path = contact_path(whisk)
    beta, at = whisk.beta_rad.value, whisk.at
    along, normal = np.array([np.sin(beta), np.cos(beta)]), np.array([-np.cos(beta), np.sin(beta)])
    contact = at.slip_mm.value * along
    virtual = contact + np.array([at.d_y_mm.value, -at.d_z_mm.value])
    radius = result.seen.wire_radius_mm * result.whisker.left(whisk.d_x_mm.value)
    _draw_bar(axes, result.seen, radius, along, normal)
    _draw_cone(axes, contact, normal, friction, float(np.linalg.norm(virtual - contact)))
    onward = along if contact @ along >= 0 else -along
    _draw_whisker(axes, radius, contact, virtual, path, onward, normal)
    _draw_angles(axes, whisk, contact, virtual, radius)
    _draw_slip(axes, contact, normal)
    points = np.array([np.zeros(2), contact, virtual])
    low, high = points.min(axis=0) - _MARGIN_MM, points.max(axis=0) + _MARGIN_MM
    axes.set(
        xlim=(low[0], high[0]),
        ylim=(low[1], high[1]),
        aspect="equal",
        xlabel="y  [mm]",
        ylabel="z  [mm]",
    )
    axes.set_title(
        f"{result.trial.name}, whisk {whisk.whisk}, θ = {np.degrees(at.theta_rad):.2f}°", loc="left"
    )
    axes.text(
        0.98,
        0.02,
        _values(whisk),
        transform=axes.transAxes,
        ha="right",
        va="bottom",
        fontsize=8,
        linespacing=1.5,
        bbox={"fc": "white", "ec": "none", "alpha": 0.8},
    )


def _draw_bar(axes: Axes, seen: SeenTrial, radius_mm: float, along, normal) -> None:
    """The bar's outline: its near side one whisker radius from P0, which lies on the whisker's centreline."""
    far = 60.0 * along
    near = -radius_mm * normal
    width = -2.0 * seen.bar_radius_mm * normal
    axes.add_patch(
        Polygon(
            [near - far, near + far, near + far + width, near - far + width],
            fc=_BAR,
            ec="0.45",
            lw=0.8,
            zorder=0,
        )
    )
    axis = near + 0.5 * width
    axes.plot(*zip(axis - far, axis + far), color="0.45", lw=0.7, ls=(0, (8, 3, 1, 3)), zorder=1)


def _draw_cone(axes: Axes, contact, normal, friction: tuple[float, str], size: float) -> None:
    """Directions that a force without slip may have, about the contact's normal."""
    middle, half = np.degrees(np.arctan2(normal[1], normal[0])), np.degrees(friction[0])
    reach = max(1.2, 0.75 * size)
    axes.add_patch(
        Wedge(
            contact,
            reach,
            middle - half,
            middle + half,
            fc=_CONE,
            ec="none",
            alpha=0.9,
            zorder=1,
            label=f"friction cone, α = {half:.1f}° {friction[1]}",
        )
    )
    axes.plot(*zip(contact, contact + reach * normal), color="0.4", lw=0.8, ls="--", zorder=2)


def _draw_whisker(axes: Axes, radius_mm: float, contact, virtual, path, onward, normal) -> None:
    """onward (2,): the way of the slip. P stands that way and in the bar, where no cone and no slip are."""
    at_p = (radius_mm + 0.28) * (onward - 0.5 * normal) / np.linalg.norm(onward - 0.5 * normal)
    for place, fill in ((np.zeros(2), "white"), (contact, _WIRE)):
        axes.add_patch(Circle(place, radius_mm, fc=fill, ec=_WIRE, lw=1.2, alpha=0.65, zorder=3))
    axes.add_patch(Circle(virtual, radius_mm, fc="none", ec=_WIRE, lw=1.0, ls=":", zorder=3))
    axes.plot(*path.T, "-o", color=_PATH, ms=2.5, lw=1.0, zorder=5, label="contact, frame by frame")
    axes.annotate(
        "",
        contact,
        virtual,
        arrowprops={"arrowstyle": "-|>", "color": _FORCE, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
        zorder=4,
    )
    axes.plot(*zip(contact, contact + 0.5 * (contact - virtual)), color=_FORCE, lw=0.8, zorder=4)
    axes.plot([], [], color=_FORCE, lw=1.6, label="deflection d, along the force")
    for place, name, shift in (
        (np.zeros(2), "P$_0$", -(radius_mm + 0.32) * onward),
        (contact, "P", at_p),
        (virtual, "V", (0.55, -0.55)),
    ):
        axes.annotate(
            name, place + np.array(shift), ha="center", va="center", fontsize=10, zorder=6
        )
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=7, columnspacing=1.2
    )


def _draw_slip(axes: Axes, contact, normal) -> None:
    """σ from P0 to P, set off to the side that the whisker came from."""
    if np.linalg.norm(contact) < 0.3:
        return
    aside = 0.95 * normal
    axes.annotate(
        "",
        contact + aside,
        aside,
        arrowprops={"arrowstyle": "<->", "color": _PATH, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )
    axes.annotate(
        "σ", 0.5 * contact + 1.25 * normal, ha="center", va="center", color=_PATH, fontsize=10
    )


def _draw_angles(axes: Axes, whisk: SeenWhisk, contact, virtual, radius_mm: float) -> None:
    """β between z and the bar at P0, φ between −y and the deflection at V, and the two legs of the deflection."""
    beta, phi = np.degrees(whisk.beta_rad.value), np.degrees(whisk.at.phi_rad.value)
    corner = np.array([contact[0], virtual[1]])
    side = 1.0 if contact[1] >= virtual[1] else -1.0
    axes.plot(*zip(virtual, corner, contact), color="0.35", lw=0.8, ls=":", zorder=2)
    axes.annotate(
        "d$_y$", 0.5 * (virtual + corner) - [0, 0.25 * side], ha="center", va="center", **_LEG
    )
    if (
        abs(contact[1] - virtual[1]) > 0.4
    ):  # its label stands beside what the circle leaves of the leg
        free = max(abs(contact[1] - virtual[1]) - radius_mm, 0.3)
        by_first = (
            np.linalg.norm(contact) < 2.0 * radius_mm + _LABEL_MM
        )  # P0's circle lies to the left of it
        at, ha = (0.12, "left") if by_first else (-0.12, "right")
        axes.annotate(
            "d$_z$", corner + np.array([at, 0.5 * side * free]), ha=ha, va="center", **_LEG
        )
    if abs(phi) > _LEAST_DEG:
        _draw_angle(
            axes,
            virtual,
            min(1.6, 0.9 * abs(virtual[0] - contact[0])),
            180.0,
            180.0 - phi,
            "φ",
            contact,
        )
    axes.plot([0, 0], [0, 2.0], color="0.35", lw=0.8, ls=":", zorder=2)
    if abs(beta) > _LEAST_DEG:
        _draw_angle(axes, np.zeros(2), 1.6, 90.0, 90.0 - beta, "β", contact)


def _draw_angle(
    axes: Axes, corner, radius_mm: float, first_deg: float, last_deg: float, name: str, contact
) -> None:
    """An arc from one direction to another; its name within, before it where P's circle is within, or past its end
    where there is no room."""
    low, high = sorted((first_deg, last_deg))
    axes.add_patch(
        Arc(
            corner,
            2 * radius_mm,
            2 * radius_mm,
            theta1=low,
            theta2=high,
            color="0.2",
            lw=0.9,
            zorder=4,
        )
    )
    if high - low > _ROOM_DEG:
        way, at = np.radians(0.5 * (first_deg + last_deg)), 0.72 * radius_mm
        if (
            np.linalg.norm(corner + at * np.array([np.cos(way), np.sin(way)]) - contact)
            < 2.0 * _LABEL_MM
        ):
            at = radius_mm + 0.5 * _LABEL_MM
    else:
        way, at = np.radians(last_deg + np.copysign(9.0, last_deg - first_deg)), radius_mm
    place = corner + at * np.array([np.cos(way), np.sin(way)])
    axes.annotate(name, place, ha="center", va="center", zorder=6)


def _values(whisk: SeenWhisk) -> str:
    at = whisk.at
    lines = [
        ("d$_x$", whisk.d_x_mm, 1.0, "mm", 3),
        ("σ", at.slip_mm, 1.0, "mm", 3),
        ("β", whisk.beta_rad, np.degrees(1.0), "°", 2),
        ("φ", at.phi_rad, np.degrees(1.0), "°", 2),
        ("α seen", at.alpha_rad, np.degrees(1.0), "°", 2),
    ]
    return "\n".join(
        f"{name} = {scale * of.value:.{digits}f} ± {scale * of.sigma:.{digits}f} {unit}"
        for name, of, scale, unit, digits in lines
    )


def contact_path(whisk: SeenWhisk) -> np.ndarray:
    """Return the contact (n, 2) y, z in the touching frames, in the contact frame, from P0, mm."""
    points = whisk.frames.point_mm.value[whisk.frames.touching]
    cos = np.cos(whisk.touch_rad.value)
    sin = np.sin(whisk.touch_rad.value)
    to_contact_frame = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return ((points - whisk.point_mm.value) @ to_contact_frame)[:, 1:]
