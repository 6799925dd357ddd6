"""A clamped rod pulled across at its end, by the rig's elastica and by PyElastica: the error of its end, and seconds.

The truth is the elastica by another way: the curvature at the clamp is shot for, by an integrator of steps held to
1e-11. PyElastica's rod stretches and shears besides, by some 1e-5 of its length here.
"""

import subprocess
import time
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bench.rig.elastic_rod import Rod
from bench.rig.elastica import Elastica

ROD = Rod("cylinder", length_mm=60.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
FORCE_N = 0.5
NODES, ELEMENTS = (8, 12, 20), (10, 20)
_TOLERANCE, _REPEATS = 1e-11, 20


def exact_end_mm() -> np.ndarray:
    """Where (2,) the end is, along and across, mm."""
    scale = FORCE_N / ROD.rigidity_Nmm2

    def shot(curvature: float) -> np.ndarray:
        def slope(_, state):
            return [state[1], -scale * np.cos(state[0]), np.cos(state[0]), np.sin(state[0])]

        begin, tolerance = [0.0, curvature, 0.0, 0.0], {"rtol": _TOLERANCE, "atol": _TOLERANCE}
        return solve_ivp(slope, (0.0, ROD.length_mm), begin, method="DOP853", **tolerance).y[:, -1]

    curvature = brentq(lambda one: shot(one)[1], 0.0, scale * ROD.length_mm, xtol=1e-14)
    return shot(curvature)[2:]


def ours(nodes: int) -> tuple[np.ndarray, float]:
    """Where (2,) the end is, mm; seconds of processor, the least of some."""
    elastica, spent = Elastica(ROD, nodes), []
    for _ in range(_REPEATS):
        begin = time.process_time()
        end_mm = elastica.solve(0.0, FORCE_N, ROD.length_mm).end_mm
        spent.append(time.process_time() - begin)
    return end_mm, min(spent)


def theirs(others: Path) -> dict:
    """What others_rods.py writes."""
    numbers = (
        ROD.length_mm,
        ROD.diameter_mm,
        ROD.youngs_modulus_GPa * 1e3,
        ROD.density_kg_m3 / 1e6,
        FORCE_N,
    )
    with TemporaryDirectory() as name:
        out, script = Path(name) / "out.npz", Path(__file__).with_name("others_rods.py")
        command = [others / "bin" / "python", script, *numbers, ",".join(map(str, ELEMENTS)), out]
        subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
        with np.load(out) as found:
            return dict(found)


def table(others: Path) -> Iterator[str]:
    """Lines of the comparison. others: the environment that has PyElastica."""
    end_mm = exact_end_mm()
    yield f"{f'a rod bent aside by {end_mm[1]:.1f} of {ROD.length_mm:g} mm':<34}{'error um':>12}{'CPU s':>12}"
    for nodes in NODES:
        found_mm, spent_s = ours(nodes)
        yield _line(
            f"whisker-bench {version('whisker-bench')}, {nodes} nodes", found_mm - end_mm, spent_s
        )
    other = theirs(others)
    for count, end, spent_s in zip(ELEMENTS, other["end"], other["spent_s"]):
        yield _line(f"pyelastica {other['version']}, {count} elements", end - end_mm, spent_s)


def _line(name: str, off_mm: np.ndarray, spent_s: float) -> str:
    return f"{name:<34}{1e3 * np.linalg.norm(off_mm):12.4g}{spent_s:12.4g}"
