"""What the truth of a whisk would be without one refinement of the model: one linear step from the fit that has all.

A refinement is left out in one of three ways, each of which the fit follows by its own normal equations, JᵀWJ:

- a parameter, or a function of them, is held at what the plainer model has there (a least-squares fit with an equality
  constraint; Björck, Numerical Methods for Least Squares Problems, SIAM 1996, 5.1);
- lines or centrelines are predicted elsewhere, which changes residuals, and slip or touch directly, too;
- the cameras are those of a calibration without a lens term, to which the others respond by its own covariance.

Where a plainer model is far off, the step is no more than the size of its error.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vision.fit.covariance import by_lens
from vision.fit.problem import Problem, State, bar_axes, bends, curves_of
from vision.fit.quantities import Jacobians, Measured, measure
from vision.fit.reshaped import by_contacts, by_lines
from vision.fit.solve import LAST_SCALE, linear_at, linearise, robust_weights
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
# [columns] A layout, no threshold: curvature of the rest shape and its change, across and along
# the axis.
_CURVED = [4 + across + power for across in (0, REST_POWERS) for power in (2, 3)]


@dataclass(frozen=True)
class LeftOut:
    """By how much d_x (mm), touch (rad) and slip at the largest pushing angle (mm) differ without a refinement from
    with it; NaN where that is not known. why: of a zero or a NaN."""

    d_x_mm: float = 0.0
    touch_rad: float = 0.0
    slip_mm: float = 0.0
    why: str = ""


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit that is done. inverse_normal (size, size): see `Uncertainty`."""

    problem: Problem
    state: State
    inverse_normal: np.ndarray
    measured: Measured
    by: Jacobians

    @property
    def last(self) -> int:
        """The touching frame of the largest pushing angle."""
        return int(np.flatnonzero(self.problem.touching)[-1])

    def after(self, step: np.ndarray, slip_mm: float = 0.0) -> LeftOut:
        """What a step (size,) of the parameters moves, and slip beside it."""
        of_slip = float(self.by.frame["slip"][self.last] @ step) + slip_mm
        return LeftOut(
            float(self.by.whisk["d_x"] @ step), float(self.by.whisk["touch"] @ step), of_slip
        )

    def held(self, rows: np.ndarray, values: np.ndarray) -> LeftOut:
        """With functions of the parameters, whose derivatives are rows (k, size), changed by values (k,)."""
        told = self.inverse_normal @ rows.T
        return self.after(told @ np.linalg.lstsq(rows @ told, values, rcond=None)[0])

    def step(self, residual: np.ndarray) -> np.ndarray:
        """The step (size,) by which the parameters follow a change (n,) of the first n residuals."""
        linear = linear_at(self.problem, self.state)
        weights = robust_weights(linear, LAST_SCALE)[: len(residual)]
        return -self.inverse_normal @ (linear.jacobian[: len(residual)].T @ (weights * residual))


def left_out(fit: Fit, light: Mapping[str, WireAppearance]) -> dict[str, LeftOut]:
    """Each refinement of the truth by name. light: how each camera sees the wire."""
    eye, vector = np.eye(fit.problem.size), fit.state.vector
    return {
        "large bending": _large_bending(fit),
        "bar radius": fit.held(
            eye[[fit.problem.blocks.reach.start]],
            np.array([-fit.problem.rods.bar.radius_mm - vector[fit.problem.blocks.reach.start]]),
        ),
        "psi": fit.held(fit.by.whisk["psi"][None], -np.atleast_1d(fit.measured.whisk["psi"])),
        ALONG: fit.held(
            eye[[fit.problem.blocks.friction.start]], -vector[[fit.problem.blocks.friction.start]]
        ),
        "taper": _taper(fit),
        "sag and set": fit.held(eye[_CURVED], -vector[_CURVED]),
        **{name: _lens(fit, terms) for name, terms in LENS_TERMS.items()},
        "one-sided light": _one_sided(fit, light),
    }


def _large_bending(fit: Fit) -> LeftOut:
    """As a beam of small angles, with no more pull than it has."""
    problem, state = fit.problem, fit.state
    curves, arcs = curves_of(problem, state.vector, state.arcs_mm)
    plain = _small_angles(
        problem, state, curves, _contacts_of_small_angles(problem, state, curves, arcs)
    )
    moves = _in_rig(problem, curves, plain)
    contacts, slip = by_contacts(problem, state, curves, moves, fit.last)
    rows = np.concatenate([by_lines(problem, curves, moves), contacts])
    return fit.after(fit.step(rows[:, 0]), float(slip[0]))


def _in_rig(problem: Problem, curves: Curves, of_tangents: np.ndarray) -> Curves:
    """The move of the centrelines by that of their tangents in the hub's frame (f, m, 3)."""
    turned = np.swapaxes(rotation_z(problem.motor_rad), -1, -2)
    tangents = of_tangents[None] @ turned
    return Curves(curves.arc_mm, simpson() @ tangents * curves.arc_mm[1], tangents)


def _small_angles(
    problem: Problem, state: State, curves: Curves, arcs_mm: np.ndarray
) -> np.ndarray:
    """What the tangents (f, m, 3) of a beam of small angles that touches at arcs_mm (f,) differ by: slopes for sines,
    and distance for arc."""
    along = curves.tangents @ rotation_z(problem.motor_rad)
    turn = np.linalg.norm(bends(problem, state.vector), axis=-1)[:, None]
    here = bend_growth(
        turn,
        state.vector[problem.blocks.friction.start],
        curves.arc_mm,
        state.arcs_mm[:, None],
        problem.wire,
    )
    there = tangent_growth(curves.arc_mm, arcs_mm[:, None], problem.wire)
    slope = there - np.sinc(turn * here / np.pi) * here
    aside = slope[..., None] * bends(problem, state.vector)[:, None]
    return np.concatenate([1.0 - along[..., :1], aside], axis=-1)


def _contacts_of_small_angles(
    problem: Problem, state: State, curves: Curves, arcs_mm: np.ndarray
) -> np.ndarray:
    """Where (f,) along itself such a beam touches: distances along it are shorter than arcs."""
    moves = _in_rig(problem, curves, _small_angles(problem, state, curves, arcs_mm))
    moved = Curves(
        curves.arc_mm, curves.points_mm + moves.points_mm[0], curves.tangents + moves.tangents[0]
    )
    axis = bar_axes(problem, state.vector)
    point, direction = (
        np.broadcast_to(part, (len(arcs_mm), 3)) for part in (axis.point_mm, axis.direction)
    )
    each = replace(axis, point_mm=point, direction=direction)
    return closest_arc(moved, each, arcs_mm)


def _taper(fit: Fit) -> LeftOut:
    """The whisker as a cylinder of its base's diameter."""
    problem, wire = fit.problem, fit.problem.wire
    if wire.taper_per_mm == 0.0:
        return LeftOut(why="the whisker does not taper")
    base = Wire(
        "cylinder", wire.length_mm, wire.diameter_mm, wire.length_sigma_mm, wire.diameter_sigma_mm
    )
    other, with_taper = (
        replace(problem, rods=replace(problem.rods, wire=base)),
        linear_at(problem, fit.state),
    )
    plain = linearise(other, fit.state, with_taper.jacobian)[0]
    found = fit.after(fit.step(plain.residual - with_taper.residual))
    there = measure(other, fit.state.vector, fit.state.arcs_mm)
    d_x, touch = (float(there.whisk[name] - fit.measured.whisk[name]) for name in ("d_x", "touch"))
    slip = float((there.frame["slip"] - fit.measured.frame["slip"])[fit.last])
    return LeftOut(found.d_x_mm + d_x, found.touch_rad + touch, found.slip_mm + slip)


def _lens(fit: Fit, terms: Sequence[str]) -> LeftOut:
    """The cameras calibrated without these terms."""
    cameras = fit.problem.cameras
    own = [PARAMETERS.index(term) for term in terms]
    all_of_them = np.concatenate([N_PARAMETERS * k + np.array(own) for k in range(len(cameras))])
    values = np.concatenate([camera.lens[own] for camera in cameras])
    if not values.any():
        return LeftOut(why="the lenses have none")
    free = np.diag(cameras.covariance)[all_of_them] > 0
    if np.any(values[~free]):
        return LeftOut(
            NAN,
            NAN,
            NAN,
            "the cameras are taken as exact, and do not tell what else would answer",
        )
    rows = all_of_them[free]
    told = cameras.covariance[:, rows]
    moved = -told @ np.linalg.lstsq(told[rows], values[free], rcond=None)[0]
    return fit.after(by_lens(fit.problem, fit.state, fit.inverse_normal) @ moved)


def _one_sided(fit: Fit, light: Mapping[str, WireAppearance]) -> LeftOut:
    """The wire's axis in the middle of what is seen, in cameras that do not see both its edges."""
    names = fit.problem.cameras.names
    off_px = {
        k: light[name].width.off_px
        for k, name in enumerate(names)
        if name in light and light[name].width.one_sided
    }
    if not off_px:
        return LeftOut(why="every camera sees both edges of the wire")
    moved = [
        -off_px.get(seen.camera, 0.0) * (seen.frame >= 0) / seen.points.sigma_px
        for seen in fit.problem.seen
    ]
    return fit.after(fit.step(np.concatenate(moved)))
