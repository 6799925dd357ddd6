"""Do the combined numbers of a session hold: friction angles by each way, radius, lateral curvature, clock, softness?

    python tests/studies/accuracy/combined_numbers.py [--count 200] [--seed 0] [--shape cylinder cone]

Each session is drawn anew, by the rig's exact mechanics and without pictures: α, two surfaces of it (one with all bars
at one nominal distance, one with two in turn), each bar 0.4°, 0.4 mm and a lean of up to 5° (one sigma each) off what
was wanted, and pushed so many times; gauges, cameras and clock with errors that all whisks share, noise of moments and
touches that each whisk has of its own. What cameras see is drawn with the sigmas that are stated of it. Printed of each
number: how many sessions have it, bias, RMS of z, how often its 95 % interval holds, the median sigma; then in how many
sessions a straight bar was said to be curved, and how many statuses stood in place of a number.
"""

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.analyses.curved import Curvature, mean_radius_error
from bench.analyses.estimates_again import settings_without_alpha
from bench.analyses.friction_tables import friction_of
from bench.analyses.soft import Soft, _place, softness
from bench.base.combined import Measurement
from bench.base.settings import TILT_SIGMA_RAD
from bench.records.trial_result import (
    Clock,
    Deflection,
    FeltAt,
    FeltTrial,
    FeltWhisk,
    SeenTrial,
    SeenWhisk,
    TrialFacts,
    TrialResult,
    WhiskerFacts,
)
from bench.rig.elastic_rod import Rod
from bench.rig.stick_slip import FrictionCoefficients
from bench.rig.whisk_mechanics import WhiskMechanics
from bench.session.whisker import Whisker
from bench.trials.clocks import shared_touch
from bench.trials.estimates import whisk_of
from bench.trials.seen_friction import with_seen_friction
from estimator.two_tilts import SharedContact, shared_contact
from estimator.uncertainty import Z_95
from tests.scenes.friction_results import run_of
from tests.scenes.marches import touched_bar
from tests.studies.accuracy.estimates_montecarlo import DIAMETER_MM, E_GPA, LENGTH_MM, rod_and_beam
from vision import Value, WhiskTruth
from vision.truth.at_angle import TruthAtAngle
from vision.truth.records import FrameTruth, SharedSigmas

SLOPES_DEG = (-60, -45, -30, 0, 30, 45, 60)
SURFACES_MM = {"one distance": (60.0,), "two distances": (45.0, 60.0)}
WHISKS = 5  # of a bar
SPEEDS_DEG_S = (10.0, 30.0)  # of a surface's bars in turn, for the clock
THETA_DEG = 3.0
THETAS_RAD = np.radians(np.arange(1.0, 9.0))
BAR_RADIUS_MM = 3.0
# One sigma each: what a hand sets wrong, of a bar.
SLOPE_RAD, DISTANCE_MM = np.radians(0.4), 0.4
# Distances of a soft object, and how well each is known.
SOFT_MM, SHIFT_MM = (40.0, 60.0), 0.07
# What all whisks share: gauges' coefficients (share), slope (by the cameras) and touch as seen, the clock.
GAUGE_SHARE, SHARED_SLOPE_RAD, CLOCK_S = 0.004, np.radians(0.03), 5e-4
SHARED_TOUCH_RAD = np.radians(0.005)
# What each whisk has of its own: moments, slope, touch as felt and as seen, deflections as seen.
MOMENT_NMM, OWN_SLOPE_RAD, OWN_TOUCH_RAD, OWN_PLACE_MM = (
    0.01,
    np.radians(0.03),
    np.radians(0.01),
    0.01,
)


@dataclass(frozen=True)
class Shared:
    """Errors that all whisks of a session share: gauges (2, 2), of slope, touch (rad) and clock (s)."""

    gauges: np.ndarray
    slope_rad: float
    touch_rad: float
    clock_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> "Shared":
        """Draw the errors of a session."""
        return cls(
            np.eye(2) + GAUGE_SHARE * rng.normal(size=(2, 2)),
            SHARED_SLOPE_RAD * rng.normal(),
            SHARED_TOUCH_RAD * rng.normal(),
            CLOCK_S * rng.normal(),
        )


class DrawnSession:
    """Results of a session's trials, made from exact mechanics and drawn errors."""

    def __init__(self, shape: str, rng: np.random.Generator):
        self.rng = rng
        self.rod, self.beam = rod_and_beam(shape)
        self.whisker = Whisker(
            shape=shape, length_mm=LENGTH_MM, diameter_mm=DIAMETER_MM, youngs_modulus_GPa=E_GPA
        )
        self.alpha_rad = np.radians(rng.uniform(5.0, 20.0))
        self.shared = Shared.draw(rng)

    @cached_property
    def results(self) -> tuple[TrialResult, ...]:
        """Return the result of every bar."""
        return tuple(self._results())

    def _results(self) -> Iterator[TrialResult]:
        """Yield the result of every bar."""
        for surface, places_mm in SURFACES_MM.items():
            for k, beta_deg in enumerate(SLOPES_DEG):
                nominal_mm = places_mm[k % len(places_mm)]
                speed = SPEEDS_DEG_S[k % len(SPEEDS_DEG_S)]
                facts = TrialFacts(
                    f"{surface} {beta_deg}",
                    "measure",
                    surface,
                    None,
                    d_x_nominal_mm=nominal_mm,
                    beta_nominal_deg=float(beta_deg),
                    beta_nominal_sigma_rad=SLOPE_RAD,
                    bar_diameter_mm=2 * BAR_RADIUS_MM,
                )
                yield self._result(facts, np.radians(speed))

    def _result(self, facts: TrialFacts, speed_rad_s: float) -> TrialResult:
        """Push a bar, set up with its own errors, again and again."""
        beta = np.radians(facts.beta_nominal_deg) + SLOPE_RAD * self.rng.normal()
        psi = TILT_SIGMA_RAD * self.rng.normal()
        d_x_mm = facts.d_x_nominal_mm + DISTANCE_MM * self.rng.normal()
        mechanics = push(self.rod, beta, psi, d_x_mm, self.alpha_rad)
        seen = []
        felt = []
        for number in range(WHISKS):
            seen.append(self.seen(number, mechanics, speed_rad_s))
            felt.append(self._felt(number, mechanics))
        of_whisker = WhiskerFacts(self.whisker.shape, LENGTH_MM, DIAMETER_MM, self.whisker.EI_Nmm2)
        clock = Clock("drawn", CLOCK_S, recorded=True)
        return TrialResult(
            facts,
            of_whisker,
            THETA_DEG,
            SeenTrial(tuple(seen), clock=clock),
            FeltTrial(tuple(felt)),
        )

    def _felt(self, number: int, mechanics: WhiskMechanics) -> FeltWhisk:
        """Draw what is felt of a push."""
        late_rad = OWN_TOUCH_RAD * self.rng.normal()
        ats = []
        for theta in THETAS_RAD:
            motor = mechanics.touch.motor_rad + theta + late_rad
            exact = mechanics.forward.moments_at(np.array([motor]))[0]
            moments = self.shared.gauges @ exact + MOMENT_NMM * self.rng.normal(size=2)
            causes = gauge_causes(moments)
            covariance = MOMENT_NMM**2 * np.eye(2) + causes.T @ causes
            values = [Value(m, s) for m, s in zip(moments, np.sqrt(np.diag(covariance)))]
            ats.append(FeltAt(theta, *values, OWN_TOUCH_RAD, covariance, np.zeros(2)))
        at = ats[int(np.argmin(np.abs(THETAS_RAD - np.radians(THETA_DEG))))]
        m_y, m_z = at.m_y_Nmm.value, at.m_z_Nmm.value
        by_phi = np.array([m_z, -m_y]) / (m_y**2 + m_z**2)
        phi_sigma = np.sqrt(by_phi @ at.covariance_at @ by_phi)
        return FeltWhisk(
            number,
            Value(mechanics.touch.motor_rad + late_rad, OWN_TOUCH_RAD),
            at.m_y_Nmm,
            at.m_z_Nmm,
            Value(float(np.arctan2(m_y, m_z)), float(phi_sigma)),
            OWN_TOUCH_RAD,
            at.covariance_at,
            np.zeros(2),
            gauge_causes(np.array([m_y, m_z])),
            by_theta=tuple(ats),
            delay_s=Value(0.0, 0.0),
        )

    def seen(self, number: int, mechanics: WhiskMechanics, speed_rad_s: float) -> SeenWhisk:
        """Draw what cameras see of a push."""
        beta, psi = mechanics.slope
        touch_rad = mechanics.touch.motor_rad
        late_rad = self.shared.touch_rad - self.shared.clock_s * speed_rad_s
        seen_touch = touch_rad + late_rad + OWN_TOUCH_RAD * self.rng.normal()
        seen_beta = beta + self.shared.slope_rad + OWN_SLOPE_RAD * self.rng.normal()
        clock_rad = CLOCK_S * speed_rad_s
        touch_sigma = np.linalg.norm([OWN_TOUCH_RAD, SHARED_TOUCH_RAD, clock_rad])
        shared = SharedSigmas(
            touch_rad=float(np.hypot(SHARED_TOUCH_RAD, clock_rad)),
            d_x_mm=0.01,
            beta_rad=SHARED_SLOPE_RAD,
            psi_rad=0.0,
            point_mm=np.zeros(3),
            beta_by_camera_error_rad=np.array([SHARED_SLOPE_RAD]),
            psi_by_camera_error_rad=np.zeros(1),
        )
        truth = WhiskTruth(
            number,
            touch_rad=Value(seen_touch, float(touch_sigma)),
            d_x_mm=Value(mechanics.touch.d_x_mm + 0.01 * self.rng.normal(), 0.015),
            beta_rad=Value(seen_beta, float(np.hypot(OWN_SLOPE_RAD, SHARED_SLOPE_RAD))),
            psi_rad=Value(psi + OWN_SLOPE_RAD * self.rng.normal(), OWN_SLOPE_RAD),
            frames=frames_at(speed_rad_s),
            shared=shared,
        )
        at = TruthAtAngle(
            theta_rad=THETAS_RAD[2], slip_mm=Value(np.nan, OWN_PLACE_MM), slip_shared_mm=0.0
        )
        whisk = SeenWhisk(truth, at=at, deflection=self._deflection(mechanics))
        return with_seen_friction(whisk, self.whisker)

    def _deflection(self, mechanics: WhiskMechanics) -> Deflection:
        """Draw the contact's place in the hub's axes at the pushing angles."""
        path = mechanics.forward
        theta = path.motor_rad[1:] - mechanics.touch.motor_rad
        x, y, z = path.point_mm[1:].T
        motor = path.motor_rad[1:]
        along = np.cos(motor) * x + np.sin(motor) * y
        across = np.sin(motor) * x - np.cos(motor) * y
        touch = mechanics.touch.motor_rad
        past = np.cos(touch) * x + np.sin(touch) * y - mechanics.touch.d_x_mm - path.arc_mm[1:]
        count = len(theta)
        noise = OWN_PLACE_MM * self.rng.normal(size=(2, count))
        return Deflection(
            theta,
            motor,
            mechanics.slip_mm(path.point_mm[1:], motor),
            np.full(count, OWN_PLACE_MM),
            along,
            across + noise[0],
            z + noise[1],
            past,
            OWN_PLACE_MM**2 * np.eye(3 * count),
            np.zeros((3 * count, 1)),
            Value(touch, OWN_TOUCH_RAD),
            mechanics.touch.d_x_mm,
        )


def push(
    rod: Rod, beta: float, psi: float, d_x_mm: float, alpha_rad: float, stiffness=np.inf
) -> WhiskMechanics:
    """Push a bar to beyond the last pushing angle."""
    place = {"beta_rad": beta, "psi_rad": psi, "radius_mm": BAR_RADIUS_MM}
    bar, touch = touched_bar(rod, d_x_mm, **place, stiffness_N_mm=stiffness)
    friction = FrictionCoefficients(np.tan(alpha_rad), np.tan(alpha_rad))
    end_rad = touch.motor_rad + THETAS_RAD[-1] + np.radians(0.2)
    return WhiskMechanics.run(rod, bar, friction, touch, end_rad, step_rad=np.radians(0.5))


def gauge_causes(moments: np.ndarray) -> np.ndarray:
    """Return the change (4, 2) of moments (2,) by each of the gauges' coefficients."""
    return GAUGE_SHARE * np.kron(np.eye(2), moments[:, None])


def frames_at(speed_rad_s: float) -> FrameTruth:
    """Return frames that show the motor's speed, and nothing else."""
    time_s = np.arange(4) / 100.0
    unknown = np.full(4, np.nan)
    value = Value(unknown, unknown)
    places = Value(np.full((4, 3), np.nan), np.full((4, 3), np.nan))
    return FrameTruth(
        **dict.fromkeys(("slip_mm", "d_y_mm", "d_z_mm", "alpha_rad"), value),
        index=np.arange(4),
        time_s=time_s,
        motor_rad=speed_rad_s * time_s,
        theta_rad=value,
        touching=np.zeros(4, bool),
        point_mm=places,
        arc_mm=unknown,
        status=("",) * 4,
    )


class Table:
    """Errors and sigmas of each number, a row a session."""

    def __init__(self):
        self.rows = defaultdict(list)
        self.statuses = defaultdict(Counter)

    def add(self, name: str, error: float, sigma: float, status: str = "") -> None:
        """Add the error of one session's number, or the status that stands in its place."""
        if np.isfinite([error, sigma]).all():
            self.rows[name].append((error, sigma))
        else:
            self.statuses[name][str(status)] += 1

    def lines(self) -> Iterator[str]:
        """Yield a line a number."""
        yield f"{'':<32}{'n':>5}{'bias':>10}{'RMS z':>8}{'in 95 %':>10}{'sigma':>10}"
        for name, rows in self.rows.items():
            error, sigma = np.array(rows).T
            z = error / sigma
            held = 100 * np.mean(np.abs(z) < Z_95)
            yield (
                f"{name:<32}{len(z):>5}{error.mean():>+10.4f}{np.sqrt(np.mean(z**2)):>8.2f}"
                f"{held:>9.1f}%{np.median(sigma):>10.4f}"
            )
        for name, counts in self.statuses.items():
            for status, count in counts.items():
                yield f"{name}: {count} × {status or 'none'}"


def judge(session: DrawnSession, table: Table, shape: str) -> None:
    """Add the errors of a session's combined numbers."""
    true_deg = np.degrees(session.alpha_rad)
    found = friction_of(session.results, session.whisker, np.radians(10.0))
    for one in found:
        names = ["seen", "felt", "least_squares", "tilting"]
        names.append("consistency" if one.surface.name == "one distance" else "smoothness")
        for name in names:
            alpha_deg = one.alpha(name).in_degrees()
            status = next((way.status for way in one.ways if way.name == name), "")
            table.add(
                f"α {name}, {one.surface.name} [°]",
                alpha_deg.value - true_deg,
                alpha_deg.sigma,
                status,
            )
    run = replace(run_of(), whisker=session.whisker, results=session.results)
    curved = Curvature().compute(run)
    radius = mean_radius_error(curved)
    table.add("radius less the bar's [mm]", radius.value, radius.sigma)
    said = sum("curved to the side" in line for line in Curvature().lines(curved))
    table.statuses["straight bars said to be curved"][f"{said} in a session"] += 1
    clock = shared_touch(session.results)
    sigmas = np.sqrt(np.diag(clock.covariance))
    table.add("zero of touch beyond stated [°]", *np.degrees([clock.values[0], sigmas[0]]))
    table.add("clock beyond stated [ms]", *(1e3 * np.array([clock.values[1], sigmas[1]])))
    table.statuses["error of touch said"][f"{clock.is_error} of a sound session"] += 1
    tilted = tilts(session)
    table.add("d_x of tilts [mm]", tilted.d_x_mm - 60.0, tilted.covariance[0, 0] ** 0.5)
    sigma_deg = np.degrees(tilted.covariance[1, 1] ** 0.5)
    table.add("α of tilts [°]", np.degrees(tilted.alpha_rad) - true_deg, sigma_deg, tilted.status)
    stiffness = np.inf if session.rng.random() < 0.25 else 10.0 ** session.rng.uniform(-1.0, 1.0)
    give = soft_object(session, stiffness).give_mm_N
    table.add("softness [mm/N]", give.value - 1.0 / stiffness, give.sigma)


def tilts(session: DrawnSession) -> SharedContact:
    """Solve the bars at one distance for that and α."""
    pushes = []
    names = []
    shared = []
    for result in session.results:
        if result.trial.surface == "one distance":
            for felt in result.felt.whisks:
                pushes.append(whisk_of(felt, np.radians(THETA_DEG), session.beam))
                names.append(result.trial.name)
                shared.append(felt.shared_Nmm)
    return shared_contact(
        pushes,
        settings_without_alpha(session.results[0]),
        apart_sigma_mm=DISTANCE_MM,
        places=names,
        shared_Nmm=shared,
    )


def soft_object(session: DrawnSession, stiffness_N_mm: float) -> Soft:
    """Push an object that gives way at two distances, two bars at each."""
    rng = session.rng
    theta = np.radians(THETA_DEG)
    places = []
    for nominal_mm in SOFT_MM:
        held = []
        for trial in range(2):
            d_x_mm = nominal_mm + SHIFT_MM * rng.normal()
            mechanics = push(session.rod, 0.0, 0.0, d_x_mm, session.alpha_rad, stiffness_N_mm)
            exact = mechanics.forward.moments_at(np.array([mechanics.touch.motor_rad + theta]))[0]
            for _ in range(WHISKS):
                m_z = (session.shared.gauges @ exact)[1] + MOMENT_NMM * rng.normal()
                k = theta / m_z
                common = (-GAUGE_SHARE * k,)
                held.append((str(trial), Measurement(k, k / m_z * MOMENT_NMM, common=common)))
        places.append(_place(nominal_mm, SHIFT_MM / np.sqrt(2.0), held))
    facts = TrialFacts("soft", "measure", "soft", None, bar_diameter_mm=2 * BAR_RADIUS_MM)
    alpha_est = Value(*np.radians([12.0, 5.0]))
    return softness(session.whisker, facts, *places, theta, alpha_est)


def main() -> None:
    """Print the table of each shape."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shape", nargs="+", default=["cylinder", "cone"])
    options = parser.parse_args()
    for shape in options.shape:
        rng = np.random.default_rng(options.seed)
        table = Table()
        for _ in range(options.count):
            judge(DrawnSession(shape, rng), table, shape)
        print(shape)
        print(*table.lines(), sep="\n", flush=True)


if __name__ == "__main__":
    main()
