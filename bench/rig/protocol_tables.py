"""The tables of a protocol file: a rig and what is recorded on it. Every key has a default."""

from typing import Annotated, Literal

import msgspec

Three = tuple[float, float, float]
Pair = tuple[float, float]
Size = tuple[int, int]
Positive = Annotated[float, msgspec.Meta(gt=0)]
Zero = Annotated[float, msgspec.Meta(ge=0)]
Name = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_.-]+$")]


class ProtocolTable(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One table of a protocol file; unknown keys are refused."""


class WhiskerTable(ProtocolTable):
    """The table [whisker]."""

    shape: Literal["cylinder", "cone", "tapered"] = "cylinder"
    length_mm: Positive = 100.0
    diameter_mm: Positive = 1.0
    tip_diameter_mm: Positive | None = None  # of "tapered"
    youngs_modulus_GPa: Positive = 60.0
    density_kg_m3: Positive = 6450.0
    sag_mm: float = 0.0  # the tip's drop under its own weight
    set_y_mm: float = 0.0  # the tip's departure by the curvature that spool wire keeps, or a hair
    set_z_mm: float = 0.0
    # session.toml has the set as rest_curvature_per_mm. UNSET keeps it out of the fingerprint
    states_rest: bool | msgspec.UnsetType = msgspec.UNSET
    # diameter over the base's, a polynomial in the share of the length, from 1 on; session.toml has it
    # measured at points, as profile.csv
    widths: tuple[float, ...] | msgspec.UnsetType = msgspec.UNSET


class BoardTable(ProtocolTable):
    """The table [board]."""

    # as in session.toml; left out: ChArUco. UNSET keeps it out of the fingerprint
    kind: (
        Literal["checkerboard", "circles", "asymmetric_circles", "aprilgrid"] | msgspec.UnsetType
    ) = msgspec.UNSET
    squares: Size = (8, 6)
    square_mm: Positive = 15.0
    marker_mm: Positive = 11.0
    dictionary: str = "DICT_5X5_100"
    legacy: bool = False
    inverted: bool = False
    views: Annotated[int, msgspec.Meta(ge=1)] = 14  # pictures a camera for its lens
    origin_mm: Three = (4.2, 38.9, -44.4)  # of the board on the rig
    turn_deg: float = 4.0  # about the rig's z
    tilt_deg: Pair = (0.15, 1.05)  # about the board's x and y
    pose_sigma_mm: Zero = 0.0  # error of the T_rig_board that session.toml states
    pose_sigma_deg: Zero = 0.0


class MirrorTable(ProtocolTable, kw_only=True):
    """The table [cameras.mirror]: a mirror in a part of the camera's picture."""

    name: Name = "mirrored"  # of the camera that it makes
    crop: tuple[int, int, int, int]  # left, top, width, height
    point_mm: Three  # on the mirror
    normal: Three


class CameraTable(ProtocolTable, kw_only=True):
    """One of the tables [[cameras]]."""

    name: Name
    position_mm: Three | None = None  # `plan` finds a place where there is none
    target_mm: Three = (55.0, 0.0, 0.0)
    roll_deg: float = 0.0
    focal_px: Positive = 2000.0
    focal_mm: Positive | None = None  # instead of focal_px, with pixel_um
    pixel_um: Positive | None = None
    aspect: Positive = 1.0012
    size_px: Size = (1280, 720)
    centre_px: Pair | None = None
    distortion: tuple[float, float, float, float, float] = (-0.1, 0.1, 0.0, 0.0, 0.0)
    # UNSET keeps it out of the fingerprint
    mirror: MirrorTable | msgspec.UnsetType = msgspec.UNSET

    @property
    def focal(self) -> float:
        """Return the focal length, px."""
        if self.focal_mm and self.pixel_um:
            return 1000.0 * self.focal_mm / self.pixel_um
        return self.focal_px


class LightTable(ProtocolTable):
    """The table [light]."""

    towards: Three = (-0.3, -0.5, 0.8)  # direction of the lamp
    lamp: Zero = 0.55
    soft: Zero = 0.35  # light from all round, in parts of full scale
    paper: Zero = 0.75
    ink: Zero = 0.04
    floor: Zero = 0.2
    wall: Zero = 0.36
    wire_matt: Zero = 0.25
    wire_shiny: Zero = 0.5
    wire_gloss: Positive = 18.0
    wire_rim: Zero = 0.3  # 0: no darkening towards the edges
    bar_matt: Zero = 0.22
    bar_shiny: Zero = 0.6
    bar_gloss: Positive = 12.0
    bar_rim: Zero = 0.5


class PicturesTable(ProtocolTable):
    """The table [pictures]."""

    format: Literal["jpg", "png", "mkv"] = "jpg"  # JPEG quality 95, PNG, lossless FFV1
    bits: Literal[8, 12, 16] = 8
    blur_px: Annotated[float, msgspec.Meta(ge=0.3, le=6)] = 0.9  # sigma of lens and defocus
    vignetting: Annotated[float, msgspec.Meta(ge=0, le=0.9)] = 0.15
    read_noise: Zero = 0.8  # grey levels of 255
    shot_noise: Zero = 0.4  # of one level
    grain: Zero = 0.055  # in parts of the level
    exposure_s: Zero = 0.001
    motion_blur: bool = True
    before_deg: Zero = 1.6  # frames of a whisk: from before touch …
    after_deg: Zero = 4.6  # … to after it
    step_deg: Positive = 0.5
    rate_Hz: Positive | None = None  # instead of step_deg
    back_stroke: bool = False  # frames on the way back too
    clock_offset_s: float = 0.0  # frames.csv runs behind the signals by this

    @property
    def moving(self) -> str:
        """Return the kind of a trial's frames: PNG where JPEG and film cannot hold the bits."""
        return "png" if self.bits > 8 else self.format

    @property
    def still(self) -> str:
        """Return the kind of single pictures."""
        return "png" if self.moving == "mkv" else self.moving

    def frame_angles_deg(self, speed_deg_s: float) -> list[float]:
        """Return the pushing angles of the frames of one stroke."""
        step = speed_deg_s / self.rate_Hz if self.rate_Hz else self.step_deg
        count = int((self.before_deg + self.after_deg) / step + 1e-9) + 1
        return [i * step - self.before_deg for i in range(count)]

    def frames_a_whisk(self, speed_deg_s: float) -> int:
        """Return the number of frames: the furthest angle once, the others on both ways where the
        way back is seen."""
        count = len(self.frame_angles_deg(speed_deg_s))
        return 2 * count - 1 if self.back_stroke else count


class MotorTable(ProtocolTable):
    """The table [motor]."""

    before_deg: Zero = 1.605  # the stroke: from before touch …
    after_deg: Zero = 4.6  # … to after it
    ramp_s: Zero = 0.0  # to reach the speed and to lose it again
    pause_s: Zero = 0.0  # at either end
    back_stroke: bool = False  # recorded too; where there are several whisks it always is
    encoder_step_deg: Zero = 0.005  # 0: no steps


class FrictionTable(ProtocolTable):
    """The table [friction]."""

    scatter: Zero = 0.0  # sigma of each whisk's coefficients, in parts of them
    # Sigma (of a log-normal) of how much of its excess over motion each single rest reaches
    irregular: Zero = 0.0
    finest_deg: Positive = 0.05  # teeth of stick–slip below this are not resolved


class GaugesTable(ProtocolTable):
    """The table [gauges]."""

    matrix_Nmm_per_V: tuple[Pair, Pair] = ((11.3, 0.32), (-0.25, 10.5))
    offset_V: Pair = (-0.015, -0.026)
    noise_V: Zero = 0.0064
    hum_V: Zero = 0.0023
    hum_Hz: Positive = 58.0
    drift_V_per_s: float = 0.0
    filter_Hz: Zero = 800.0  # 0: no filter
    rate_Hz: Positive = 2000.0
    adc_bits: Annotated[int, msgspec.Meta(ge=0, le=24)] = 16  # 0: no steps
    range_V: Positive = 10.0
    vibration: bool = False
    damping: Annotated[float, msgspec.Meta(gt=0, lt=1)] = 0.02
    known: bool = False  # written into session.toml


class LoadCellTable(ProtocolTable):
    """The table [load_cell]: the force at the base is recorded too, sampled and filtered as the
    gauges."""

    noise_N: Zero = 0.003  # of a six-axis cell of 17 mm: resolution as its maker states it, 1/320 N
    hum_N: Zero = 0.0
    hum_Hz: Positive = 58.0
    drift_N_per_s: float = 0.0
    step_N: Zero = 0.0  # of its converter; 0: none


class MicrophoneTable(ProtocolTable):
    """The table [microphone]: its pressure is recorded too, sampled as the gauges."""

    Pa_per_Nmm: Positive = 1.0
    band_Hz: Pair = (80.0, 800.0)
    noise_Pa: Zero = 0.01
    texture_Pa_per_N: Zero = 0.1  # of a rough surface, ahead of the band


class ColumnTable(ProtocolTable, kw_only=True):
    """One of the tables [[columns]]: a motor and its whiskers, one a height along its axis, named
    <name>1, <name>2 …"""

    name: Name = "w"
    base_mm: Three = (0.0, 0.0, 0.0)  # of height 0, rig frame
    base_deg: Three = (0.0, 0.0, 0.0)  # turned about the rig's x, then y, then z
    heights_mm: Annotated[list[float], msgspec.Meta(min_length=1)]
    # One of all, or one a height; by default [whisker]'s
    length_mm: Positive | list[Positive] | None = None
    diameter_mm: Positive | list[Positive] | None = None
    gauge_scatter: Zero = 0.03  # sigma of each whisker's own coefficients, in parts of [gauges]'
    # Motor angle about which its first touch is searched. By default, and kept out of the fingerprint,
    # that at which it points as a whisker at the rig's origin does where that touches
    near_deg: float | msgspec.UnsetType = msgspec.UNSET


class TrialTable(ProtocolTable):
    """One of the tables [[trials]]: trials with every combination of the listed values."""

    surface: Name = "steel"
    beta_deg: float | list[float] = 0.0
    psi_deg: float | list[float] = 0.0
    d_x_mm: float | list[float] = 60.0
    speed_deg_s: float | list[float] = 10.0
    friction: Zero = 0.185339  # kinetic
    static_friction: Zero | None = None  # by default the kinetic one
    bar_diameter_mm: Positive | None = None
    before_deg: Positive | None = None  # the stroke's, where it is not the motor's
    after_deg: Positive | None = None
    whisks: Annotated[int, msgspec.Meta(ge=1)] = 1
    repeats: Annotated[int, msgspec.Meta(ge=1)] = 1
    # How often the whisker is rotated against each object, its plane of rotation turned between so
    # that it slips less; a trial each. By default once, and no plane is turned
    rotations: Annotated[int, msgspec.Meta(ge=1, le=20)] | msgspec.UnsetType = msgspec.UNSET
    # Of the bar's surface, which gives way; by default it is rigid
    stiffness_N_mm: Positive | None = None
    # Where these are not given, UNSET keeps them out of the fingerprint.
    # By default a straight bar
    object: Literal["ring", "sphere", "cone"] | msgspec.UnsetType = msgspec.UNSET
    # Of the circle that a ring's axis is
    ring_diameter_mm: Positive | msgspec.UnsetType = msgspec.UNSET
    # Between a cone's axis and its surface
    cone_half_angle_deg: Positive | msgspec.UnsetType = msgspec.UNSET
    # The way back is recorded, and to be evaluated
    both_ways: bool | msgspec.UnsetType = msgspec.UNSET
    # Of the bar, rig frame; by default it stands
    object_velocity_mm_s: Three | msgspec.UnsetType = msgspec.UNSET
    # Of what trial.toml states of it, each way
    object_velocity_sigma_mm_s: Zero | msgspec.UnsetType = msgspec.UNSET
    purpose: Literal["measure", "gauge"] = "measure"
    follicle_roll_deg: float = 0.0
    name: str = ""
    # Sigmas of what the bench's people set against what they wanted:
    beta_scatter_deg: Zero = 0.4
    d_x_scatter_mm: Zero = 0.4
    psi_scatter_deg: Zero = 0.0
    touch_deg: float = 2.3
    touch_scatter_deg: Zero = 0.07
