"""The truth of a synthetic session: truth.json, and truth.csv and truth.toml of each trial."""

import functools
import json
import math
from collections.abc import Sequence

import numpy as np
import tomli_w

from bench.rig import build
from bench.rig.array_rig import MountedWhisker
from bench.rig.protocol import Protocol
from bench.rig.recording import Recording
from bench.rig.session_files import csv_text, object_keys
from bench.rig.surface_slip import COLUMNS, slips_mm

_HEADER = "frame,time_s,motor_deg,contact,x_mm,y_mm,z_mm,slip_mm,arc_mm,m_y_Nmm,m_z_Nmm,status"
_STATED_RAD = math.radians(3)  # pushing angle at which the slip is stated
_INSTANTS_RAD = math.radians(0.04)  # between which jumps are searched


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


def truth_csv(recording: Recording) -> str:
    """Return truth.csv, a row a frame; a frame at the angle of a jump has what came after it.

    The status is free, held, sliding or tip.
    """
    header = [_HEADER]
    if math.isfinite(recording.bar.stiffness_N_mm):
        header.append("gave_mm")
    if not recording.bar.is_straight:
        header += COLUMNS
    stroke_slips_mm = functools.cache(slips_mm)  # whisks of one friction are one object
    rows = []
    for frame, (time_s, motor_rad, number, back) in enumerate(recording.frames):
        times = _fixed([time_s, math.degrees(motor_rad)])
        contact = _contact_cells(recording.whisks[number], motor_rad, back, stroke_slips_mm)
        rows.append(",".join([str(frame), *times, *contact]))
    return csv_text(",".join(header), rows)


def _contact_cells(whisk, motor_rad, back, stroke_slips_mm) -> list[str]:
    """Return the cells of truth.csv about the contact at a motor angle of a stroke.

    stroke_slips_mm: gives the surface slips (n, 4) of a stroke of a whisk.
    """
    path = whisk.path(back)
    row = path.row_at(motor_rad)
    state = path.state_at(motor_rad)
    if state is None:
        cells = ["0", *_fixed([math.nan] * 5), *_fixed([0.0, 0.0]), "free"]
    else:
        slip = whisk.slip_mm(state.point_mm, motor_rad)
        values = [*state.point_mm, slip, state.arc_mm, *path.moment_Nmm[row]]
        cells = ["1", *_fixed(values), state.status]
    if math.isfinite(whisk.bar.stiffness_N_mm):
        cells += _fixed([np.linalg.norm(whisk.gave_mm(motor_rad, back))])
    if not whisk.bar.is_straight:
        slips = [math.nan] * len(COLUMNS) if state is None else stroke_slips_mm(whisk, back)[row]
        cells += _fixed(slips)
    return cells


def _fixed(values) -> list[str]:
    """Return numbers with six decimals."""
    return [f"{value:.6f}" for value in values]


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
        text += tomli_w.dumps({"object": object_keys(bar) | {"diameter_mm": 2 * bar.radius_mm}})
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
