"""How PyElastica bends the rod that tests/studies/speed/beside.py asks for; run by it, in an environment of its own.

    python others_rods.py LENGTH_mm DIAMETER_mm YOUNGS_MODULUS_MPa DENSITY_g_mm3 FORCE_N ELEMENTS[,ELEMENTS…] OUT.npz

A rod clamped at its base is pulled across at its end, and its motion damped until it stands. Time is in ms: with mm and
g forces are in N, and what PyElastica divides by is not too small for it, as it is in m and kg. OUT.npz: where its end
stands (k, 2), along and across, mm, for each number of elements; by how much (k,) it still moved in the last tenth, mm;
and seconds of processor (k,), after a short run that compiles.
"""

import sys
import time
from importlib.metadata import version

import elastica as ea
import numpy as np

_LEVER = 4.0  # a section turns against its shear as fast as sound crosses its diameter over this
_SETTLED = 40.0  # of the damping's own times


class Bench(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):
    """A rod with its clamp, load and damping."""


def bent(
    length: float,
    diameter: float,
    modulus: float,
    density: float,
    force: float,
    elements: int,
    settled: float = _SETTLED,
) -> tuple[np.ndarray, float]:
    """Where (2,) the end stands, and how far it moved in the last tenth of the time."""
    bench, area = Bench(), 0.25 * np.pi * diameter**2
    rigidity = modulus * np.pi * diameter**4 / 64
    slowest = (
        3.516 * np.sqrt(rigidity / (density * area)) / length**2
    )  # rad/ms: a cantilever's first mode
    rod = ea.CosseratRod.straight_rod(
        elements,
        np.zeros(3),
        np.array([1.0, 0, 0]),
        np.array([0, 0, 1.0]),
        length,
        0.5 * diameter,
        density,
        youngs_modulus=modulus,
    )
    step, whole = (
        min(length / elements, diameter / _LEVER) / np.sqrt(modulus / density),
        settled / slowest,
    )
    bench.append(rod)
    bench.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    pull = np.array([0.0, force, 0.0])
    bench.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), pull, ramp_up_time=0.1 * whole)
    bench.dampen(rod).using(
        ea.AnalyticalLinearDamper, uniform_damping_constant=slowest, time_step=step
    )
    bench.finalize()
    stepper, steps = ea.PositionVerlet(), int(whole / step)
    early = 9 * steps // 10
    ea.integrate(stepper, bench, early * step, early, progress_bar=False)
    before = rod.position_collection[:2, -1].copy()
    late = steps - early
    ea.integrate(stepper, bench, late * step, late, restart_time=early * step, progress_bar=False)
    end = rod.position_collection[:2, -1].copy()
    return end, float(np.linalg.norm(end - before))


def main() -> None:
    numbers, elements, out = (
        [float(word) for word in sys.argv[1:6]],
        sys.argv[6].split(","),
        sys.argv[7],
    )
    bent(*numbers, int(elements[0]), settled=0.1)
    ends, moved, spent = [], [], []
    for count in map(int, elements):
        begin = time.process_time()
        end, still = bent(*numbers, count)
        ends, moved, spent = [*ends, end], [*moved, still], [*spent, time.process_time() - begin]
    np.savez(out, end=ends, moved=moved, spent_s=spent, version=version("pyelastica"))


if __name__ == "__main__":
    main()
