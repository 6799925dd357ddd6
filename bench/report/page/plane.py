"""A whisk's card in lines: the sensing plane, slip and deflection over the stroke, moments seen beside felt."""

import math

import numpy as np
from markupsafe import Markup

from bench.gauges.gauge_readings import reference_from_pictures
from bench.records.trial_result import SeenWhisk
from bench.report.page.svg import Mark, Panel, limits
from bench.report.page.words import Row
from bench.session.whisker import Whisker

_WIDTH, _HEIGHT = 400, 300
_MARGIN_MM = 1.6
_FAR_MM = 60.0


def sensing_plane(row: Row) -> Markup:
    """y to the right, z up, mm, in the contact frame: bar, path of the contact from P0 to P, virtual point V. Empty
    where the whisk was not seen to be pushed."""
    seen = row.seen
    if not seen.has_truth or seen.at is None or not math.isfinite(seen.at.d_y_mm.value):
        return Markup("")
    beta, at = seen.beta_rad.value, seen.at
    along, normal = np.array([np.sin(beta), np.cos(beta)]), np.array([-np.cos(beta), np.sin(beta)])
    contact = at.slip_mm.value * along
    virtual = contact + np.array([at.d_y_mm.value, -at.d_z_mm.value])
    panel = _equal_panel(np.array([np.zeros(2), contact, virtual]))
    path = contact_path(seen)
    drawn = [
        _bar(panel, row, along, normal),
        panel.line(*path.T, "path"),
        panel.line(*np.array([virtual, contact]).T, "wire"),
        *(
            _letter(panel, place, name)
            for place, name in ((np.zeros(2), "P0"), (contact, "P"), (virtual, "V"))
        ),
    ]
    alt = f"Sensing plane of {row.name}: the contact slips {at.slip_mm.value:.2f} mm from P0 to P along the bar"
    return panel.drawing(
        drawn,
        ("y  [mm]", "z  [mm]"),
        f"sensing plane at θ = {math.degrees(at.theta_rad):.2f}°",
        alt,
    )


def _equal_panel(points: np.ndarray) -> Panel:
    """Limits that hold the points, a millimetre as long in y as in z."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = np.ptp(points, axis=0) + 2 * _MARGIN_MM
    empty = Panel((0.0, 1.0), (0.0, 1.0), _WIDTH, _HEIGHT)
    (left, low), (right, high) = empty.at(0.0, 0.0), empty.at(1.0, 1.0)
    across, down = right - left, low - high
    per_px = max(size[0] / across, size[1] / down)
    half = 0.5 * per_px * np.array([across, down])
    return Panel(*(tuple(zip(middle - half, middle + half))), _WIDTH, _HEIGHT)


def _bar(panel: Panel, row: Row, along, normal) -> Markup:
    """The bar's outline within the panel: its near side one whisker radius from P0, which lies on the centreline."""
    near = -row.result.seen.wire_radius_mm * row.result.whisker.left(row.seen.d_x_mm.value) * normal
    width = -2.0 * row.result.seen.bar_radius_mm * normal
    far = _FAR_MM * along
    corners = [near - far, near + far, near + far + width, near - far + width]
    d = "L".join(f"{x:.1f},{y:.1f}" for x, y in (panel.at(*corner) for corner in corners))
    (left, top), (right, bottom) = (
        panel.at(panel.x[0], panel.y[1]),
        panel.at(panel.x[1], panel.y[0]),
    )
    box = f'<clipPath id="p{row.key}"><path d="M{left:.1f},{top:.1f}H{right:.1f}V{bottom:.1f}H{left:.1f}Z"/></clipPath>'
    return Markup(f'{box}<path class="rod" clip-path="url(#p{row.key})" d="M{d}Z"/>')


def _letter(panel: Panel, place, name: str) -> Markup:
    x, y = panel.at(*place)
    said = name.replace("P0", "P₀")
    spot = f'<circle class="spot" cx="{x:.1f}" cy="{y:.1f}" r="3.5"/>'
    return Markup(f'{spot}<text class="name" x="{x + 7:.1f}" y="{y - 6:.1f}">{said}</text>')


def slip_over_stroke(row: Row) -> Markup:
    """Slip and its sigma in each touching frame over the pushing angle."""
    frames = row.seen.frames
    if frames is None or not np.any(frames.touching):
        return Markup("")
    on = np.asarray(frames.touching, dtype=bool)
    theta, slip, sigma = (
        np.degrees(frames.theta_rad.value[on]),
        frames.slip_mm.value[on],
        frames.slip_mm.sigma[on],
    )
    return _over_theta(row, "slip σ", "mm", theta, ((slip, sigma, "e1"),))


def force_angle_over_stroke(row: Row) -> Markup:
    """Direction of the deflection in each touching frame over the pushing angle."""
    frames = row.seen.frames
    if frames is None or not np.any(frames.touching):
        return Markup("")
    good = np.asarray(frames.touching, dtype=bool) & (frames.theta_rad.value > np.radians(0.3))
    phi, sigma = np.degrees(frames.phi_rad.value[good]), np.degrees(frames.phi_rad.sigma[good])
    return _over_theta(
        row, "force angle φ", "°", np.degrees(frames.theta_rad.value[good]), ((phi, sigma, "e1"),)
    )


def moments_over_stroke(row: Row, whisker: Whisker) -> Markup:
    """Moments at the base: those of the seen shape over the stroke as lines, the felt ones at θ as points."""
    seen, felt = row.seen, row.felt
    reference = reference_from_pictures(seen, whisker) if seen.deflection is not None else None
    if reference is None:
        return Markup("")
    theta = np.degrees(reference.theta_rad)
    sigma = np.sqrt(np.diag(reference.covariance)).reshape(-1, 2)
    shown = [(reference.moments[:, k], sigma[:, k], f"e{k}") for k in range(2)]
    at = [(v.value, v.sigma, f"e{k}") for k, v in enumerate((felt.m_y_Nmm, felt.m_z_Nmm))]
    return _over_theta(row, "moment", "N·mm", theta, shown, at=(row.result.theta_deg, at))


def _over_theta(row: Row, name: str, unit: str, theta, series, at=None) -> Markup:
    """Values with a band of one sigma over θ, deg; at: (θ, [(value, sigma, class)]) of what is known there alone."""
    extra = at[1] if at else []
    known = [
        v
        for values, sigmas, _ in series
        for v in np.concatenate([values - sigmas, values + sigmas])
    ]
    panel = Panel(
        limits([0.0, *theta]),
        limits([*known, *(v for v, _, _ in extra)], (0.0, 0.0)),
        _WIDTH,
        _HEIGHT,
    )
    drawn = []
    for values, sigmas, kind in series:
        good = np.isfinite(values) & np.isfinite(sigmas)
        x, v, s = theta[good], values[good], sigmas[good]
        drawn += [panel.band(x, v - s, v + s, kind), panel.line(x, v, kind)] if good.any() else []
    drawn += [panel.mark(_felt(row, at[0], v, s, kind, name)) for v, s, kind in extra]
    alt = f"{name} of {row.name} over the pushing angle"
    return panel.drawing(drawn, ("pushing angle θ  [°]", f"{name}  [{unit}]"), name, alt)


def _felt(row: Row, x: float, value: float, sigma: float, kind: str, name: str) -> Mark:
    title = f"{name} felt = {value:.4g} ± {sigma:.2g} at θ = {x:.2f}°"
    return Mark(x, value, sigma, kind, 3, row.key, row.trial, row.seen.whisk, title)


def contact_path(whisk: SeenWhisk) -> np.ndarray:
    """Contact (n, 2) y, z of the touching frames in the contact frame, from P0."""
    points = whisk.frames.point_mm.value[whisk.frames.touching]
    c, s = np.cos(whisk.touch_rad.value), np.sin(whisk.touch_rad.value)
    turned = (points - whisk.point_mm.value) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return turned[:, 1:]
