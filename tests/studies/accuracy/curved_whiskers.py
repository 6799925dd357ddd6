"""What a straight whisker in place of a curved one makes of gauges and estimates, by exact mechanics.

    python tests/studies/accuracy/curved_whiskers.py

Errors with exact moments, exact theta and the true friction angle: of (10), % of d_x; of the moment that calibrates the
gauges, % of its size. By slope on the vibrissa of `simulate --protocol vibrissa`, and over where it is touched and how
much it turns (docs/equations.md).
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.gauges.whisker_rods import CurvedRod, SeenContacts, StraightRod
from bench.rig.elastic_rod import RestShape, Rod
from estimator.beam import Beam
from estimator.builtin import with_friction
from estimator.whisk import EstimatorSettings, Whisk
from tests.scenes.curved_pushes import VIBRISSA, CurvedPush, Felt, feel, whisker_of

BETAS_DEG = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0)
PARTS = (0.4, 0.6, 0.8)  # of the length, where the contact is
TURNS_DEG = (0.0, 10.0, 20.0, 40.0)
SIDES = ((1, 0), (-1, 0), (0, 1), (0, -1))
STRAIGHT = {
    "cone": replace(VIBRISSA, rest=None),
    "cylinder": Rod("cylinder", 45.0, 0.2, 3.0),
}


def error_of_10(push: CurvedPush, felt: Felt) -> float:
    rod = push.rod
    beam = Beam.from_rigidity(rod.rigidity_Nmm2, rod.length_mm, rod.shape)
    exact = (0.001 * np.abs(felt.moments_Nmm).max()) ** 2 * np.eye(2)
    whisk = Whisk.without_samples(np.radians(push.theta_deg), felt.moments_Nmm, exact, beam)
    found = with_friction(whisk, EstimatorSettings(np.arctan(push.friction)))
    return 100 * (found.d_x_mm / felt.d_x_mm - 1)


def error_of_gauge(push: CurvedPush, felt: Felt, kind: type) -> float:
    """Without the friction along the rod, of which gauges know the half: with it some 0.5 % at 0 degrees."""
    theta = np.radians([push.theta_deg])
    along = np.array([felt.along_mm])
    contacts = SeenContacts(along, felt.across_mm[None], theta, felt.d_x_mm)
    off = kind(whisker_of(push.rod)).moments_Nmm(contacts, 0.0)[0] - felt.moments_Nmm
    return 100 * float(np.linalg.norm(off) / np.linalg.norm(felt.moments_Nmm))


def curved(rod: Rod, turn_deg: float, side: tuple[int, int]) -> Rod:
    """The rod with an even curvature to a side, turning so far up to its tip."""
    tip_mm = 0.5 * rod.length_mm * np.sin(np.radians(turn_deg))
    rest = RestShape(rod.length_mm, 0.0, float(side[0] * tip_mm), float(side[1] * tip_mm))
    return replace(rod, rest=rest)


def lines() -> Iterator[str]:
    yield "vibrissa of the protocol, d_x 20 mm, theta 3 deg, friction 0.3: slope, (10), gauges' moment"
    yield "of a straight and of the curved rod"
    for beta in BETAS_DEG:
        push = CurvedPush(beta_deg=beta)
        felt = feel(push)
        ten = error_of_10(push, felt)
        gauges = [error_of_gauge(push, felt, kind) for kind in (StraightRod, CurvedRod)]
        yield f"{beta:+4.0f} deg {ten:+6.2f} % {gauges[0]:5.2f} % {gauges[1]:5.2f} %"
    yield "largest of four sides and of 0, 40, -40 deg less that of the straight whisker, over the square of the"
    yield "turn at the contact [rad]: shape, part of the length, turn to the tip, (10), gauges' moment"
    for shape, rod in STRAIGHT.items():
        for part in PARTS:
            worst = [_worst(rod, part, turn) for turn in TURNS_DEG]
            for turn, now in zip(TURNS_DEG[1:], worst[1:]):
                turned = np.radians(part * turn)
                share = 0.01 * (now - worst[0]) / turned**2
                texts = " ".join(f"{one:5.2f} ({own:4.2f})" for one, own in zip(now, share))
                yield f"{shape:8s} {part:.1f} {turn:3.0f} deg: {texts} %"


def _worst(rod: Rod, part: float, turn_deg: float) -> np.ndarray:
    """Return the largest error (2,) of (10), %, and of the gauges' moment."""
    errors = []
    for side in SIDES:
        bent = curved(rod, turn_deg, side)
        for beta in (0.0, 40.0, -40.0):
            push = CurvedPush(rod=bent, beta_deg=beta, d_x_mm=part * rod.length_mm)
            felt = feel(push)
            errors.append([error_of_10(push, felt), error_of_gauge(push, felt, StraightRod)])
    return np.max(errors, axis=0)


if __name__ == "__main__":
    print(*lines(), sep="\n")
