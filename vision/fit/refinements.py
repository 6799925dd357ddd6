"""The truth of a whisk without one refinement of the model: one linear step from the fit that has
all.

A refinement is left out in one of three ways, each of which the fit follows by its own normal
equations, JᵀWJ:

- a parameter, or a function of them, is held at what the plainer model has there (a least-squares
  fit with an equality constraint; Björck, Numerical Methods for Least Squares Problems, SIAM 1996,
  5.1);
- lines or centrelines are predicted elsewhere, which changes residuals, and slip or touch directly;
- the cameras are those of a calibration without a lens term, by its own covariance.

Where a plainer model is far off, the step is no more than the size of its error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.blocks import columns_of
from vision.fit.converged_fit import ConvergedFit
from vision.fit.quantities import measure
from vision.fit.reshaped import reshape
from vision.fit.solve import residuals
from vision.geometry.camera import N_PARAMETERS, PARAMETERS
from vision.geometry.centreline import (
    REST_POWERS,
    Curves,
    bend_growth,
    rotation_z,
    simpson,
    tangent_growth,
)
from vision.geometry.contact import closest_arc
from vision.geometry.rods import Wire
from vision.wire.one_sided import WireAppearance

NAN = float("nan")
LENS_TERMS = {"lens k1 k2": ("k1", "k2"), "lens k3": ("k3",), "lens p1 p2": ("p1", "p2")}
ALONG = "friction along the whisker"
# [indices] Of the rest shape, a layout, no threshold: curvature and its change, in y and in z.
_CURVED = np.array([2, 3, REST_POWERS + 2, REST_POWERS + 3])


@dataclass(frozen=True)
class LeftOut:
    """Differences of d_x (mm), touch (rad) and slip at the largest pushing angle (mm) without a
    refinement from those with it; NaN where that is not known. why: of a zero or a NaN."""

    d_x_mm: float = 0.0
    touch_rad: float = 0.0
    slip_mm: float = 0.0
    why: str = ""


def _after(fit: ConvergedFit, step: np.ndarray, slip_mm: float = 0.0) -> LeftOut:
    """Return the effect of a step (size,) of the parameters, with slip_mm added to the slip."""
    by = fit.by_parameter
    return LeftOut(
        d_x_mm=float(by.whisk["d_x"] @ step),
        touch_rad=float(by.whisk["touch"] @ step),
        slip_mm=float(by.frame["slip"][fit.last_frame] @ step) + slip_mm,
    )


def _held(fit: ConvergedFit, rows: np.ndarray, values: np.ndarray) -> LeftOut:
    """Return the effect of functions of the parameters being held at values (k,) from where they are.

    rows (k, size): derivatives of these functions.
    """
    gain = fit.inverse_normal @ rows.T
    return _after(fit, gain @ np.linalg.lstsq(rows @ gain, values, rcond=None)[0])


def _held_parameters(fit: ConvergedFit, columns: np.ndarray, changes: np.ndarray) -> LeftOut:
    """Return the effect of the parameters of these columns (k,) being held at changes (k,) from
    where they are.
    """
    return _held(fit, np.eye(fit.problem.size)[columns], changes)


def _followed(fit: ConvergedFit, residual: np.ndarray, slip_mm: float = 0.0) -> LeftOut:
    """Return the effect of a change (n,) of the first n residuals, with slip_mm added to the slip."""
    change = fit.linear.weigh(residual[:, None])[:, 0]
    step = -fit.inverse_normal @ (fit.weighted.jacobian.T @ change)
    return _after(fit, step, slip_mm)


def left_out(fit: ConvergedFit, light: Mapping[str, WireAppearance]) -> dict[str, LeftOut]:
    """Return the effect of each refinement of the truth by name. light: how each camera sees the
    wire.
    """
    vector = fit.state.vector
    blocks = fit.problem.blocks
    reach = columns_of(blocks.reach)
    friction = columns_of(blocks.friction)
    curved = columns_of(blocks.rest_shape)[_CURVED]
    psi = -np.atleast_1d(fit.measured.whisk["psi"])
    found = {
        "large bending": _large_bending(fit),
        "bar radius": _held_parameters(fit, reach, -fit.problem.rods.bar.radius_mm - vector[reach]),
        "psi": _held(fit, fit.by_parameter.whisk["psi"][None], psi),
        ALONG: _held_parameters(fit, friction, -vector[friction]),
        "taper": _taper(fit),
        "sag and set": _held_parameters(fit, curved, -vector[curved]),
    }
    for name, terms in LENS_TERMS.items():
        found[name] = _lens(fit, terms)
    found["one-sided light"] = _one_sided(fit, light)
    return found


def _large_bending(fit: ConvergedFit) -> LeftOut:
    """Return the effect of a beam of small angles, its friction along the whisker unchanged."""
    contacts_mm = _contacts_of_small_angles(fit)
    rows, slip = reshape(fit, _moved_by_small_angles(fit, contacts_mm))
    return _followed(fit, rows[:, 0], float(slip[0]))


def _moved_by_small_angles(fit: ConvergedFit, contacts_mm: np.ndarray) -> Curves:
    """Return how the centrelines move to those of a beam of small angles that touches at arcs (f,),
    mm: points and tangents (1, f, m, 3).

    It takes slopes in place of sines, and distance in place of arc.
    """
    curves = fit.curves
    to_hub = rotation_z(fit.problem.motor_rad)
    along = curves.tangents @ to_hub
    turn = np.linalg.norm(fit.bend_rad, axis=-1)[:, None]
    friction = fit.state.vector[fit.problem.blocks.friction.start]
    # Shares (f, m) of the final tangent angle at each node, by large bending and by small angles.
    large = bend_growth(turn, friction, curves.arc_mm, fit.state.arcs_mm[:, None], fit.wire)
    small = tangent_growth(curves.arc_mm, contacts_mm[:, None], fit.wire)
    change = small - np.sinc(turn * large / np.pi) * large  # of the slope, over the bend
    across = change[..., None] * fit.bend_rad[:, None]
    in_hub = np.concatenate([1.0 - along[..., :1], across], axis=-1)
    tangents = in_hub[None] @ np.swapaxes(to_hub, -1, -2)
    return Curves(curves.arc_mm, simpson() @ tangents * curves.arc_mm[1], tangents)


def _contacts_of_small_angles(fit: ConvergedFit) -> np.ndarray:
    """Return where (f,) along itself a beam of small angles touches: distances are shorter than
    arcs.
    """
    curves = fit.curves
    arcs_mm = fit.state.arcs_mm
    moves = _moved_by_small_angles(fit, arcs_mm)
    points = curves.points_mm + moves.points_mm[0]
    tangents = curves.tangents + moves.tangents[0]
    return closest_arc(Curves(curves.arc_mm, points, tangents), fit.axes, fit.wire, arcs_mm)


def _taper(fit: ConvergedFit) -> LeftOut:
    """Return the effect of the whisker as a cylinder of its base's diameter."""
    problem = fit.problem
    state = fit.state
    if problem.wire.is_uniform:
        return LeftOut(why="the whisker does not taper")
    cylinder = replace(problem, rods=replace(problem.rods, wire=_cylinder(problem.wire)))
    own = columns_of(problem.blocks.taper)  # (1,), or (0,) where the taper is exact
    plain = replace(state, vector=np.delete(state.vector, own))
    with_taper = fit.linear.residual
    priors = problem.prior_rows.start + own
    without = np.insert(residuals(cylinder, plain), priors, with_taper[priors])
    by_lines_moved = _followed(fit, without - with_taper)
    there = measure(cylinder, plain.vector, plain.arcs_mm)
    here = fit.measured
    slip = there.frame["slip"] - here.frame["slip"]
    return LeftOut(
        d_x_mm=by_lines_moved.d_x_mm + float(there.whisk["d_x"] - here.whisk["d_x"]),
        touch_rad=by_lines_moved.touch_rad + float(there.whisk["touch"] - here.whisk["touch"]),
        slip_mm=by_lines_moved.slip_mm + float(slip[fit.last_frame]),
    )


def _cylinder(wire: Wire) -> Wire:
    """Return a cylinder of a wire's length and its base's diameter."""
    return Wire(
        "cylinder",
        wire.length_mm,
        wire.diameter_mm,
        wire.length_sigma_mm,
        wire.diameter_sigma_mm,
        rest_mm=wire.rest_mm,
    )


def _lens(fit: ConvergedFit, terms: Sequence[str]) -> LeftOut:
    """Return the effect of cameras that are calibrated without these terms."""
    cameras = fit.problem.cameras
    own = [PARAMETERS.index(term) for term in terms]
    columns = np.concatenate([N_PARAMETERS * k + np.array(own) for k in range(len(cameras))])
    values = np.concatenate([camera.lens[own] for camera in cameras])
    if not values.any():
        return LeftOut(why="the lenses have none")
    free = np.diag(cameras.covariance)[columns] > 0
    if np.any(values[~free]):
        why = "the cameras are taken as exact, and do not tell what else would answer"
        return LeftOut(NAN, NAN, NAN, why)
    rows = columns[free]
    gain = cameras.covariance[:, rows]
    moved = -gain @ np.linalg.lstsq(gain[rows], values[free], rcond=None)[0]
    return _after(fit, fit.parameters_by_camera @ moved)


def _one_sided(fit: ConvergedFit, light: Mapping[str, WireAppearance]) -> LeftOut:
    """Return the effect of the wire's axis in the middle of what is seen, in cameras that do not
    see both its edges.
    """
    off_px = {}
    for camera, name in enumerate(fit.problem.cameras.names):
        if name in light and light[name].width.is_one_sided:
            off_px[camera] = light[name].width.off_px
    if not off_px:
        return LeftOut(why="every camera sees both edges of the wire")
    moved = []
    for seen in fit.problem.seen:
        by_light_px = off_px.get(seen.camera, 0.0) if seen.on_wire else 0.0
        moved.append(-by_light_px / seen.points.sigma_px)
    return _followed(fit, np.concatenate(moved))
