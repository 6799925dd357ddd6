"""What a protocol may ask of the rig."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from bench.base.errors import BadInput
from bench.rig.elastic_rod import RestShape

if TYPE_CHECKING:
    from bench.rig.protocol import Protocol, ProtocolRun

# As far as the march finds its way (docs/extremes.md): at a slope of 89.5° it does, at a tilt of 85°
# it does not.
_STEEPEST_DEG, _MOST_TILT_DEG, _NEAREST = 89.0, 80.0, 0.02
# Of the whisker's own speed at the contact: a bar that runs away as fast is never touched.
_FASTEST_SHARE = 0.5
# Of a cone: with less its tip is out of any rig, with more it is hardly any cone.
_SLIMMEST_DEG, _BLUNTEST_DEG = 1.0, 75.0


def check_protocol(protocol: "Protocol", path: Path) -> None:
    """Raise BadInput, naming the file, for what no rig can do, or what its mechanics here do not
    cover."""
    try:
        _check_rest(protocol.whisker)
        _check_cameras(protocol)
        _check_columns(protocol)
        _check_microphone(protocol)
        for run in protocol.runs():
            _check_run(run)
            _check_object(run)
            _check_moving(run)
            _check_rotations(run)
    except ValueError as problem:
        raise BadInput(str(problem), file=path) from None


def _check_rest(whisker):
    """Raise ValueError for an unloaded whisker that turns back."""
    RestShape(whisker.length_mm, whisker.sag_mm, whisker.set_y_mm, whisker.set_z_mm)


def _check_cameras(protocol):
    """Raise ValueError for cameras' names, half a focal length, or light without direction."""
    names = [camera.name for camera in protocol.cameras]
    names += [camera.mirror.name for camera in protocol.cameras if camera.mirror]
    if len(set(names)) < len(names) or "rig" in names:
        raise ValueError(f"cameras need names of their own, none of them 'rig'; found {names}")
    for camera in protocol.cameras:
        if (camera.focal_mm is None) != (camera.pixel_um is None):
            raise ValueError(f"camera {camera.name}: focal_mm and pixel_um go together")
    if math.isclose(math.hypot(*protocol.light.towards), 0):
        raise ValueError("light: towards is a direction, not zero")


def _check_columns(protocol):
    """Raise ValueError for columns' names, or sizes that are not one for all or one a height."""
    columns = protocol.columns or []
    names = [column.name for column in columns]
    if len(set(names)) < len(names):
        raise ValueError(f"[[columns]] need names of their own; found {names}")
    for column in columns:
        count = len(column.heights_mm)
        for key in ("length_mm", "diameter_mm"):
            given = getattr(column, key)
            if isinstance(given, list) and len(given) != count:
                found = f"{key} has {len(given)} values, heights_mm {count}"
                raise ValueError(
                    f"[[columns]] {column.name}: {found}; one for all, or one a height"
                )


def _check_microphone(protocol):
    """Raise ValueError for a microphone at an array, or a band that no samples hold."""
    if not protocol.microphone:
        return
    if protocol.columns:
        raise ValueError("[microphone] is simulated at one whisker; leave out [[columns]]")
    low_Hz, high_Hz = protocol.microphone.band_Hz
    highest_Hz = protocol.gauges.rate_Hz / 2
    if not 0 < low_Hz < high_Hz < highest_Hz:
        found = f"[microphone] band_Hz {low_Hz:g} to {high_Hz:g}"
        raise ValueError(f"{found}; rising, above 0 and below {highest_Hz:g} is allowed")


def _check_run(run: "ProtocolRun"):
    """Raise ValueError for a trial's angles, distance, speed and stroke."""
    if not (abs(run.beta_deg) <= _STEEPEST_DEG and abs(run.psi_deg) <= _MOST_TILT_DEG):
        allowed = f"±{_STEEPEST_DEG:g} and ±{_MOST_TILT_DEG:g} are allowed"
        raise ValueError(f"beta_deg {run.beta_deg:g}, psi_deg {run.psi_deg:g}; {allowed}")
    length_mm = run.protocol.whisker.length_mm
    if not _NEAREST * length_mm <= run.d_x_mm <= 1.05 * length_mm:
        raise ValueError(
            f"d_x_mm {run.d_x_mm:g} is outside {_NEAREST:g} to 1.05 of the whisker's length"
        )
    if not 0.01 <= run.speed_deg_s <= 2000:
        raise ValueError(f"speed_deg_s {run.speed_deg_s:g}; 0.01 to 2000 is allowed")
    if not 0.1 <= run.before_deg <= 90 or not 0.1 <= run.after_deg <= 25:
        found = f"found {run.before_deg:g} and {run.after_deg:g}"
        raise ValueError(
            f"the motor's before_deg is 0.1 to 90 and its after_deg 0.1 to 25; {found}"
        )
    pictures = run.protocol.pictures
    if pictures.before_deg > run.before_deg or pictures.after_deg > run.after_deg:
        raise ValueError("pictures: before_deg and after_deg are at most the motor's")


def _check_object(run: "ProtocolRun"):
    """Raise ValueError for sizes that are not the object's, or friction that grows in motion."""
    table = run.table
    for key, shape in (("ring_diameter_mm", "ring"), ("cone_half_angle_deg", "cone")):
        if (table.object == shape) != bool(getattr(table, key)):
            raise ValueError(f'{key} belongs to object = "{shape}", and to no other')
    half_angle_deg = table.cone_half_angle_deg
    if half_angle_deg and not _SLIMMEST_DEG <= half_angle_deg <= _BLUNTEST_DEG:
        allowed = f"{_SLIMMEST_DEG:g} to {_BLUNTEST_DEG:g} is allowed"
        raise ValueError(f"cone_half_angle_deg {half_angle_deg:g}; {allowed}")
    static = table.static_friction
    if static is not None and static < table.friction:
        raise ValueError(f"static_friction {static:g} is below friction {table.friction:g}")


def _check_moving(run: "ProtocolRun"):
    """Raise ValueError for an object that moves otherwise than with the motor's steady motion, by
    which the march goes."""
    velocity = run.table.object_velocity_mm_s
    if not velocity:
        return
    key = "object_velocity_mm_s: "
    moves = key + "an object that moves is "
    motor = run.protocol.motor
    if run.goes_back or motor.ramp_s or motor.pause_s:
        raise ValueError(f"{moves}simulated for single forward strokes without ramps and pauses")
    if run.protocol.columns:
        raise ValueError(f"{moves}simulated for one whisker")
    if run.table.stiffness_N_mm:
        raise ValueError(f"{moves}rigid; leave out stiffness_N_mm")
    speed = math.hypot(*velocity)
    fastest = _FASTEST_SHARE * math.radians(run.speed_deg_s) * run.d_x_mm
    if not speed <= fastest:
        allowed = f"{fastest:.3g} is allowed: half the whisker's own where it touches"
        raise ValueError(f"{key}{speed:.3g} mm/s, {allowed}")


def _check_rotations(run: "ProtocolRun"):
    """Raise ValueError where rotations in turned planes would not meet one and the same contact."""
    table = run.table
    if not table.rotations:
        return
    if table.beta_scatter_deg or table.psi_scatter_deg or table.d_x_scatter_mm:
        raise ValueError(
            "rotations are against one object: beta_scatter_deg, psi_scatter_deg and d_x_scatter_mm are 0"
        )
    if table.purpose == "gauge" or run.protocol.columns or run.goes_back:
        raise ValueError("rotations are single forward strokes that measure, of one whisker")
