"""The sensing plane of one whisk as in Fig. 4: y to the right, z up, in the contact frame from P0 on.

P0 is the contact at first touch, P that at the pushing angle, V where P would be without the object.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Arc, Circle, Polygon, Wedge

from bench.records.trial_result import SeenWhisk, TrialResult

_WIRE = "#2166ac"
_BAR = "#bdbdbd"
_FORCE = "#b2182b"
_CONE = "#fddbc7"
_PATH = "#1b7837"
_MARGIN_MM = 2.2
_BAR_HALF_MM = 60.0  # of the bar that is drawn, beyond any margin
_LEAST_SLIP_MM = 0.3  # that is drawn as an arrow
_LEAST_LEG_MM = 0.4  # of a leg of the deflection that is named
_LEAST_ANGLE_DEG = 3.0  # that is drawn
_ROOMY_ANGLE_DEG = 25.0  # that its name fits into
_LABEL_MM = 0.4  # of room that a name takes
_CENTRED = {"ha": "center", "va": "center"}
_LEG = {"fontsize": 9, "color": "0.25"}
_P0 = np.zeros(2)


@dataclass(frozen=True)
class PlanePoints:
    """Points, directions and radii of the sensing plane: (2,) y, z, mm.

    along: the bar. normal: from the bar to the side that the whisker came from. contact: P. virtual:
    V. radius_mm: of the whisker at the contact.
    """

    along: np.ndarray
    normal: np.ndarray
    contact: np.ndarray
    virtual: np.ndarray
    radius_mm: float
    bar_radius_mm: float

    @classmethod
    def of_whisk(cls, result: TrialResult, whisk: SeenWhisk) -> "PlanePoints":
        """Return the points of one whisk at its pushing angle."""
        beta = whisk.beta_rad.value
        along = np.array([np.sin(beta), np.cos(beta)])
        contact = whisk.at.slip_mm.value * along
        return cls(
            along=along,
            normal=np.array([-np.cos(beta), np.sin(beta)]),
            contact=contact,
            virtual=contact + np.array([whisk.at.d_y_mm.value, -whisk.at.d_z_mm.value]),
            radius_mm=result.seen.wire_radius_mm * result.whisker.thickness(whisk.d_x_mm.value),
            bar_radius_mm=result.seen.bar_radius_mm,
        )

    @property
    def slip_direction(self) -> np.ndarray:
        """Return the unit vector along the bar in which the contact slipped."""
        return self.along if self.contact @ self.along >= 0 else -self.along


def draw_sensing_plane(
    axes: Axes, result: TrialResult, whisk: SeenWhisk, friction: tuple[float, str]
) -> None:
    """Draw the sensing plane of one whisk. friction: half the cone's opening, rad, and its source."""
    points = PlanePoints.of_whisk(result, whisk)
    _draw_bar(axes, points)
    _draw_cone(axes, points, friction)
    _draw_whisker(axes, points, contact_path(whisk))
    _draw_force(axes, points)
    _draw_deflection(axes, points)
    _draw_angles(axes, whisk, points)
    _draw_slip(axes, points)
    _write_names(axes, points)
    _write_values(axes, whisk)
    _set_limits(axes, points)
    axes.set(xlabel="y  [mm]", ylabel="z  [mm]")
    theta_deg = np.degrees(whisk.at.theta_rad)
    title = f"{result.trial.name}, whisk {whisk.whisk}, θ = {theta_deg:.2f}°"
    axes.set_title(title, loc="left")
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=3, fontsize=7, columnspacing=1.2
    )


def _set_limits(axes: Axes, points: PlanePoints) -> None:
    """Let the axes hold P0, P and V with a margin, a millimetre of one as long as of the other."""
    corners = np.array([_P0, points.contact, points.virtual])
    left, bottom = corners.min(axis=0) - _MARGIN_MM
    right, top = corners.max(axis=0) + _MARGIN_MM
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")


def _draw_line(axes: Axes, points: Sequence[np.ndarray], **style: object) -> None:
    """Draw a line through points (2,)."""
    axes.plot(*np.transpose(points), **style)


def _draw_bar(axes: Axes, points: PlanePoints) -> None:
    """Draw the bar and its axis: its near side is one whisker radius from P0, on the whisker's centreline."""
    half = _BAR_HALF_MM * points.along
    near = -points.radius_mm * points.normal
    width = -2.0 * points.bar_radius_mm * points.normal
    outline = [near - half, near + half, near + half + width, near - half + width]
    axes.add_patch(Polygon(outline, fc=_BAR, ec="0.45", lw=0.8, zorder=0))
    middle = near + 0.5 * width
    _draw_line(
        axes, [middle - half, middle + half], color="0.45", lw=0.7, ls=(0, (8, 3, 1, 3)), zorder=1
    )


def _draw_cone(axes: Axes, points: PlanePoints, friction: tuple[float, str]) -> None:
    """Draw the directions that a force without slip may have, about the contact's normal."""
    alpha_rad, source = friction
    half_deg = np.degrees(alpha_rad)
    middle_deg = np.degrees(np.arctan2(points.normal[1], points.normal[0]))
    reach_mm = max(1.2, 0.75 * float(np.linalg.norm(points.virtual - points.contact)))
    cone = Wedge(
        points.contact,
        reach_mm,
        middle_deg - half_deg,
        middle_deg + half_deg,
        fc=_CONE,
        ec="none",
        alpha=0.9,
        zorder=1,
        label=f"friction cone, α = {half_deg:.1f}° {source}",
    )
    axes.add_patch(cone)
    end = points.contact + reach_mm * points.normal
    _draw_line(axes, [points.contact, end], color="0.4", lw=0.8, ls="--", zorder=2)


def _draw_whisker(axes: Axes, points: PlanePoints, path: np.ndarray) -> None:
    """Draw the whisker's section at P0, P and V, and the contact's path (n, 2)."""
    radius = points.radius_mm
    for place, fill in ((_P0, "white"), (points.contact, _WIRE)):
        axes.add_patch(Circle(place, radius, fc=fill, ec=_WIRE, lw=1.2, alpha=0.65, zorder=3))
    axes.add_patch(Circle(points.virtual, radius, fc="none", ec=_WIRE, lw=1.0, ls=":", zorder=3))
    axes.plot(*path.T, "-o", color=_PATH, ms=2.5, lw=1.0, zorder=5, label="contact, frame by frame")


def _draw_force(axes: Axes, points: PlanePoints) -> None:
    """Draw the deflection from V to P as an arrow, and a line onward in its direction."""
    arrow = {"arrowstyle": "-|>", "color": _FORCE, "lw": 1.6, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", points.contact, points.virtual, arrowprops=arrow, zorder=4)
    onward = points.contact + 0.5 * (points.contact - points.virtual)
    _draw_line(axes, [points.contact, onward], color=_FORCE, lw=0.8, zorder=4)
    axes.plot([], [], color=_FORCE, lw=1.6, label="deflection d, along the force")


def _write_names(axes: Axes, points: PlanePoints) -> None:
    """Write the names of P0, P and V next to them.

    P's stands beyond the slip and in the bar, where neither cone nor slip are.
    """
    slip = points.slip_direction
    into_bar = slip - 0.5 * points.normal
    into_bar /= np.linalg.norm(into_bar)
    names = {
        "P$_0$": -(points.radius_mm + 0.32) * slip,
        "P": points.contact + (points.radius_mm + 0.28) * into_bar,
        "V": points.virtual + np.array([0.55, -0.55]),
    }
    for name, place in names.items():
        axes.annotate(name, place, fontsize=10, zorder=6, **_CENTRED)


def _draw_slip(axes: Axes, points: PlanePoints) -> None:
    """Draw σ from P0 to P as an arrow next to them, on the side that the whisker came from."""
    if np.linalg.norm(points.contact) < _LEAST_SLIP_MM:
        return
    offset = 0.95 * points.normal
    arrow = {"arrowstyle": "<->", "color": _PATH, "lw": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", points.contact + offset, offset, arrowprops=arrow)
    name_place = 0.5 * points.contact + 1.25 * points.normal
    axes.annotate("σ", name_place, color=_PATH, fontsize=10, **_CENTRED)


def _draw_deflection(axes: Axes, points: PlanePoints) -> None:
    """Draw the two legs of the deflection from V to P, d_y and d_z."""
    contact = points.contact
    virtual = points.virtual
    corner = np.array([contact[0], virtual[1]])
    side = 1.0 if contact[1] >= virtual[1] else -1.0
    _draw_line(axes, [virtual, corner, contact], color="0.35", lw=0.8, ls=":", zorder=2)
    below = 0.5 * (virtual + corner) - [0, 0.25 * side]
    axes.annotate("d$_y$", below, **_CENTRED, **_LEG)
    leg_mm = abs(contact[1] - virtual[1])
    if leg_mm <= _LEAST_LEG_MM:
        return
    # The name of d_z stands beside what V's circle leaves of the leg: at its right where P0's circle
    # is at its left.
    uncovered_mm = max(leg_mm - points.radius_mm, 0.3)
    is_near_p0 = np.linalg.norm(contact) < 2.0 * points.radius_mm + _LABEL_MM
    offset_mm = 0.12 if is_near_p0 else -0.12
    alignment = "left" if is_near_p0 else "right"
    place = corner + np.array([offset_mm, 0.5 * side * uncovered_mm])
    axes.annotate("d$_z$", place, ha=alignment, va="center", **_LEG)


def _draw_angles(axes: Axes, whisk: SeenWhisk, points: PlanePoints) -> None:
    """Draw φ between −y and the deflection at V, and β between z and the bar at P0."""
    beta_deg = np.degrees(whisk.beta_rad.value)
    phi_deg = np.degrees(whisk.at.phi_rad.value)
    if abs(phi_deg) > _LEAST_ANGLE_DEG:
        radius_mm = min(1.6, 0.9 * abs(points.virtual[0] - points.contact[0]))
        ends_deg = (180.0, 180.0 - phi_deg)
        _draw_angle(axes, "φ", points.virtual, radius_mm, ends_deg, points.contact)
    axes.plot([0, 0], [0, 2.0], color="0.35", lw=0.8, ls=":", zorder=2)
    if abs(beta_deg) > _LEAST_ANGLE_DEG:
        _draw_angle(axes, "β", _P0, 1.6, (90.0, 90.0 - beta_deg), points.contact)


def _draw_angle(
    axes: Axes,
    name: str,
    corner: np.ndarray,
    radius_mm: float,
    ends_deg: tuple[float, float],
    contact: np.ndarray,
) -> None:
    """Draw an arc from one direction to another, and its name.

    The name stands within the arc, outside it where P's circle is within, and past its end where
    there is no room.
    """
    low_deg, high_deg = sorted(ends_deg)
    size = 2 * radius_mm
    axes.add_patch(
        Arc(corner, size, size, theta1=low_deg, theta2=high_deg, color="0.2", lw=0.9, zorder=4)
    )
    first_deg, last_deg = ends_deg
    if high_deg - low_deg > _ROOMY_ANGLE_DEG:
        middle_deg = 0.5 * (first_deg + last_deg)
        place = corner + 0.72 * radius_mm * _unit_vector(middle_deg)
        if np.linalg.norm(place - contact) < 2.0 * _LABEL_MM:
            place = corner + (radius_mm + 0.5 * _LABEL_MM) * _unit_vector(middle_deg)
    else:
        past_deg = last_deg + np.copysign(9.0, last_deg - first_deg)
        place = corner + radius_mm * _unit_vector(past_deg)
    axes.annotate(name, place, zorder=6, **_CENTRED)


def _unit_vector(angle_deg: float) -> np.ndarray:
    """Return the unit vector (2,) of a direction."""
    angle_rad = np.radians(angle_deg)
    return np.array([np.cos(angle_rad), np.sin(angle_rad)])


def _write_values(axes: Axes, whisk: SeenWhisk) -> None:
    """Write the whisk's values with one sigma into a corner, a line each."""
    at = whisk.at
    quantities = [
        ("d$_x$", whisk.d_x_mm, "mm", 3),
        ("σ", at.slip_mm, "mm", 3),
        ("β", whisk.beta_rad.in_degrees(), "°", 2),
        ("φ", at.phi_rad.in_degrees(), "°", 2),
        ("α seen", at.alpha_rad.in_degrees(), "°", 2),
    ]
    lines = []
    for name, of, unit, digits in quantities:
        lines.append(f"{name} = {of.value:.{digits}f} ± {of.sigma:.{digits}f} {unit}")
    axes.text(
        0.98,
        0.02,
        "\n".join(lines),
        transform=axes.transAxes,
        ha="right",
        va="bottom",
        fontsize=8,
        linespacing=1.5,
        bbox={"fc": "white", "ec": "none", "alpha": 0.8},
    )


def contact_path(whisk: SeenWhisk) -> np.ndarray:
    """Return the contact (n, 2) y, z in the touching frames, in the contact frame, from P0, mm."""
    points = whisk.frames.point_mm.value[whisk.frames.touching]
    cos = np.cos(whisk.touch_rad.value)
    sin = np.sin(whisk.touch_rad.value)
    to_contact_frame = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return ((points - whisk.point_mm.value) @ to_contact_frame)[:, 1:]
