"""Each camera left out in turn, in path-traced scenes with three: how far the others move the truth, and is it told?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/one_camera_less.py SCENES [PATTERN]

SCENES as for path_traced.py. A row a scene: the least of the chances by which cameras that agree differ so; then the
same with lines of one camera shifted by SHIFT_PX, all as of one that was knocked, or of wire or bar alone as light may
do: by how many stated sigmas d_x is off, before and after these hold the contradiction, where one is told.
"""

import sys
import tomllib
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.studies.accuracy.error_parts import fit_scene
from vision.calibration.cameras_file import read_cameras
from vision.fit.converged_fit import ConvergedFit
from vision.fit.one_camera_less import contradiction, covariance_of, leave_out_each
from vision.fit.problem import Problem, State
from vision.fit.solve import solve

SHIFT_PX = 2.0


def fitted(folder: Path) -> tuple[Problem, State] | None:
    """The fit of a scene's whisk; None where fewer than three cameras see it."""
    if len(read_cameras(folder / "cameras.toml")) < 3:
        return None
    found, _ = fit_scene(folder)
    return found.problem, found.state


def shifted(problem: Problem, camera: int, which: str) -> Problem:
    """With lines of a camera shifted: all, or those of wire or bar."""
    spared = {"all": (), "wire": (True,), "bar": (False,)}[which]  # whether of the bar
    seen = [
        one
        if one.camera != camera or (one.frame < 0) in spared
        else replace(
            one, points=replace(one.points, px=one.points.px + SHIFT_PX * one.points.normal)
        )
        for one in problem.seen
    ]
    return replace(problem, seen=seen)


def asked(problem: Problem, state: State, d_x_mm: float):
    """Least chance, what is told, and d_x's error in stated sigmas, before and after."""
    fit = ConvergedFit(problem, solve(problem, state)[0])
    found, gradient = leave_out_each(fit), fit.by_parameter.whisk["d_x"]
    wider = fit.fit_covariance + covariance_of(found, problem.size)
    z = [
        (fit.measured.whisk["d_x"] - d_x_mm) / np.sqrt(gradient @ one @ gradient)
        for one in (fit.fit_covariance, wider)
    ]
    return min(one.chance for one in found), contradiction(found), z


def main() -> None:
    pattern = sys.argv[2] if len(sys.argv) > 2 else "*"
    for folder in sorted(
        one for one in Path(sys.argv[1]).glob(pattern) if (one / "trials/w/truth.toml").exists()
    ):
        fit = fitted(folder)
        if fit is None:
            continue
        d_x_mm = tomllib.loads((folder / "trials/w/truth.toml").read_text())["d_x_mm"]
        chance, said, z = asked(*fit, d_x_mm)
        print(f"{folder.name:<6} chance {chance:.2g}  z of d_x {z[0]:+.1f}  {said}")
        for which, camera in product(("all", "wire", "bar"), range(len(fit[0].cameras))):
            chance, said, z = asked(shifted(fit[0], camera, which), fit[1], d_x_mm)
            told = "told" if said else "silent"
            print(
                f"       {which} of {camera} off: chance {chance:.0e}, z {z[0]:+.1f} → {z[1]:+.1f}, {told}",
                flush=True,
            )


if __name__ == "__main__":
    main()
