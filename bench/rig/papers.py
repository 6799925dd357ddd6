"""The text files of a session: what its people write, and the truth that only a synthetic one has."""

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import tomli_w

from bench.rig import build
from bench.rig.array_rig import ArrayRecording, Mounted, base_keys
from bench.rig.bar import Bar
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.round_objects import Cone, Ring, Sphere
from bench.rig.surface_slip import COLUMNS, slips_mm

_GAUGED, _FORCES = ("time_s", "motor_deg", "y_V", "z_V"), ("f_x_N", "f_y_N", "f_z_N")
_TRUTH = "frame,time_s,motor_deg,contact,x_mm,y_mm,z_mm,slip_mm,arc_mm,m_y_Nmm,m_z_Nmm,status"


def session_toml(
    protocol: Protocol, stated_T_rig_board: np.ndarray, whiskers: Sequence[Mounted] = ()
) -> str:
    """session.toml, with T_rig_board (3, 4) as someone would have measured it. whiskers: of an array."""
    w, b, g = protocol.whisker, protocol.board, protocol.gauges
    rig = {"T_rig_board": [[round(float(x), 9) for x in row] for row in stated_T_rig_board]}
    for unit, sigma in (("mm", b.pose_sigma_mm), ("deg", b.pose_sigma_deg)):
        if sigma:
            rig[f"T_rig_board_sigma_{unit}"] = sigma
    cameras = [
        {"name": c.name, "exposure_s": protocol.pictures.exposure_s} for c in protocol.cameras
    ]
    session = {
        "format": 1,
        "name": protocol.name,
        "surfaces": list(
            dict.fromkeys(t.surface for t in protocol.trials if t.purpose == "measure")
        ),
        "whisker": {
            "shape": w.shape,
            "length_mm": w.length_mm,
            "diameter_mm": w.diameter_mm,
            **({"tip_diameter_mm": w.tip_diameter_mm} if w.tip_diameter_mm else {}),
            "youngs_modulus_GPa": w.youngs_modulus_GPa,
        },
        "bar": {"diameter_mm": protocol.bar_diameter_mm},
        "board": {
            "squares": list(b.squares),
            "square_mm": b.square_mm,
            "marker_mm": b.marker_mm,
            "dictionary": b.dictionary,
            "legacy": b.legacy,
            "inverted": b.inverted,
        },
        "rig": rig,
        **({"cameras": cameras} if cameras else {}),
        "trial": {"gauge_filter_Hz": g.filter_Hz},
    }
    if whiskers:
        session.pop("whisker")
        several = len({w.column.name for w in whiskers}) > 1
        session["whiskers"] = [base_keys(whisker, several) for whisker in whiskers]
    elif g.known:
        session["gauges"] = {
            "offset_V": list(g.offset_V),
            "matrix_Nmm_per_V": [list(r) for r in g.matrix_Nmm_per_V],
        }
    return tomli_w.dumps(session)


def truth_json(protocol: Protocol, seed: int, whiskers: Sequence[Mounted] = ()) -> str:
    """Exact cameras, board pose, gauges and friction; the seed and the protocol's fingerprint. whiskers: of an array,
    whose gauges are each one's own."""
    cameras = {
        c.name: {
            "name": c.name,
            "K": c.matrix.tolist(),
            "dist": c.distortion.tolist(),
            "width": c.size_px[0],
            "height": c.size_px[1],
            "R": c.rotation.tolist(),
            "t": c.translation_mm.tolist(),
        }
        for c in build.cameras(protocol)
    }
    alphas = sorted(
        {
            (_alpha_deg(t.static_friction, t.friction), _alpha_deg(t.friction))
            for t in protocol.trials
        }
    )
    truth = {
        "cameras": cameras,
        "T_rig_board": [*build.T_rig_board(protocol).tolist(), [0.0, 0.0, 0.0, 1.0]],
        "gauge_matrix_Nmm_per_V": protocol.gauges.matrix_Nmm_per_V,
        "gauge_offset_V": protocol.gauges.offset_V,
        "E_GPa": protocol.whisker.youngs_modulus_GPa,
        "alpha_deg": list(alphas[0]) if len(alphas) == 1 else [list(a) for a in alphas],
        "clock_offset_s": protocol.pictures.clock_offset_s,
        "seed": seed,
        "protocol": protocol.fingerprint(),
    }
    if whiskers:
        own = ("gauge_matrix_Nmm_per_V", "gauge_offset_V")
        for key in own:
            truth.pop(key)
        truth["whiskers"] = {
            w.name: dict(zip(own, (w.gauges.matrix_Nmm_per_V.tolist(), w.gauges.offset_V.tolist())))
            for w in whiskers
        }
    return json.dumps(truth, indent=1) + "\n"


def _alpha_deg(*coefficients):
    return math.degrees(math.atan(next(c for c in coefficients if c is not None)))


def trial_toml(recording: Recording) -> str:
    """trial.toml of a recording."""
    run, table = recording.run, recording.run.table
    trial = {
        "surface": table.surface,
        "speed_deg_s": float(run.speed_deg_s),
        "beta_deg": float(run.beta_deg),
        "d_x_mm": float(run.d_x_mm),
        "purpose": table.purpose,
    }
    if table.bar_diameter_mm:
        trial["bar_diameter_mm"] = table.bar_diameter_mm
    if table.both_ways:
        trial["both_ways"] = True
    if recording.stated_velocity_mm_s is not None:
        trial["object_velocity_mm_s"] = [round(float(v), 6) for v in recording.stated_velocity_mm_s]
        trial["object_velocity_sigma_mm_s"] = table.object_velocity_sigma_mm_s or 0.0
    if table.stiffness_N_mm:
        trial["object_gives_way"] = True
    if table.purpose == "gauge":
        trial["follicle_roll_deg"] = table.follicle_roll_deg
    return tomli_w.dumps(trial | _said_object(recording.bar, says_where=False))


def frames_csv(times_s: Iterable[float], clock_offset_s: float) -> str:
    """frames.csv, by a clock that is late by so much."""
    lines = [f"{i},{time - clock_offset_s:.6f}" for i, time in enumerate(times_s)]
    return "\n".join(["frame,time_s", *lines]) + "\n"


def signals_csv(recording: Recording) -> str:
    """signals.csv of a recording: gauges, V, and the load cell's forces, N, where there is one."""
    has_forces = recording.signals.shape[1] > len(_GAUGED)
    form = ",".join(["%.6f", "%.5f", *["%.6f"] * (recording.signals.shape[1] - 2)])
    lines = [form % tuple(row) for row in recording.signals.tolist()]
    return "\n".join([",".join(_GAUGED + _FORCES * has_forces), *lines]) + "\n"


def array_trial_toml(recording: ArrayRecording, *, says_where: bool = True) -> str:
    """trial.toml of an array's recording: slope and distance are not those of any one whisker. says_where: where the
    object stands, too, as people know it who take no pictures."""
    run, table = recording.run, recording.run.table
    trial = {
        "surface": table.surface,
        "speed_deg_s": float(run.speed_deg_s),
        "purpose": table.purpose,
    }
    if table.bar_diameter_mm:
        trial["bar_diameter_mm"] = table.bar_diameter_mm
    return tomli_w.dumps(trial | _said_object(recording.bar, says_where=says_where))


def _said_object(bar: Bar, *, says_where: bool) -> dict:
    """[object] of trial.toml: nothing of a straight bar whose place is not said."""
    return (
        {"object": _object(bar, says_where=says_where)}
        if says_where or type(bar) is not Bar
        else {}
    )


def _object(bar: Bar, *, says_where: bool = True) -> dict:
    """What it is and where it stands, as [object] has it."""
    shape, point, sizes = "bar", bar.point_mm, {}
    if isinstance(bar, Sphere):
        shape = "sphere"
    if isinstance(bar, Cone):
        shape, point, sizes = (
            "cone",
            bar.tip_mm,
            {"half_angle_deg": math.degrees(bar.half_angle_rad)},
        )
    if isinstance(bar, Ring):
        shape, sizes = "ring", {"ring_diameter_mm": 2 * bar.ring_radius_mm}
    where = {"point_mm": point.tolist()} | (
        {} if shape == "sphere" else {"axis": bar.axis.tolist()}
    )
    return {"shape": shape} | (where if says_where else {}) | sizes


def array_signals_csv(recording: ArrayRecording) -> str:
    """signals.csv of an array's recording."""
    form = ",".join(
        "%.5f" if name.startswith("motor_deg") else "%.6f" for name in recording.channels
    )
    lines = [
        form % tuple(row) for row in np.column_stack(list(recording.channels.values())).tolist()
    ]
    return "\n".join([",".join(recording.channels), *lines]) + "\n"


def truth_csv(recording: Recording) -> str:
    """A row a frame. A frame at the angle of a jump shows what came after it. `status`: free, held, sliding or tip."""
    slips = {}
    if type(recording.bar) is not Bar:
        ways = (False, True)[: 1 + (recording.whisks[0].back is not None)]
        slips = {
            (id(whisk), back): slips_mm(whisk, back) for whisk in recording.whisks for back in ways
        }
    rows = (
        _truth_row(i, recording.whisks[w], t, m, back, slips.get((id(recording.whisks[w]), back)))
        for i, (t, m, w, back) in enumerate(recording.frames)
    )
    names = [*("gave_mm",) * math.isfinite(recording.bar.stiffness_N_mm), *COLUMNS * bool(slips)]
    return "\n".join([",".join([_TRUTH, *names]), *rows]) + "\n"


def _truth_row(frame, whisk, time_s, motor_rad, back, slips=None):
    """slips (n, 4): of the whisk's way, where the object is rounded."""
    way = whisk.way(back)
    state = way.state_at(motor_rad)
    if state is None:
        values = [*[math.nan] * 5, 0.0, 0.0]
    else:
        moment = way.moment_Nmm[way.row_at(motor_rad)]
        values = [
            *state.point_mm,
            float(whisk.slip_mm(state.point_mm, motor_rad)),
            state.arc_mm,
            *moment,
        ]
    first, rest = (
        ",".join(f"{v:.6f}" for v in part) for part in ([time_s, math.degrees(motor_rad)], values)
    )
    status = "free" if state is None else state.status
    gave = np.linalg.norm(whisk.gave_mm(motor_rad, back))
    more = [gave] if math.isfinite(whisk.bar.stiffness_N_mm) else []
    if slips is not None:
        more += [math.nan] * 4 if state is None else [*slips[way.row_at(motor_rad)]]
    return ",".join(
        [f"{frame},{first},{int(state is not None)},{rest},{status}", *(f"{v:.6f}" for v in more)]
    )


def truth_toml(recording: Recording) -> str:
    """One value a key, or a list where the recording holds several whisks; and what is touched, where it is rounded."""
    values = [_whisk_truth(whisk) for whisk in recording.whisks]
    lines = []
    for key in values[0]:
        texts = [f"{v[key]:.6f}" for v in values]
        lines.append(f"{key} = {texts[0] if len(texts) == 1 else '[' + ', '.join(texts) + ']'}")
    return "\n".join(lines) + "\n" + _true_object(recording.bar)


def _true_object(bar: Bar) -> str:
    """[object] of truth.toml: shape, size and where it stands at first touch; nothing of a straight bar."""
    if type(bar) is Bar:
        return ""
    return "\n" + tomli_w.dumps({"object": _object(bar) | {"diameter_mm": 2 * bar.radius_mm}})


def _whisk_truth(whisk):
    beta, psi = whisk.bar.slope(whisk.touch.motor_rad, whisk.touch.point_mm)
    return {
        "touch_deg": math.degrees(whisk.touch.motor_rad),
        "d_x_mm": whisk.touch.d_x_mm,
        "beta_deg": math.degrees(beta),
        "psi_deg": math.degrees(psi),
        "slip_at_3deg_mm": float(whisk.slip_at(math.radians(3))),
        "slip_jump_mm": _largest_jump_mm(whisk),
        "mu_static": whisk.friction.static,
        "mu_kinetic": whisk.friction.kinetic,
        "stiffness_N_mm": whisk.bar.stiffness_N_mm,
    }


def _largest_jump_mm(whisk):
    """The largest change of slip between instants 0.04° apart, so that smooth slip counts for little."""
    theta = np.arange(0, whisk.forward.motor_rad[-1] - whisk.touch.motor_rad, math.radians(0.04))
    return float(np.nanmax(np.abs(np.diff(whisk.slip_at(theta))), initial=0.0))


def write(path: Path, text: str) -> None:
    """UTF-8 with plain newlines on every system."""
    path.write_bytes(text.encode())
