"""The text files of a session: what its people write, and the truth that only a synthetic one has."""

import functools
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import tomli_w

from bench.rig import build
from bench.rig.array_rig import ArrayRecording, MountedWhisker, base_keys
from bench.rig.protocol import Protocol, Run
from bench.rig.recording import Recording
from bench.rig.surface_slip import COLUMNS, slips_mm
from bench.rig.touched_object import TouchedObject

_GAUGES = ("time_s", "motor_deg", "y_V", "z_V")
_FORCES = ("f_x_N", "f_y_N", "f_z_N")
_TRUTH = "frame,time_s,motor_deg,contact,x_mm,y_mm,z_mm,slip_mm,arc_mm,m_y_Nmm,m_z_Nmm,status"
_STATED_RAD = math.radians(3)  # pushing angle at which the slip is stated
_INSTANTS_RAD = math.radians(0.04)  # between which jumps are searched


def session_toml(
    protocol: Protocol, stated_T_rig_board: np.ndarray, whiskers: Sequence[MountedWhisker] = ()
) -> str:
    """Return session.toml, with T_rig_board (3, 4) as someone would have measured it.

    whiskers: of an array, in place of [whisker].
    """
    measured = [trial.surface for trial in protocol.trials if trial.purpose == "measure"]
    session = {
        "format": 1,
        "name": protocol.name,
        "surfaces": list(dict.fromkeys(measured)),
        "whisker": _whisker_keys(protocol),
        "bar": {"diameter_mm": protocol.bar_diameter_mm},
        "board": _fields(
            protocol.board,
            "squares square_mm marker_mm dictionary legacy inverted",
        ),
        "rig": _rig_keys(protocol, stated_T_rig_board),
    }
    if protocol.cameras:
        exposure_s = protocol.pictures.exposure_s
        session["cameras"] = [
            {"name": camera.name, "exposure_s": exposure_s} for camera in protocol.cameras
        ]
    session["trial"] = {"gauge_filter_Hz": protocol.gauges.filter_Hz}
    if whiskers:
        session.pop("whisker")
        several_motors = len({whisker.column.name for whisker in whiskers}) > 1
        session["whiskers"] = [base_keys(whisker, several_motors) for whisker in whiskers]
    elif protocol.gauges.known:
        session["gauges"] = _fields(protocol.gauges, "offset_V matrix_Nmm_per_V")
    return tomli_w.dumps(session)


def _fields(table, names: str) -> dict:
    """Return the named fields of a table."""
    return {name: getattr(table, name) for name in names.split()}


def _rounded(values, digits: int) -> list[float]:
    """Return numbers rounded to decimals."""
    return [round(float(value), digits) for value in values]


def _whisker_keys(protocol) -> dict:
    """Return the keys of [whisker]."""
    keys = _fields(
        protocol.whisker, "shape length_mm diameter_mm tip_diameter_mm youngs_modulus_GPa"
    )
    return {name: value for name, value in keys.items() if value is not None}


def _rig_keys(protocol, stated_T_rig_board) -> dict:
    """Return the keys of [rig]; a sigma of 0 is not stated."""
    pose = [_rounded(row, 9) for row in stated_T_rig_board]
    keys = {"T_rig_board": pose}
    for unit in ("mm", "deg"):
        sigma = getattr(protocol.board, f"pose_sigma_{unit}")
        if sigma:
            keys[f"T_rig_board_sigma_{unit}"] = sigma
    return keys


def truth_json(protocol: Protocol, seed: int, whiskers: Sequence[MountedWhisker] = ()) -> str:
    """Return truth.json: exact cameras, board pose, gauges and friction; the seed and the
    protocol's fingerprint.

    whiskers: of an array, whose gauges are each one's own.
    """
    cameras = {}
    for camera in build.cameras(protocol):
        cameras[camera.name] = {
            "name": camera.name,
            "K": camera.matrix.tolist(),
            "dist": camera.distortion.tolist(),
            "width": camera.size_px[0],
            "height": camera.size_px[1],
            "R": camera.rotation.tolist(),
            "t": camera.translation_mm.tolist(),
        }
    alphas = sorted({_alphas_deg(trial) for trial in protocol.trials})
    truth = {
        "cameras": cameras,
        "T_rig_board": [*build.T_rig_board(protocol).tolist(), [0.0, 0.0, 0.0, 1.0]],
    }
    if not whiskers:
        truth |= _gauge_keys(protocol.gauges)
    truth |= {
        "E_GPa": protocol.whisker.youngs_modulus_GPa,
        "alpha_deg": alphas[0] if len(alphas) == 1 else alphas,
        "clock_offset_s": protocol.pictures.clock_offset_s,
        "seed": seed,
        "protocol": protocol.fingerprint(),
    }
    if whiskers:
        truth["whiskers"] = {whisker.name: _gauge_keys(whisker.gauges) for whisker in whiskers}
    return json.dumps(truth, indent=1) + "\n"


def _gauge_keys(gauges) -> dict:
    """Return the gauges' coefficients as truth.json has them."""
    return {
        "gauge_matrix_Nmm_per_V": gauges.matrix_Nmm_per_V,
        "gauge_offset_V": gauges.offset_V,
    }


def _alphas_deg(trial) -> tuple[float, float]:
    """Return the friction angles at rest and in motion."""
    static = trial.friction if trial.static_friction is None else trial.static_friction
    return math.degrees(math.atan(static)), math.degrees(math.atan(trial.friction))


def trial_toml(recording: Recording) -> str:
    """Return trial.toml of a recording."""
    run = recording.run
    table = run.table
    trial = {
        "surface": table.surface,
        "speed_deg_s": float(run.speed_deg_s),
        "beta_deg": float(run.beta_deg),
        "d_x_mm": float(run.d_x_mm),
        "purpose": table.purpose,
    }
    trial |= _bar_keys(run)
    if table.both_ways:
        trial["both_ways"] = True
    if recording.stated_velocity_mm_s is not None:
        trial["object_velocity_mm_s"] = _rounded(recording.stated_velocity_mm_s, 6)
        trial["object_velocity_sigma_mm_s"] = table.object_velocity_sigma_mm_s or 0.0
    if table.stiffness_N_mm:
        trial["object_gives_way"] = True
    if table.purpose == "gauge":
        trial["follicle_roll_deg"] = table.follicle_roll_deg
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
    trial |= _bar_keys(run)
    if says_where:
        trial["object"] = _object_keys(bar)
    elif not bar.is_straight:
        trial["object"] = {"shape": bar.shape} | bar.size_keys()
    return tomli_w.dumps(trial)


def _bar_keys(run: Run) -> dict:
    """Return the trial's own diameter of the object, where it has one."""
    diameter_mm = run.table.bar_diameter_mm
    return {"bar_diameter_mm": diameter_mm} if diameter_mm else {}


def _object_keys(bar: TouchedObject) -> dict:
    """Return [object]: what it is, where it stands, and how large it is."""
    return {"shape": bar.shape} | bar.place_keys() | bar.size_keys()


def frames_csv(times_s: Iterable[float], clock_offset_s: float) -> str:
    """Return frames.csv, by a clock that is late by `clock_offset_s`."""
    lines = [f"{i},{time - clock_offset_s:.6f}" for i, time in enumerate(times_s)]
    return _csv("frame,time_s", lines)


def signals_csv(recording: Recording) -> str:
    """Return signals.csv of a recording: gauges, V, and the load cell's forces, N, where there is
    one."""
    names = _GAUGES + _FORCES
    return _signals_csv(names[: recording.signals.shape[1]], recording.signals)


def array_signals_csv(recording: ArrayRecording) -> str:
    """Return signals.csv of an array's recording."""
    return _signals_csv(recording.channels, np.column_stack(list(recording.channels.values())))


def _signals_csv(names: Iterable[str], samples: np.ndarray) -> str:
    """Return the text of samples (n, names)."""
    formats = ["%.5f" if name.startswith("motor_deg") else "%.6f" for name in names]
    form = ",".join(formats)
    return _csv(",".join(names), [form % tuple(row) for row in samples.tolist()])


def truth_csv(recording: Recording) -> str:
    """Return truth.csv, a row a frame; a frame at the angle of a jump has what came after it.

    The status is free, held, sliding or tip.
    """
    is_soft = math.isfinite(recording.bar.stiffness_N_mm)
    is_straight = recording.bar.is_straight
    header = [_TRUTH]
    header += ["gave_mm"] if is_soft else []
    header += [] if is_straight else COLUMNS
    way_slips_mm = functools.cache(slips_mm)  # whisks of one friction are one object
    rows = []
    for frame, (time_s, motor_rad, number, back) in enumerate(recording.frames):
        whisk = recording.whisks[number]
        way = whisk.way(back)
        state = way.state_at(motor_rad)
        row = way.row_at(motor_rad)
        values = [math.nan, math.nan, math.nan, math.nan, math.nan, 0.0, 0.0]
        if state is not None:
            slip = whisk.slip_mm(state.point_mm, motor_rad)
            values = [*state.point_mm, slip, state.arc_mm, *way.moment_Nmm[row]]
        cells = [str(frame), *_fixed([time_s, math.degrees(motor_rad)])]
        cells += [str(int(state is not None)), *_fixed(values)]
        cells.append("free" if state is None else state.status)
        if is_soft:
            cells += _fixed([np.linalg.norm(whisk.gave_mm(motor_rad, back))])
        if not is_straight:
            free = [math.nan] * len(COLUMNS)
            cells += _fixed(free if state is None else way_slips_mm(whisk, back)[row])
        rows.append(",".join(cells))
    return _csv(",".join(header), rows)


def _fixed(values) -> list[str]:
    """Return numbers with six decimals."""
    return [f"{value:.6f}" for value in values]


def _csv(header: str, rows: Iterable[str]) -> str:
    """Return the text of a table."""
    return "\n".join([header, *rows]) + "\n"


def truth_toml(recording: Recording) -> str:
    """Return truth.toml: a value a key, or a list where the recording holds several whisks; and
    what is touched, where it is no straight bar."""
    truths = [_whisk_truth(whisk) for whisk in recording.whisks]
    lines = []
    for key in truths[0]:
        texts = _fixed([truth[key] for truth in truths])
        lines.append(f"{key} = {texts[0] if len(texts) == 1 else '[' + ', '.join(texts) + ']'}")
    text = "\n".join(lines) + "\n"
    bar = recording.bar
    if not bar.is_straight:
        text += "\n"
        text += tomli_w.dumps({"object": _object_keys(bar) | {"diameter_mm": 2 * bar.radius_mm}})
    return text


def _whisk_truth(whisk) -> dict[str, float]:
    """Return the values of one whisk in truth.toml."""
    beta, psi = whisk.slope
    return {
        "touch_deg": math.degrees(whisk.touch.motor_rad),
        "d_x_mm": whisk.touch.d_x_mm,
        "beta_deg": math.degrees(beta),
        "psi_deg": math.degrees(psi),
        "slip_at_3deg_mm": float(whisk.slip_at(_STATED_RAD)),
        "slip_jump_mm": _largest_jump_mm(whisk),
        "mu_static": whisk.friction.static,
        "mu_kinetic": whisk.friction.kinetic,
        "stiffness_N_mm": whisk.bar.stiffness_N_mm,
    }


def _largest_jump_mm(whisk) -> float:
    """Return the largest change of slip between close instants, so that smooth slip counts for
    little."""
    theta = np.arange(0, whisk.forward.motor_rad[-1] - whisk.touch.motor_rad, _INSTANTS_RAD)
    return float(np.nanmax(np.abs(np.diff(whisk.slip_at(theta))), initial=0.0))


def write(path: Path, text: str) -> None:
    """Write UTF-8 with plain newlines on every system."""
    path.write_bytes(text.encode())
