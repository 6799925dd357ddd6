"""One camera and a mirror against two cameras at the same places: errors, whether intervals hold, their ratio.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python tests/studies/accuracy/mirror.py FOLDER SEEDS

Seeds 0 to SEEDS - 1 of the protocol `mirror`, and of one with a camera where the rig is seen directly and another where
the mirror has the first, of the same pixels, are recorded into FOLDER and evaluated, boards to verdict. A session that
has its row in FOLDER/mirror.csv or FOLDER/two.csv is not made again; one that is done loses its pictures. Prints of d_x,
touch and slope RMS of error, the share of whisks whose 95 % interval holds and RMS of z, of both, and the ratio of their
RMS errors.
"""

import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import tomli_w

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench import api
from bench.rig import build
from bench.rig.pinhole import PinholeCamera
from bench.rig.protocol import FOLDER, load
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.studies.accuracy.rows import all_rows
from tests.studies.accuracy.sessions import errors
from tests.studies.accuracy.whisk_errors import (
    as_columns,
    columns_of,
    of_columns,
    of_whisks,
    pooled,
)

NAMES = ("d_x_mm", "touch_deg", "beta_deg")
COLUMNS = ("seed", *columns_of(NAMES), "status")
AXIS_MM = 350.0  # of a point on a camera's axis, near the whisker


def two_cameras(protocol: Path) -> dict:
    """The tables of a protocol with a camera for each part of its picture in place of the mirror."""
    tables = tomllib.loads(protocol.read_text())
    tables["cameras"] = [camera_table(camera) for camera in build.cameras(load(protocol))]
    return tables


def camera_table(camera: PinholeCamera) -> dict:
    """The table [[cameras]] of a camera."""
    position = camera.centre_mm
    aim = {"position_mm": position, "target_mm": position + AXIS_MM * camera.rotation[2]}
    focal = camera.matrix[0, 0]
    lens = {
        "focal_px": focal,
        "aspect": camera.matrix[1, 1] / focal,
        "centre_px": camera.matrix[:2, 2],
        "distortion": camera.distortion,
        "size_px": camera.size_px,
    }
    upright = PinholeCamera.aim(camera.name, **{**lens, **aim})
    turn = camera.rotation @ upright.rotation.T
    roll_rad = np.arctan2(turn[1, 0], turn[0, 0])
    for signed in (roll_rad, -roll_rad):
        made = PinholeCamera.aim(camera.name, **{**lens, **aim}, roll_rad=signed)
        if np.allclose(made.rotation, camera.rotation, atol=1e-9):
            plain = {key: np.asarray(value).tolist() for key, value in {**lens, **aim}.items()}
            return {"name": camera.name, **plain, "roll_deg": float(np.degrees(signed))}
    raise ArithmeticError(f"camera {camera.name} is no camera that is aimed at a point")


def row_of(folder: Path, kind: str, protocol: Path, seed: int, workers: int = 2) -> dict:
    """A session recorded, evaluated and reduced."""
    path = folder / f"{kind}{seed}"
    out = folder / f"{kind}{seed}_out"
    simulate(path, protocol=protocol, seed=seed, workers=workers)
    whisks = api.evaluate(path, out, figures=False, workers=workers).whisks
    session = load_session(path)
    row: dict = {"seed": seed, "status": ""}
    for name in NAMES:
        found = errors(session, out, whisks, name)
        row |= as_columns(name, of_whisks(found[:, :2]))
    shutil.rmtree(path)
    return row


def rows_of(folder: Path, seeds: range, workers: int = 2) -> dict[str, list[dict]]:
    """The rows of all sessions with the mirror, and of those with two cameras."""
    folder.mkdir(parents=True, exist_ok=True)
    protocols = {"mirror": folder / "mirror.toml", "two": folder / "two.toml"}
    shutil.copyfile(FOLDER / "mirror.toml", protocols["mirror"])
    protocols["two"].write_text(tomli_w.dumps(two_cameras(protocols["mirror"])))
    rows = {}
    for kind, protocol in protocols.items():
        rows[kind] = all_rows(
            folder / f"{kind}.csv",
            COLUMNS,
            seeds,
            lambda seed, k=kind, p=protocol: row_of(folder, k, p, seed, workers),
        )
    return rows


def main() -> None:
    rows = rows_of(Path(sys.argv[1]), range(int(sys.argv[2])))
    for name in NAMES:
        rms = {}
        for kind in rows:
            found = pooled(of_columns(row, name) for row in rows[kind])
            rms[kind] = found["rms"]
            print(
                f"{name} {kind:6s}: {found['n']:.0f} whisks, RMS {found['rms']:.4f}, "
                f"{found['held']:.0%} hold, z {found['rms_z']:.2f} RMS"
            )
        print(f"{name} mirror over two cameras: {rms['mirror'] / rms['two']:.2f}")


if __name__ == "__main__":
    main()
