"""The text files of any session: session.toml, trial.toml, frames.csv, signals.csv."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import tomli_w

from bench.rig.array_rig import ArrayRecording, MountedWhisker, base_keys
from bench.rig.elastic_rod import Rod
from bench.rig.protocol import Protocol, ProtocolRun
from bench.rig.protocol_tables import BoardTable
from bench.rig.recording import Recording
from bench.rig.touched_object import TouchedObject

# [points] Of a whisker's measured diameters. Stated.
_PROFILE_POINTS = 16


def board_keys(table: BoardTable) -> dict:
    """Return [board] of session.toml."""
    if not table.kind:
        return _fields(table, "squares square_mm marker_mm dictionary legacy inverted")
    if table.kind == "checkerboard":
        return _fields(table, "kind squares square_mm")
    return _fields(table, "kind squares square_mm marker_mm")


def session_toml(
    protocol: Protocol, stated_T_rig_board: np.ndarray, whiskers: Sequence[MountedWhisker] = ()
) -> str:
    """Return session.toml, with T_rig_board (3, 4) as someone would have measured it.

    What has no sigma there is exact: the rig is made from it.

    whiskers: of an array, in place of [whisker].
    """
    measured = [trial.surface for trial in protocol.trials if trial.purpose == "measure"]
    session = {
        "format": 1,
        "exact": True,
        "name": protocol.name,
        "surfaces": list(dict.fromkeys(measured)),
        "whisker": _whisker_keys(protocol),
        "bar": {"diameter_mm": protocol.bar_diameter_mm},
        "board": board_keys(protocol.board),
        "rig": _rig_keys(protocol, stated_T_rig_board),
    }
    if protocol.cameras:
        session["cameras"] = _camera_keys(protocol)
    session["trial"] = {"gauge_filter_Hz": protocol.gauges.filter_Hz}
    if protocol.stage:
        session["truth"] = {"source": "stage", "origin_sigma_mm": 0.0}
    if whiskers:
        session.pop("whisker")
        session["whiskers"] = _whiskers_keys(protocol, whiskers)
    elif protocol.gauges.known:
        session["gauges"] = _fields(protocol.gauges, "offset_V matrix_Nmm_per_V")
    return tomli_w.dumps(session)


def _whiskers_keys(protocol: Protocol, whiskers: Sequence[MountedWhisker]) -> list[dict]:
    """Return the tables [[whiskers]] of an array."""
    several_motors = len({whisker.column.name for whisker in whiskers}) > 1
    states_gauges = protocol.gauges.known or not _has_gauge_trials(protocol)
    tables = []
    for whisker in whiskers:
        tables.append(base_keys(whisker, several_motors, states_gauges=states_gauges))
    return tables


def _camera_keys(protocol: Protocol) -> list[dict]:
    """Return the tables [[cameras]]: of the cameras, then of their parts that show a mirror."""
    exposure_s = protocol.pictures.exposure_s
    own = [{"name": camera.name, "exposure_s": exposure_s} for camera in protocol.cameras]
    return own + [_mirror_keys(camera) for camera in protocol.cameras if camera.mirror]


def _mirror_keys(camera) -> dict:
    """Return the keys of the camera that a mirror makes."""
    mirror = camera.mirror
    return {"name": mirror.name, "of": camera.name, "crop": list(mirror.crop), "mirrored": True}


def _has_gauge_trials(protocol: Protocol) -> bool:
    """Return whether gauges are to be calibrated by trials of their own."""
    return any(trial.purpose == "gauge" for trial in protocol.trials)


def _fields(table, names: str) -> dict:
    """Return the named fields of a table."""
    return {name: getattr(table, name) for name in names.split()}


def _rounded(values, digits: int) -> list[float]:
    """Return numbers rounded to decimals."""
    return [round(float(value), digits) for value in values]


def _whisker_keys(protocol) -> dict:
    """Return the keys of [whisker]."""
    whisker = protocol.whisker
    names = "shape length_mm diameter_mm tip_diameter_mm youngs_modulus_GPa"
    if whisker.widths:
        names = "length_mm diameter_mm youngs_modulus_GPa"
    keys = _fields(whisker, names)
    stated = {name: value for name, value in keys.items() if value is not None}
    if whisker.widths:
        stated["profile"] = "profile.csv"
    if whisker.states_rest:
        per_mm = 2 / whisker.length_mm**2
        curvature = [per_mm * whisker.set_y_mm, per_mm * whisker.set_z_mm]
        stated["rest_curvature_per_mm"] = _rounded(curvature, 9)
    return stated


def _rig_keys(protocol, stated_T_rig_board) -> dict:
    """Return the keys of [rig]; a sigma of 0 is not stated."""
    pose = [_rounded(row, 9) for row in stated_T_rig_board]
    keys = {"T_rig_board": pose}
    for unit in ("mm", "deg"):
        sigma = getattr(protocol.board, f"pose_sigma_{unit}")
        if sigma:
            keys[f"T_rig_board_sigma_{unit}"] = sigma
    return keys


def profile_csv(rod: Rod) -> str:
    """Return profile.csv: diameters of the whisker from base to tip, as under a microscope."""
    arc_mm = np.linspace(0.0, rod.length_mm, _PROFILE_POINTS)
    diameters_mm = 2.0 * rod.radius_mm(arc_mm)
    rows = [f"{arc:.4f},{across:.6f}" for arc, across in zip(arc_mm, diameters_mm)]
    return "\n".join(["arc_mm,diameter_mm", *rows, ""])


def trial_toml(recording: Recording, *, by_stage: bool = False) -> str:
    """Return trial.toml of a recording. by_stage: distance and slope are stated with their sigmas."""
    run = recording.run
    table = run.table
    trial = {
        "surface": table.surface,
        "speed_deg_s": float(run.speed_deg_s),
        "beta_deg": float(run.beta_deg),
        "d_x_mm": float(run.d_x_mm),
        "purpose": table.purpose,
    }
    if by_stage:
        trial["d_x_sigma_mm"] = table.d_x_scatter_mm
        trial["beta_sigma_deg"] = table.beta_scatter_deg
    if table.rotations:
        trial["contact"] = run.contact
        trial["plane_turn_deg"] = round(run.plane_turn_deg, 6)
    trial |= _bar_keys(run)
    if table.both_ways:
        trial["both_ways"] = True
    if recording.stated_velocity_mm_s is not None:
        trial["object_velocity_mm_s"] = _rounded(recording.stated_velocity_mm_s, 6)
        trial["object_velocity_sigma_mm_s"] = table.object_velocity_sigma_mm_s or 0.0
    if table.stiffness_N_mm:
        trial["object_gives_way"] = True
    trial |= _follicle_keys(run)
    if not recording.bar.is_straight:
        trial["object"] = {"shape": recording.bar.shape} | recording.bar.size_keys()
    return tomli_w.dumps(trial)


def array_trial_toml(recording: ArrayRecording, *, says_where: bool = True) -> str:
    """Return trial.toml of an array's recording, without the slope and distance of any one whisker.

    says_where: where the object stands, too, as people know it who take no pictures.
    """
    run = recording.run
    bar = recording.bar
    trial = {
        "surface": run.table.surface,
        "speed_deg_s": float(run.speed_deg_s),
        "purpose": run.table.purpose,
    }
    trial |= _bar_keys(run) | _follicle_keys(run)
    if says_where:
        trial["object"] = object_keys(bar)
    elif not bar.is_straight:
        trial["object"] = {"shape": bar.shape} | bar.size_keys()
    return tomli_w.dumps(trial)


def _bar_keys(run: ProtocolRun) -> dict:
    """Return the trial's own diameter of the object, where it has one."""
    diameter_mm = run.table.bar_diameter_mm
    return {"bar_diameter_mm": diameter_mm} if diameter_mm else {}


def _follicle_keys(run: ProtocolRun) -> dict:
    """Return by how much the follicle is turned in a gauge trial."""
    table = run.table
    return {"follicle_roll_deg": table.follicle_roll_deg} if table.purpose == "gauge" else {}


def object_keys(bar: TouchedObject) -> dict:
    """Return [object]: what it is, where it stands, and how large it is."""
    return {"shape": bar.shape} | bar.place_keys() | bar.size_keys()


def frames_csv(times_s: Iterable[float], clock_offset_s: float) -> str:
    """Return frames.csv, by a clock that is late by `clock_offset_s`."""
    lines = [f"{i},{time - clock_offset_s:.6f}" for i, time in enumerate(times_s)]
    return csv_text("frame,time_s", lines)


def signals_csv(recording: Recording) -> str:
    """Return signals.csv of a recording."""
    return _signals_csv(recording.channels, recording.signals)


def array_signals_csv(recording: ArrayRecording) -> str:
    """Return signals.csv of an array's recording."""
    return _signals_csv(recording.channels, np.column_stack(list(recording.channels.values())))


def _signals_csv(names: Iterable[str], samples: np.ndarray) -> str:
    """Return the text of samples (n, names)."""
    formats = ["%.5f" if name.startswith("motor_deg") else "%.6f" for name in names]
    form = ",".join(formats)
    return csv_text(",".join(names), [form % tuple(row) for row in samples.tolist()])


def csv_text(header: str, rows: Iterable[str]) -> str:
    """Return the text of a table."""
    return "\n".join([header, *rows]) + "\n"


def write(path: Path, text: str) -> None:
    """Write UTF-8 with plain newlines on every system."""
    path.write_bytes(text.encode())
