"""session.toml and trial.toml as people write them: which keys there are, and what values are plausible."""

from typing import Annotated, ClassVar, Literal

import msgspec

from bench.session import plausible
from bench.session.strict_toml import Keys

Row4 = Annotated[list[float], msgspec.Meta(min_length=4, max_length=4)]
Triple = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
Pair = Annotated[list[float], msgspec.Meta(min_length=2, max_length=2)]
Three = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]


class WhiskerKeys(Keys, kw_only=True):
    """[whisker] of session.toml."""

    shape: Literal["cylinder", "cone", "tapered"] = "cylinder"
    length_mm: float
    length_sigma_mm: float = 0.0
    diameter_mm: float
    diameter_sigma_mm: float = 0.0
    tip_diameter_mm: float | None = None
    youngs_modulus_GPa: float | None = None
    youngs_modulus_sigma_GPa: float = 0.0
    flexural_rigidity_Nmm2: float | None = None
    flexural_rigidity_sigma_Nmm2: float = 0.0

    windows: ClassVar = {
        "length_mm": plausible.LENGTH,
        "diameter_mm": plausible.THICKNESS,
        "tip_diameter_mm": plausible.THICKNESS,
        "youngs_modulus_GPa": plausible.YOUNGS_MODULUS,
        "flexural_rigidity_Nmm2": plausible.RIGIDITY,
    }


class BarKeys(Keys, kw_only=True):
    """[bar] of session.toml."""

    diameter_mm: float
    diameter_sigma_mm: float = 0.0

    windows: ClassVar = {"diameter_mm": plausible.WIDTH}


class BoardKeys(Keys, kw_only=True):
    """[board] of session.toml."""

    squares: Annotated[list[int], msgspec.Meta(min_length=2, max_length=2)]
    square_mm: float
    square_sigma_mm: float = 0.0
    marker_mm: float
    marker_sigma_mm: float = 0.0
    dictionary: str
    legacy: bool = False
    inverted: bool = False

    windows: ClassVar = {
        "square_mm": plausible.WIDTH,
        "marker_mm": plausible.WIDTH,
    }


class RigKeys(Keys, kw_only=True):
    """[rig] of session.toml."""

    T_rig_board: Annotated[list[Row4], msgspec.Meta(min_length=3, max_length=3)] | None = None
    T_rig_board_sigma_mm: float = 0.0
    T_rig_board_sigma_deg: float = 0.0


class CameraKeys(Keys, kw_only=True):
    """One [[cameras]] of session.toml."""

    name: str
    exposure_s: float | None = None
    exposure_sigma_s: float = 0.0

    windows: ClassVar = {"exposure_s": plausible.EXPOSURE}


class GaugeKeys(Keys, kw_only=True):
    """[gauges] of session.toml, and gauges.toml."""

    offset_V: Pair
    offset_sigma_V: Pair | None = None
    matrix_Nmm_per_V: Annotated[list[Pair], msgspec.Meta(min_length=2, max_length=2)]
    matrix_sigma_Nmm_per_V: (
        Annotated[list[Pair], msgspec.Meta(min_length=2, max_length=2)] | None
    ) = None


class ChannelNames(Keys, kw_only=True):
    """[whiskers.channels] of session.toml: the file's own names of a whisker's columns."""

    motor_deg: str | None = None
    y_V: str | None = None
    z_V: str | None = None
    m_y_Nmm: str | None = None
    m_z_Nmm: str | None = None
    f_x_N: str | None = None
    f_y_N: str | None = None
    f_z_N: str | None = None


class ArrayWhiskerKeys(WhiskerKeys, kw_only=True):
    """One [[whiskers]] of session.toml."""

    name: str
    base_mm: Three
    base_sigma_mm: float = 0.0
    base_deg: Three = msgspec.field(default_factory=lambda: [0.0, 0.0, 0.0])
    base_sigma_deg: float = 0.0
    gauges: GaugeKeys | None = None
    channels: ChannelNames = ChannelNames()

    windows: ClassVar = WhiskerKeys.windows | {
        "base_mm": plausible.PLACE,
        "base_deg": plausible.ANGLE,
    }
    tables: ClassVar = {"gauges": GaugeKeys, "channels": ChannelNames}


class ObjectKeys(Keys, kw_only=True):
    """[object] of trial.toml: what the object is, and perhaps where it stands, in the rig frame."""

    shape: Literal["bar", "ring", "sphere", "cone"] = "bar"
    point_mm: Three | None = None
    point_sigma_mm: float = 0.0
    axis: Three | None = None
    ring_diameter_mm: float | None = None
    half_angle_deg: float | None = None

    windows: ClassVar = {
        "point_mm": plausible.PLACE,
        "ring_diameter_mm": plausible.LENGTH,
        "half_angle_deg": plausible.HALF_ANGLE,
    }


class TrialKeys(Keys, kw_only=True):
    """trial.toml, and [trial] of session.toml for all trials."""

    surface: str = ""
    speed_deg_s: float | None = None
    speed_sigma_deg_s: float = 0.0
    beta_deg: float | None = None
    beta_sigma_deg: float = 0.0
    d_x_mm: float | None = None
    d_x_sigma_mm: float = 0.0
    bar_diameter_mm: float | None = None
    bar_diameter_sigma_mm: float = 0.0
    purpose: Literal["measure", "gauge", "weight"] = "measure"
    force_N: float | None = None
    force_sigma_N: float = 0.0
    at_mm: float | None = None
    at_sigma_mm: float = 0.0
    frame_rate_Hz: float | None = None
    frame_rate_sigma_Hz: float = 0.0
    first_frame_s: float | None = None
    first_frame_sigma_s: float = 0.0
    gauge_filter_Hz: float | None = None
    both_ways: bool = False
    object_velocity_mm_s: Triple | None = None
    object_velocity_sigma_mm_s: float = 0.0
    object_gives_way: bool = False
    follicle_roll_deg: float = 0.0
    follicle_roll_sigma_deg: float = 0.0
    object: ObjectKeys | None = None

    tables: ClassVar = {"object": ObjectKeys}
    windows: ClassVar = {
        "speed_deg_s": plausible.SPEED,
        "beta_deg": plausible.SLOPE,
        "d_x_mm": plausible.LENGTH,
        "bar_diameter_mm": BarKeys.windows["diameter_mm"],
        "force_N": plausible.FORCE,
        "at_mm": plausible.LENGTH,
        "frame_rate_Hz": plausible.RATE,
        "first_frame_s": plausible.CLOCK,
        "gauge_filter_Hz": plausible.FILTER,
        "object_velocity_mm_s": plausible.VELOCITY,
        "follicle_roll_deg": plausible.ANGLE,
    }


class ChannelKeys(Keys, kw_only=True):
    """A channel of [signals]: scale · raw + offset."""

    channel: str
    scale: float = 1.0
    offset: float = 0.0


class SignalKeys(Keys, kw_only=True):
    """[signals] of session.toml: the DAQ's file in each trial's folder, and its channels."""

    file: str
    rate_Hz: float | None = None
    time_s: ChannelKeys | None = None
    motor_deg: ChannelKeys
    y_V: ChannelKeys | None = None
    z_V: ChannelKeys | None = None
    m_y_Nmm: ChannelKeys | None = None
    m_z_Nmm: ChannelKeys | None = None
    f_x_N: ChannelKeys | None = None
    f_y_N: ChannelKeys | None = None
    f_z_N: ChannelKeys | None = None
    frame_V: ChannelKeys | None = None

    windows: ClassVar = {"rate_Hz": plausible.RATE}
    tables: ClassVar = dict.fromkeys(
        (
            "time_s",
            "motor_deg",
            "y_V",
            "z_V",
            "m_y_Nmm",
            "m_z_Nmm",
            "f_x_N",
            "f_y_N",
            "f_z_N",
            "frame_V",
        ),
        ChannelKeys,
    )


class SessionKeys(Keys, kw_only=True):
    """session.toml."""

    format: int
    name: str = ""
    surfaces: tuple[str, ...] = ()
    whisker: WhiskerKeys | None = None
    whiskers: tuple[ArrayWhiskerKeys, ...] = ()
    bar: BarKeys | None = None
    board: BoardKeys | None = None
    rig: RigKeys = RigKeys()
    cameras: tuple[CameraKeys, ...] = ()
    gauges: GaugeKeys | None = None
    signals: SignalKeys | None = None
    trial: TrialKeys = TrialKeys()

    tables: ClassVar = {
        "whisker": WhiskerKeys,
        "whiskers": ArrayWhiskerKeys,
        "bar": BarKeys,
        "board": BoardKeys,
        "rig": RigKeys,
        "cameras": CameraKeys,
        "gauges": GaugeKeys,
        "signals": SignalKeys,
        "trial": TrialKeys,
    }


def sigma_key(key: str) -> str:
    """The key of a value's standard deviation, or '' for a key that has none: 'd_x_mm' -> 'd_x_sigma_mm'."""
    names = (
        n
        for n in TrialKeys.__struct_fields__
        if "_sigma_" in n and n.replace("_sigma_", "_") == key
    )
    return next(names, "")
