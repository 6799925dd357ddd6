"""The truth at the extremes: where does its stated interval still hold, and what does it say beyond?

    python tests/studies/extremes/chain.py points FOLDER --count 6
    python tests/studies/extremes/chain.py painted FOLDER --count 2

One thing at a time departs from a usual scene (two cameras, a bar at 30° and 60 mm, a cylinder of 1 mm): slope, tilt,
distance, push, frames, friction, taper, the angle between sights, noise; of painted pictures thickness and picture
size, contrast over noise, blur, bits, frame rate and speed, and the wire's direction in the picture. `points` fits
noisy line points, which is cheap; `painted` has the rig draw each frame once and looks at it with `observe_trial` at
every preset. A scene is a row of FOLDER/<extreme>.csv for each preset; one that is there is not made again. Prints a
line a value and preset, with the largest memory of the process so far. docs/extremes.md is made from it.
"""

import argparse
import math
import resource
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from pathlib import Path

import msgspec
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from bench.rig.protocol import Protocol
from bench.rig.protocol_tables import CameraTable, PicturesTable, TrialTable, WhiskerTable
from bench.trials.seeing import PRESETS
from tests.studies.accuracy.coverage import COLUMNS as OF_SCENE
from tests.studies.accuracy.coverage import Seen, row_of, see_pictures, see_points
from tests.studies.accuracy.rows import HALF_WIDTH_95, all_rows
from tests.studies.accuracy.scenes import Scene, Sigmas, make_scene
from vision.geometry.refusals import Refused

COLUMNS = ("key", "value", *OF_SCENE, "beta_sigma_deg")
MIDDLE_MM, AWAY_MM, FOCAL_PX, SIZE_PX = np.array([52.0, 3.0, 0.0]), 400.0, 2000.0, (960, 600)
_MOST_SEEDS = 1000  # of a value, in the key of a row
# What `vision.truth.truth_rows` gives no truth beyond: of slope, and of slip.
_MOST_BETA_SIGMA_DEG, _MOST_SLIP_SIGMA_MM = 20.0, 1.0
_FAR_Z = 4.0
_CONTRAST = 60.0  # grey levels of the usual wire before the usual bench


def cameras(
    apart_deg: float = 40.0, *, scale: float = 1.0, roll_deg: float = 0.0, azimuths=(-115.0, -65.0)
):
    """Two cameras on the side that the whisker comes from, one above the other by so much and turned apart, so that
    their planes through bar and wire cut; scale: of focal length and picture alike."""
    size = tuple(int(round(scale * n)) for n in SIZE_PX)
    elevations = 35.0 + 0.5 * apart_deg, 35.0 - 0.5 * apart_deg
    return [
        CameraTable(
            name=name,
            position_mm=_at(elevation, azimuth),
            target_mm=tuple(MIDDLE_MM.tolist()),
            focal_px=scale * FOCAL_PX,
            size_px=size,
            roll_deg=roll_deg,
        )
        for name, elevation, azimuth in zip("ab", elevations, azimuths)
    ]


def _at(elevation_deg: float, azimuth_deg: float) -> tuple[float, float, float]:
    up, round_z = math.radians(elevation_deg), math.radians(azimuth_deg)
    way = [math.cos(up) * math.cos(round_z), math.cos(up) * math.sin(round_z), math.sin(up)]
    return tuple((MIDDLE_MM + AWAY_MM * np.array(way)).tolist())


def protocol(**changed) -> Protocol:
    """The usual scene with some keys of its trial, and tables, changed. before_deg is that of a scene's frames."""
    tables = {
        name: changed.pop(name) for name in ("cameras", "pictures", "whisker") if name in changed
    }
    given = {
        "beta_deg": 30.0,
        "d_x_mm": 60.0,
        "beta_scatter_deg": 0.0,
        "d_x_scatter_mm": 0.0,
    } | changed
    usual = {"cameras": cameras(), "pictures": PicturesTable(step_deg=0.7)}
    return Protocol(**usual | tables, trials=[TrialTable(**given)])


def pushed(push_deg: float) -> Protocol:
    """Frames from 2° before touch to this far after it, twelve in all."""
    pictures = PicturesTable(before_deg=1.6, after_deg=push_deg, step_deg=max(push_deg / 6.0, 0.05))
    return protocol(after_deg=max(push_deg, 0.1), pictures=pictures)


def touching_frames(count: float) -> Protocol:
    """So many frames that touch, half a degree apart, after four that do not."""
    return protocol(pictures=PicturesTable(before_deg=1.55, after_deg=0.5 * count, step_deg=0.5))


def cone(d_x_mm: float) -> Protocol:
    return protocol(whisker=WhiskerTable(shape="cone"), d_x_mm=d_x_mm)


def above_each_other(azimuth_deg: float) -> Protocol:
    """Both cameras in one plane with an upright bar."""
    return protocol(cameras=cameras(40.0, azimuths=(azimuth_deg, azimuth_deg)), beta_deg=0.0)


def apart(sights_deg: float) -> Protocol:
    """Cameras this far apart as seen from the whisker, at one height."""
    half = 0.5 * sights_deg / math.cos(math.radians(35.0))
    return protocol(cameras=cameras(0.0, azimuths=(-90.0 - half, -90.0 + half)))


def thick(wire_px: float) -> Protocol:
    return protocol(cameras=cameras(scale=wire_px * AWAY_MM / FOCAL_PX))


def wide(megapixels: float) -> Protocol:
    """A larger sensor behind the same lens: more round a wire that is as thick as before."""
    scale = math.sqrt(1e6 * megapixels / math.prod(SIZE_PX))
    size = tuple(int(round(scale * n)) for n in SIZE_PX)
    return protocol(cameras=[msgspec.structs.replace(camera, size_px=size) for camera in cameras()])


def filmed(rate_Hz: float) -> Protocol:
    """As fast as leaves 0.7° between frames, up to the 1500°/s that a whisk has; exposed for a tenth of a frame: up to
    2 kHz the same picture whatever the rate."""
    pictures = PicturesTable(rate_Hz=rate_Hz, exposure_s=0.1 / rate_Hz)
    return protocol(speed_deg_s=min(0.7 * rate_Hz, 1500.0), pictures=pictures)


def fast(speed_deg_s: float) -> Protocol:
    """0.7° between frames whatever the speed, exposed for a millisecond, or as long as they last."""
    exposure_s = min(0.001, 0.7 / speed_deg_s)
    return protocol(
        speed_deg_s=speed_deg_s, pictures=PicturesTable(step_deg=0.7, exposure_s=exposure_s)
    )


def noisy(snr: float) -> Protocol:
    pictures = PicturesTable(step_deg=0.7, grain=0.0, shot_noise=0.0, read_noise=_CONTRAST / snr)
    return protocol(pictures=pictures)


POINTS: Mapping[str, tuple[Callable[[float], Protocol], Sequence[float]]] = {
    "beta_deg": (lambda beta: protocol(beta_deg=beta), (-80, -70, 0, 60, 70, 75, 80, 85)),
    "psi_deg": (lambda psi: protocol(psi_deg=psi), (-60, -30, 30, 60)),
    "d_x_mm": (lambda d_x: protocol(d_x_mm=d_x), (5, 10, 15, 30, 80, 95, 99)),
    "cone_d_x_mm": (cone, (10, 30, 60, 80, 90, 95)),
    "push_deg": (pushed, (0.2, 0.5, 1, 2, 5, 10, 20)),
    "friction": (lambda mu: protocol(friction=mu), (0, 0.2, 0.6, 1.0, 2.5)),
    "sights_deg": (apart, (1, 2, 5, 10, 30, 60, 90, 120)),
    "noise_px": (lambda _: protocol(), (0.005, 0.05, 0.2, 0.5, 1.0)),
    "one_plane_deg": (above_each_other, (-150, -120, -90, -60)),
}
PAINTED: Mapping[str, tuple[Callable[[float], Protocol], Sequence[float]]] = {
    "wire_px": (thick, (1.0, 1.5, 2.5, 5.0, 10.0, 15.0)),
    "snr": (noisy, (3, 5, 10, 30, 100)),
    "blur_px": (
        lambda blur: protocol(pictures=PicturesTable(step_deg=0.7, blur_px=blur)),
        (0.3, 0.9, 2, 4),
    ),
    "bits": (
        lambda bits: protocol(pictures=PicturesTable(step_deg=0.7, bits=int(bits))),
        (8, 12, 16),
    ),
    "roll_deg": (lambda roll: protocol(cameras=cameras(roll_deg=roll)), (0, 45, 90)),
    "touching": (touching_frames, (1, 2, 3)),
    "push_painted_deg": (pushed, (0.2, 0.5, 20)),
    "beta_painted_deg": (lambda beta: protocol(beta_deg=beta), (-80, 70, 80, 85)),
    "d_x_painted_mm": (lambda d_x: protocol(d_x_mm=d_x), (5, 10, 95)),
    "sights_painted_deg": (apart, (1, 5, 20, 60, 120)),
    "one_plane_painted_deg": (above_each_other, (-120, -90)),
    "rate_Hz": (filmed, (1, 10000)),
    "speed_deg_s": (fast, (5, 50, 200, 500, 1500)),
    "megapixels": (wide, (0.3, 3, 8, 20)),
}

Look = Callable[[Scene], Seen]


@lru_cache(maxsize=1)
def scene_at(extreme: str, value: float, seed: int) -> Scene:
    """A scene of POINTS or PAINTED. Raises ArithmeticError where the rig has none."""
    made, _ = (POINTS | PAINTED)[extreme]
    sigmas = Sigmas(wire_px=value) if extreme == "noise_px" else Sigmas()
    return make_scene(made(value), sigmas, seed)


def scene_row(key: int, extreme: str, values: Sequence[float], see: Look) -> dict:
    """A row of the table; what keeps the rig from having such a scene is its status."""
    value, seed = values[key // _MOST_SEEDS], key % _MOST_SEEDS
    about = {"key": key, "value": float(value)}
    try:
        scene = scene_at(extreme, value, seed)
    except ArithmeticError as problem:
        return about | {"seed": seed, "status": f"the rig: {problem}"}
    try:
        seen = see(scene)
    except Refused as reason:
        seen = Seen({}, {}, str(reason))
    except np.linalg.LinAlgError as problem:
        seen = Seen({}, {}, f"the fit does not settle: {problem}")
    row = about | row_of(scene, _allowed(seen))
    return row | {"beta_sigma_deg": row.get("beta_deg_sigma", math.nan)}


def _allowed(seen: Seen) -> Seen:
    """Nothing where a trial would have none: a slope or slip that is not known."""
    if not seen.value:
        return seen
    if not seen.sigma["beta"] <= math.radians(_MOST_BETA_SIGMA_DEG):
        return Seen({}, {}, "the slope is not known")
    slip = np.asarray(seen.sigma["slip"])
    if np.any(slip[np.isfinite(slip)] > _MOST_SLIP_SIGMA_MM):
        return Seen({}, {}, "slip is not known")
    return seen


def lines(extreme: str, rows: Sequence[dict]) -> Iterator[str]:
    """A line a value: truths, intervals that hold, the largest z, error and sigma of d_x, and what is said else."""
    for value in dict.fromkeys(row["value"] for row in rows):
        mine = [row for row in rows if row["value"] == value]
        known = [row for row in mine if math.isfinite(row.get("d_x_mm_sigma", math.nan))]
        yield (
            f"{extreme} {value:g}: {len(known)} of {len(mine)} with a truth"
            + "".join(_numbers(known))
            + _said(mine)
        )


def _numbers(known: Sequence[dict]) -> Iterator[str]:
    if not known:
        return
    names = ("d_x_mm", "touch_deg", "beta_deg", "slip_mm")
    z = np.array(
        [[abs(row[f"{name}_error"] / row[f"{name}_sigma"]) for name in names] for row in known]
    )
    silent = sum(bool(np.nanmax(one) > _FAR_Z) and not row["status"] for one, row in zip(z, known))
    error, sigma = (
        np.array([row[f"d_x_mm_{what}"] for row in known]) for what in ("error", "sigma")
    )
    yield f", {100 * np.mean(z[np.isfinite(z)] < HALF_WIDTH_95):.0f} % of intervals hold, z {np.nanmax(z):.1f} at most"
    yield f", d_x {np.sqrt(np.mean(error**2)):.4f} mm off, {np.median(sigma):.4f} stated"
    if silent:
        yield f", {silent} off by more than {_FAR_Z:g} sigma without a word"


def _said(rows: Sequence[dict]) -> str:
    said = dict.fromkeys(row["status"].split(";")[0][:90] for row in rows if row["status"])
    return f" [{' | '.join(list(said)[:2])}]" if said else ""


def study(what: str, folder: Path, count: int, only: str = "") -> Iterator[str]:
    """All extremes of a way of looking, or one of them."""
    looks: dict[str, Look] = {"": see_points}
    if what == "painted":
        looks = {
            f" {name}": partial(see_pictures, settings=settings)
            for name, settings in PRESETS.items()
        }
    for extreme, (_, values) in (POINTS if what == "points" else PAINTED).items():
        if only in ("", extreme):
            rows = _rows(folder, extreme, values, count, looks)
            for name in looks:
                yield from lines(f"{extreme}{name}", rows[name])
            yield f"    {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB at most so far"


def _rows(
    folder: Path, extreme: str, values: Sequence[float], count: int, looks: Mapping[str, Look]
) -> dict:
    """Rows by the name of the look. Each scene is drawn once and seen by all."""
    rows = {}
    for key in (k * _MOST_SEEDS + seed for k in range(len(values)) for seed in range(count)):
        for name, see in looks.items():
            table = folder / f"{extreme}{name.replace(' ', '_')}.csv"
            make = partial(scene_row, extreme=extreme, values=values, see=see)
            rows[name] = all_rows(table, COLUMNS, [key], make)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("points", "painted"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=6)
    parser.add_argument("--only", default="", help="one extreme by its name")
    options = parser.parse_args()
    for line in study(options.what, options.folder, options.count, options.only):
        print(line, flush=True)


if __name__ == "__main__":
    main()
