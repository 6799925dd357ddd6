"""Do intervals hold where nobody measured the bench better than a careful lab, and nobody says so?

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/drawn_givens.py FOLDER SEEDS [SESSION]

Sessions of the synthetic rig are recorded with pictures into FOLDER, seeds 0 to SEEDS - 1. Of each, session.toml and
trial.toml then state every given wrong by a draw of its assumed sigma (`Assumed` in bench/session/manifest.py), and none
of these sigmas. A session is evaluated, reduced to a row of FOLDER/drawn.csv, and loses its pictures; one that has its
row is not made again. Prints what sessions.py prints: 93 to 97 % of d_x's 95 % intervals should hold. A print's stretch
is not drawn: the rig prints none. Of a rendered SESSION with truth files, its own pictures are taken each time.
"""

import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.rig.simulation import simulate
from bench.session.givens import assumptions, value_key
from bench.session.manifest import SessionKeys, TrialKeys
from bench.session.session import load_session
from bench.session.strict_toml import Keys, inner_tables
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.sessions import COLUMNS, lines, row_of_run

PROTOCOL = """
name = "drawn"
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
target_mm = [53.0, 7.0, 0.0]
focal_px = 1932.0
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
follicle_roll_deg = 90.0
[[trials]]
surface = "steel"
beta_deg = [0, 30, 60]
d_x_mm = 60.0
friction = 0.185339
"""


def state_wrongly(session: Path, rng: np.random.Generator) -> None:
    """Let a session state each given wrong by a draw of the sigma that is assumed, and say nothing of it."""
    file = session / "session.toml"
    tables = tomllib.loads(file.read_text())
    tables.pop("exact", None)
    file.write_text(tomli_w.dumps(drawn(tables, SessionKeys, rng)))
    for trial in sorted(session.glob("trials/*/trial.toml")):
        trial.write_text(tomli_w.dumps(drawn(tomllib.loads(trial.read_text()), TrialKeys, rng)))


def drawn(table: dict[str, Any], kind: type[Keys], rng: np.random.Generator) -> dict[str, Any]:
    """A table with each number that has an assumed sigma off by a draw of it, in tables within, too."""
    found = dict(table)
    for key, inner in inner_tables(kind).items():
        if isinstance(table.get(key), dict):
            found[key] = drawn(table[key], inner, rng)
    for key, assumed in assumptions(kind).items():
        of = value_key(key, assumed)
        if of == "T_rig_board" or of not in table:
            continue
        found[of] = float(rng.normal(table[of], assumed.sigma(table[of])))
    if "T_rig_board" in table:
        found["T_rig_board"] = drawn_pose(np.array(table["T_rig_board"]), kind, rng)
    return found


def drawn_pose(pose: np.ndarray, kind: type[Keys], rng: np.random.Generator) -> list[list[float]]:
    """T_rig_board (3, 4) shifted, and turned about the board's origin, by draws of the assumed sigmas."""
    assumed = assumptions(kind)
    turn_deg = rng.normal(0.0, assumed["T_rig_board_sigma_deg"].sigma(pose), 3)
    shift_mm = rng.normal(0.0, assumed["T_rig_board_sigma_mm"].sigma(pose), 3)
    rotation = Rotation.from_rotvec(turn_deg, degrees=True).as_matrix() @ pose[:, :3]
    return np.column_stack([rotation, pose[:, 3] + shift_mm]).tolist()


def record(path: Path, seed: int) -> None:
    """Record a session of the synthetic rig."""
    protocol = path.parent / "drawn.toml"
    protocol.write_text(PROTOCOL)
    simulate(path, protocol=protocol, seed=seed)


def row_of(folder: Path, seed: int, rendered: Path | None) -> dict:
    """A session recorded, or copied where it is rendered, stated wrongly, evaluated and reduced."""
    path = folder / f"s{seed}"
    if rendered is None:
        record(path, seed)
    else:
        shutil.copytree(rendered, path, copy_function=shutil.copyfile)
    state_wrongly(path, np.random.default_rng([29, seed]))
    out = folder / f"out{seed}"
    run = api.evaluate(path, out, figures=False)
    row = row_of_run(load_session(path), out, run.whisks)
    shutil.rmtree(path)
    return {"seed": seed, **row}


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    seeds = range(int(sys.argv[2]))
    rendered = Path(sys.argv[3]) if len(sys.argv) > 3 else None
    table = folder / "drawn.csv"
    rows = all_rows(table, COLUMNS, seeds, lambda seed: row_of(folder, seed, rendered))
    print("\n".join(lines(rows)))


if __name__ == "__main__":
    main()
