"""Does slip at a wanted angle hold where the contact sticks and slips? Exact mechanics, frames at random phases.

    python tests/studies/accuracy/slip_jumps.py [--count 200] [--seed 0]

Frames are 0.1, 0.35 or 0.7° apart and err by 4 µm in slip and 0.001 rad in φ, touch by 0.02°; the angle is drawn from
2 to 4°. Printed: in how many the record is seen to jump, how often 95 % holds slip and φ, the largest |z| and slip's
median sigma.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.bar import TouchedBar, find_first_touch
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from tests.studies.accuracy.estimates_montecarlo import rod_and_beam
from vision.truth.at_angle import Smooth, TruthAtAngle, at_angle
from vision.truth.value import FIELDS

CASES = (
    (45.0, 0.30, 0.36),
    (45.0, 0.30, 0.50),
    (60.0, 0.34, 0.43),
    (30.0, 0.10, 0.30),
    (60.0, 0.20, 0.24),
)  # β in deg, μ kinetic, static
STEPS_DEG, D_X_MM = (0.1, 0.35, 0.7), 60.0
SIGMAS, TOUCH_SIGMA_RAD = {"slip": 0.004, "phi": 0.001}, np.radians(0.02)


def whisk(beta_deg: float, kinetic: float, static: float) -> dict[str, np.ndarray]:
    """Pushing angle, slip and φ along the way."""
    rod, _ = rod_and_beam("cylinder")
    bar = TouchedBar.at_contact(
        d_x_mm=D_X_MM,
        beta_rad=np.radians(beta_deg),
        psi_rad=0.0,
        touch_rad=0.0,
        radius_mm=3.0,
        whisker_radius_mm=0.5,
    )
    touch = find_first_touch(rod, bar, 0.0, D_X_MM)
    mechanics = WhiskMechanics.run(
        rod,
        bar,
        FrictionCoefficients(static, kinetic),
        touch,
        touch.motor_rad + np.radians(5.0),
        step_rad=np.radians(0.05),
    )
    way = mechanics.forward
    m_y, m_z = way.moment_Nmm[1:].T
    return {
        "theta": (way.motor_rad - touch.motor_rad)[1:],
        "slip": mechanics.slip_mm(way.point_mm, way.motor_rad)[1:],
        "phi": np.arctan2(m_y, m_z),
    }


def told(
    way: dict[str, np.ndarray], theta_rad: np.ndarray, wanted_rad: float, rng: np.random.Generator
) -> TruthAtAngle:
    """What frames at these angles (f,) say of the wanted one."""
    count = len(theta_rad)
    names = {name: name if name in way else "slip" for name in FIELDS}
    values = {
        name: np.interp(theta_rad, way["theta"], way[of]) + SIGMAS[of] * rng.standard_normal(count)
        for name, of in names.items()
    }
    own = {name: SIGMAS[of] * np.eye(count, count + 1) for name, of in names.items()}
    covariance = np.diag([1.0] * count + [TOUCH_SIGMA_RAD**2])
    shown = theta_rad + TOUCH_SIGMA_RAD * rng.standard_normal()
    no_cameras = np.zeros((count + 1, 0))
    nothing = 0.0 * covariance
    touch_jacobian = np.eye(count + 1)[-1]
    smooth = Smooth(shown, touch_jacobian, values, own, covariance, nothing, no_cameras)
    return at_angle(smooth, wanted_rad, "")


def line(
    case: tuple[float, float, float], step_deg: float, count: int, rng: np.random.Generator
) -> str:
    """One kind of teeth at one distance of frames."""
    way, found, jumps = whisk(*case), [], 0
    for _ in range(count):
        theta, wanted = (
            np.radians(np.arange(rng.uniform(0.05, step_deg), 4.9, step_deg)),
            np.radians(rng.uniform(2, 4)),
        )
        at = told(way, theta, wanted, rng)
        jumps += bool(at.status)
        known = (at.slip_mm, way["slip"]), (at.phi_rad, way["phi"])
        found.append(
            [abs(v.value - np.interp(wanted, way["theta"], y)) / v.sigma for v, y in known]
            + [at.slip_mm.sigma]
        )
    slip, phi, sigma = np.array(found).T
    shown = (
        f"{name} holds in {100 * np.mean(z < 1.96):.1f} %, |z| to {z.max():.1f}"
        for name, z in (("slip", slip), ("φ", phi))
    )
    return (
        f"β {case[0]:g}°, μ {case[1]:g} to {case[2]:g}, frames {step_deg:g}° apart: {jumps} of {count} jump; "
        f"{'; '.join(shown)}; {np.median(sigma):.3f} mm stated"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    for case in CASES:
        for step_deg in STEPS_DEG:
            print(line(case, step_deg, options.count, rng), flush=True)


if __name__ == "__main__":
    main()
