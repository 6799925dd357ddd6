"""What a protocol may ask of the rig."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from bench.base.errors import BadInput

if TYPE_CHECKING:
    from bench.rig.protocol import Protocol, Run

# As far as the march finds its way (docs/extremes.md): at a slope of 89.5° it does, at a tilt of 85° no more.
_STEEPEST_DEG, _MOST_TILT_DEG, _NEAREST = 89.0, 80.0, 0.02
# Of the whisker's own speed at the contact: a bar that runs away as fast is never touched.
_FASTEST_SHARE = 0.5
# Of a cone: with less its tip is out of any rig, with more it is hardly any cone.
_SLIMMEST_DEG, _BLUNTEST_DEG = 1.0, 75.0


def check_protocol(protocol: "Protocol", path: Path) -> None:
    """Raises BadInput, naming the file, for what no rig can do, or what its mechanics here do not cover."""
    names = [c.name for c in protocol.cameras]
    if len(set(names)) < len(names) or "rig" in names:
        raise BadInput(
            f"cameras need names of their own, none of them 'rig'; found {names}", file=path
        )
    for camera in protocol.cameras:
        if (camera.focal_mm is None) != (camera.pixel_um is None):
            raise BadInput(f"camera {camera.name}: focal_mm and pixel_um go together", file=path)
    _check_columns(protocol, path)
    for run in protocol.runs():
        _check_run(protocol, run, path)


def _check_columns(protocol: "Protocol", path: Path) -> None:
    names = [column.name for column in protocol.columns or ()]
    if len(set(names)) < len(names):
        raise BadInput(f"[[columns]] need names of their own; found {names}", file=path)
    for column in protocol.columns or ():
        for key in ("length_mm", "diameter_mm"):
            given, count = getattr(column, key), len(column.heights_mm)
            if isinstance(given, list) and len(given) != count:
                found = f"{key} has {len(given)} values, heights_mm {count}"
                raise BadInput(
                    f"[[columns]] {column.name}: {found}; one for all, or one a height", file=path
                )


def _check_run(protocol: "Protocol", run: "Run", path: Path) -> None:
    table, pictures = run.table, protocol.pictures
    if (
        not -_STEEPEST_DEG <= run.beta_deg <= _STEEPEST_DEG
        or not -_MOST_TILT_DEG <= run.psi_deg <= _MOST_TILT_DEG
    ):
        allowed = f"±{_STEEPEST_DEG:g} and ±{_MOST_TILT_DEG:g} are allowed"
        raise BadInput(f"beta_deg {run.beta_deg:g}, psi_deg {run.psi_deg:g}; {allowed}", file=path)
    if not _NEAREST * protocol.whisker.length_mm <= run.d_x_mm <= 1.05 * protocol.whisker.length_mm:
        raise BadInput(
            f"d_x_mm {run.d_x_mm:g} is outside {_NEAREST:g} to 1.05 of the whisker's length",
            file=path,
        )
    if not 0.01 <= run.speed_deg_s <= 2000:
        raise BadInput(f"speed_deg_s {run.speed_deg_s:g}; 0.01 to 2000 is allowed", file=path)
    for key, shape in (("ring_diameter_mm", "ring"), ("cone_half_angle_deg", "cone")):
        if (table.object == shape) != bool(getattr(table, key)):
            raise BadInput(f'{key} belongs to object = "{shape}", and to no other', file=path)
    if table.object == "cone" and not _SLIMMEST_DEG <= table.cone_half_angle_deg <= _BLUNTEST_DEG:
        found = f"cone_half_angle_deg {table.cone_half_angle_deg:g}; {_SLIMMEST_DEG:g} to {_BLUNTEST_DEG:g}"
        raise BadInput(f"{found} is allowed", file=path)
    if table.static_friction is not None and table.static_friction < table.friction:
        raise BadInput(
            f"static_friction {table.static_friction:g} is below friction {table.friction:g}",
            file=path,
        )
    if not 0.1 <= run.before_deg <= 90 or not 0.1 <= run.after_deg <= 25:
        found = f"found {run.before_deg:g} and {run.after_deg:g}"
        raise BadInput(
            f"the motor's before_deg is 0.1 to 90 and its after_deg 0.1 to 25; {found}", file=path
        )
    _check_moving(protocol, run, path)
    if pictures.before_deg > run.before_deg or pictures.after_deg > run.after_deg:
        raise BadInput("pictures: before_deg and after_deg are at most the motor's", file=path)
    if math.isclose(sum(abs(x) for x in protocol.light.towards), 0):
        raise BadInput("light: towards is a direction, not zero", file=path)


def _check_moving(protocol: "Protocol", run: "Run", path: Path) -> None:
    """The march goes by the motor's angle: a bar moves by it as long as the motor goes steadily one way."""
    velocity = run.table.object_velocity_mm_s
    if not velocity:
        return
    if protocol.goes_back(run) or protocol.motor.ramp_s or protocol.motor.pause_s:
        found = "is simulated for single forward strokes without ramps and pauses"
        raise BadInput(f"object_velocity_mm_s: an object that moves {found}", file=path)
    if protocol.columns:
        raise BadInput(
            "object_velocity_mm_s: an object that moves is simulated for one whisker", file=path
        )
    if run.table.stiffness_N_mm:
        raise BadInput(
            "object_velocity_mm_s: an object that moves is rigid; leave out stiffness_N_mm",
            file=path,
        )
    fastest = _FASTEST_SHARE * math.radians(run.speed_deg_s) * run.d_x_mm
    if math.hypot(*velocity) > fastest:
        found = f"{math.hypot(*velocity):.3g} mm/s, {fastest:.3g} is allowed: half the whisker's own where it touches"
        raise BadInput(f"object_velocity_mm_s: {found}", file=path)
