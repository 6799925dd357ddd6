"""Wires that do not bend as a beam with a point load, as line points of a scene whose contacts stay what they are.

The contact points of exact mechanics are kept, so that touch, d_x and slip keep their truth; between base, contact and
tip the wire takes the shape of another rod that is pushed as far: softer in part, with a joint, in a clamp that gives.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tests.ladder.scenes import Scene
from vision.fit import Observed

_GRID = 400
# Softness (n,) along the arc (n,), mm, of a rod of this length that is 1 at the base.
Softness = Callable[[np.ndarray, float], np.ndarray]


def softer_outside(times: float) -> Softness:
    """Softer by this factor in its outer half, of the length."""
    return lambda arc, length: np.where(arc > 0.5 * length, times, 1.0)


def joint(at_mm: float, as_mm: float) -> Softness:
    """A joint that bends as much as so many mm of the rod."""
    return lambda arc, length: 1.0 + as_mm * np.exp(-0.5 * (arc - at_mm) ** 2) / np.sqrt(2 * np.pi)


def loose_clamp(as_mm: float) -> Softness:
    """A clamp that gives as so many mm of the rod would."""
    return lambda arc, length: 1.0 + 2 * as_mm * np.exp(-0.5 * arc**2) / np.sqrt(2 * np.pi)


def deflection(softness: Softness, arc_mm, contact_mm: float, length_mm: float) -> np.ndarray:
    """Deflection (n,) at arc lengths by a force at the contact, 1 there; small angles."""
    s = np.linspace(0.0, length_mm, _GRID + 1)
    h = s[1] - s[0]
    curvature = softness(s, length_mm) * np.maximum(contact_mm - s, 0.0)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * h * (curvature[1:] + curvature[:-1]))])
    y = np.concatenate([[0.0], np.cumsum(0.5 * h * (angle[1:] + angle[:-1]))])
    return np.interp(arc_mm, s, y) / np.interp(contact_mm, s, y)


def broken(scene: Scene, seen: Sequence[Observed], softness: Softness, along=(1.0, 1.0)) -> list[Observed]:
    """The line points where such a rod would be seen. along: share of its departure taken in y and in z (hub)."""
    return [one if one.frame < 0 or scene.states[one.frame] is None else _moved(scene, one, softness, along)
            for one in seen]


def _moved(scene: Scene, one: Observed, softness: Softness, along) -> Observed:
    state, motor, whisk = scene.states[one.frame], scene.motor_rad[one.frame], scene.recording.whisks[0]
    camera, place, length = scene.cameras.cameras[one.camera], one.points.place, scene.wire.length_mm
    points, contact = (whisk.centreline_mm(motor, state, arc) for arc in (place, np.array([state.arc_mm])))
    pushed = contact[0] - whisk.centreline_mm(motor, None, np.array([state.arc_mm]))[0]
    c, s = np.cos(motor), np.sin(motor)
    hub = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    pushed = hub.T @ (np.array([0.0, *along]) * (hub @ pushed))
    uniform = lambda arc, length: np.ones_like(arc)  # noqa: E731
    share = deflection(softness, place, state.arc_mm, length) - deflection(uniform, place, state.arc_mm, length)
    px = one.points.px + camera.project(points + share[:, None] * pushed) - camera.project(points)
    return replace(one, points=replace(one.points, px=px))
