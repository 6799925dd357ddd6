"""What rounded objects do to (10): a bar, cones, a sphere and a ring against their radius, by exact mechanics.

    python tests/studies/accuracy/rounded.py [BETA_DEG ...]

A perfect robot: exact moments and pushing angles, the true friction angle (10.5 degrees); d_x 60 mm, theta 3 degrees.
RMS by object and radius over the slopes, 20, 40 and 60 degrees without any: errors of (10), of what its first order
leaves and of (10) corrected, % of d_x; how far the normal felt (phi + alpha_est) lies from that at touch, degrees; slip
by (5) less the contact's true path along the object, and the true path round it with the slide in it, mm; the mean of
the curvatures that successive contacts tell (curvature.csv) over the true ones, in the whisking plane and along the
slip, where that is curved. A ring is a bar of 6 mm bent to a circle of that radius; a cone's is its radius across.
"""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.curved import curved
from bench.records.trial_result import FeltAt
from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.elastic_rod import Rod
from bench.rig.round_objects import TouchedCone, TouchedRing, TouchedSphere
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.surface_slip import slips_mm
from bench.rig.whisk_mechanics import WhiskMechanics
from bench.session.whisker import Whisker
from estimator import contact_state as contact
from estimator import first_order
from estimator.builtin import corrected, with_friction
from estimator.whisk import EstimatorSettings, Whisk
from vision.truth.value import Value

ROD = Rod("cylinder", 120.0, 1.0, 60.0)
WHISKER = Whisker(shape="cylinder", length_mm=120.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
D_X_MM, THETA, ALPHA = 60.0, math.radians(3.0), math.radians(10.5)
THETAS = np.radians(np.arange(1.0, 8.0))
NOISE_NMM, TUBE_MM = (
    1e-3,
    3.0,
)  # the noise weighs the fits of successive contacts, and is in no moment
BETAS_DEG, RADII_MM = np.array([20.0, 40.0, 60.0]), (5.0, 10.0, 20.0, 40.0, 80.0)
OBJECTS = ("bar", "cone of 15 deg", "cone of 45 deg", "sphere", "ring")


def placed(name: str, radius_mm: float, beta: float) -> tuple[TouchedBar, float, float]:
    """The object where the whisker first touches it at d_x; its radii in the whisking plane and along the slip."""
    ring = name == "ring"
    bar = TouchedBar.at_contact(
        d_x_mm=D_X_MM,
        beta_rad=beta,
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=TUBE_MM if ring else radius_mm,
        whisker_radius_mm=0.5,
    )
    touched = np.array([D_X_MM, 0.0, 0.0])
    if ring:
        return TouchedRing.from_bar(bar, touched, radius_mm), TUBE_MM, radius_mm + TUBE_MM
    if name == "sphere":
        return TouchedSphere(bar.point_mm, bar.axis, radius_mm), radius_mm, radius_mm
    if name.startswith("cone"):
        return (
            TouchedCone.from_bar(bar, touched, math.radians(float(name.split()[2]))),
            radius_mm,
            math.inf,
        )
    return bar, radius_mm, math.inf


def first_order_share(beta: float, rolled_mm: float, slipped_mm: float) -> float:
    """Of (10): rolling, friction along the whisker at beta = 0, and a surface that is curved along the slip."""
    share = float(first_order.rolling_at(THETA, rolled_mm + 0.5, beta, D_X_MM, 1.0))
    if beta < ALPHA:
        return share + (float(first_order.dragging(THETA, ALPHA)) if beta == 0 else math.nan)
    turned = math.cos(beta) * (math.tan(beta) - math.tan(ALPHA)) ** 2
    return share - 0.5 * THETA * D_X_MM / (slipped_mm + 0.5) * turned


def felt_at(whisk: WhiskMechanics, theta: float) -> FeltAt:
    """What the gauges would say there."""
    m_y, m_z = whisk.forward.moments_at(np.array([whisk.touch.motor_rad + theta]))[0]
    moments = Value(float(m_y), NOISE_NMM), Value(float(m_z), NOISE_NMM)
    return FeltAt(float(theta), *moments, 1e-6, NOISE_NMM**2 * np.eye(2), np.zeros(2))


def row(name: str, radius_mm: float, beta: float) -> list[float]:
    """One push: errors as the script's head has them; NaN where nothing is told. Raises ArithmeticError where the
    whisker comes to no equilibrium."""
    thing, rolled, slipped = placed(name, radius_mm, beta)
    touch = find_first_touch(ROD, thing, 0.0, D_X_MM)
    friction, stops = (
        FrictionCoefficients(math.tan(ALPHA), math.tan(ALPHA), 1e-3),
        touch.motor_rad + THETAS,
    )
    whisk = WhiskMechanics.run(
        ROD, thing, friction, touch, float(stops[-1]) + 1e-3, step_rad=0.004, stops_rad=stops
    )
    at = felt_at(whisk, THETA)
    felt = Whisk(
        *(np.zeros(0),) * 4,
        THETA,
        at.m_y_Nmm.value,
        at.m_z_Nmm.value,
        at.covariance_at,
        0.0,
        WHISKER.beam,
    )
    told = EstimatorSettings(ALPHA, object_radius_mm=rolled, whisker_radius_mm=0.5)
    d_x, better = (estimator(felt, told).d_x_mm for estimator in (with_friction, corrected))
    along, round_, _, slid_round = slips_mm(whisk, False)[
        whisk.forward.row_at(touch.motor_rad + THETA)
    ]
    slip = contact.slip(d_x, THETA, felt.m_y_at_Nmm, felt.m_z_at_Nmm, ALPHA)
    error, phi = 100 * (d_x / D_X_MM - 1), math.atan2(felt.m_y_at_Nmm, felt.m_z_at_Nmm)
    shape = curved([felt_at(whisk, theta) for theta in THETAS], WHISKER, ALPHA, 0.0)
    return [
        error,
        error - 100 * first_order_share(beta, rolled, slipped),
        100 * (better / D_X_MM - 1),
        math.degrees(phi + ALPHA - beta),
        slip - along,
        round_,
        slid_round,
        rolled / shape.radius_mm.value,
        shape.lateral_per_mm.value * slipped if math.isfinite(slipped) else math.nan,
    ]


def line(name: str, radius_mm: float, betas_deg: np.ndarray) -> str:
    """RMS over the slopes; of the curvatures the mean."""
    found = []
    for beta in np.radians(betas_deg):
        try:
            found.append(row(name, radius_mm, float(beta)))
        except ArithmeticError:  # it slides off within the push
            continue
    rows, head = np.array(found).reshape(-1, 9), f"{name:<16}{radius_mm:>6g} mm{len(found):>4} "
    rms = [
        np.sqrt(np.nanmean(column**2)) if np.isfinite(column).any() else np.nan
        for column in rows.T[:7]
    ]
    means = [np.nanmean(column) if np.isfinite(column).any() else np.nan for column in rows.T[7:]]
    return head + "".join(f"{value:>9.3f}" for value in (*rms, *means))


def lines(betas_deg: np.ndarray) -> Iterator[str]:
    heads = ("(10) %", "left %", "corr. %", "normal", "slip mm", "round", "slid", "1/R", "lateral")
    yield f"{'':<16}{'radius':>9}{'n':>4} " + "".join(f"{head:>9}" for head in heads)
    for name in OBJECTS:
        for radius_mm in RADII_MM:
            yield line(name, radius_mm, betas_deg)


if __name__ == "__main__":
    for text in lines(
        np.array([float(arg) for arg in sys.argv[1:]]) if sys.argv[1:] else BETAS_DEG
    ):
        print(text, flush=True)
