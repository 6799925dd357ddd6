"""session.toml and trial.toml as people write them: their keys, and what values are plausible.

A key is declared once: its type holds the range of plausible values.
The comment above a key is what docs/formats.md says of it (`docs/formats.py`); it holds for the
keys below, too, down to the next comment.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Annotated, Literal

import msgspec

from bench.session import plausible
from bench.session.givens import Assumed, AssumedOfRows, GivenKeys
from bench.session.strict_toml import Keys, declared_parts, is_sigma, key_names

# Lists of so many numbers.
_TWO = msgspec.Meta(min_length=2, max_length=2)
# Lists of so many numbers.
_THREE = msgspec.Meta(min_length=3, max_length=3)
# Lists of so many numbers.
_THREE_OR_FOUR = msgspec.Meta(min_length=3, max_length=4)
# Lists of so many numbers.
_FOUR = msgspec.Meta(min_length=4, max_length=4)
Pair = Annotated[list[float], _TWO]
Matrix = Annotated[list[Pair], _TWO]
Row4 = Annotated[list[float], _FOUR]
Place = Annotated[list[float], _THREE, plausible.PLACE]
Velocity = Annotated[list[float], _THREE, plausible.VELOCITY]
Turns = Annotated[list[float], _THREE, plausible.ANGLE]
Curvature = Annotated[list[float], _TWO, plausible.CURVATURE]
Length = Annotated[float, plausible.LENGTH]
Thickness = Annotated[float, plausible.THICKNESS]
Width = Annotated[float, plausible.WIDTH]
Modulus = Annotated[float, plausible.YOUNGS_MODULUS]
Rigidity = Annotated[float, plausible.RIGIDITY]
Angle = Annotated[float, plausible.ANGLE]
Slope = Annotated[float, plausible.SLOPE]
Speed = Annotated[float, plausible.SPEED]
Marker = Annotated[int, plausible.MARKER]
Rate = Annotated[float, plausible.RATE]
Exposure = Annotated[float, plausible.EXPOSURE]
Force = Annotated[float, plausible.FORCE]
Filter = Annotated[float, plausible.FILTER]


@dataclass(frozen=True)
class SizeOf:
    """Says of a key of [object] that it states a size of one shape, and of no other."""

    shape: str


# What a sigma is where it is not stated: what a careful lab has. Each is Stated.
# A caliper is read to 0.02 mm; drawn wire keeps its nominal diameter to 2 %, however thin it is.
_CALIPER = Assumed(absolute=0.02, share=0.02, origin="a caliper, or as drawn")
_RULER = Assumed(absolute=0.5, origin="a ruler")
_DATA_SHEET = Assumed(share=0.05, origin="a data sheet's range")
_BY_HAND = "placed by hand"
LengthSigma = Annotated[float, _RULER]
DiameterSigma = Annotated[float, _CALIPER]
StiffnessSigma = Annotated[float, _DATA_SHEET]
RestSigma = Annotated[float, Assumed(absolute=0.1, of="rest_shape", origin="traced in a picture")]

RingDiameter = Annotated[float, plausible.LENGTH, SizeOf("ring")]
HalfAngle = Annotated[float, plausible.HALF_ANGLE, SizeOf("cone")]


@dataclass(frozen=True, kw_only=True)
class WhiskerKeys(GivenKeys):
    """[whisker] of session.toml."""

    one_of = (("youngs_modulus_GPa", "flexural_rigidity_Nmm2"),)

    # "cylinder" (default), "cone": base diameter to a point at `length_mm`, or "tapered": to
    # `tip_diameter_mm` there
    shape: Literal["cylinder", "cone", "tapered"] = "cylinder"
    # length from the base to the tip
    length_mm: Length
    length_sigma_mm: LengthSigma = 0.0
    # diameter at the base
    diameter_mm: Thickness
    diameter_sigma_mm: DiameterSigma = 0.0
    # of "tapered": diameter at `length_mm`
    tip_diameter_mm: Thickness | None = None
    # diameters from base to tip as a table, such as "profile.csv"; they replace shape, and decide
    # where diameter_mm or tip_diameter_mm differ by less than 5 % or 3 sigma
    profile: str | None = None
    # Young's modulus; this, or the rigidity
    youngs_modulus_GPa: Modulus | None = None
    youngs_modulus_sigma_GPa: StiffnessSigma = 0.0
    # rigidity E I at the base
    flexural_rigidity_Nmm2: Rigidity | None = None
    flexural_rigidity_sigma_Nmm2: StiffnessSigma = 0.0
    # unloaded curvature [y, z] in the base frame: at arc length s it lies κ s²/2 aside. Pictures
    # correct it; of the estimators exact_rod alone uses it
    rest_curvature_per_mm: Curvature | None = None
    # or its shape as a table beside session.toml, such as "rest.csv"
    rest_shape: str | None = None
    # how far its tip may lie from there, in y and in z, the rest as its square of the length
    rest_shape_sigma_mm: RestSigma = 0.0


@dataclass(frozen=True, kw_only=True)
class BarKeys(GivenKeys):
    """[bar] of session.toml."""

    # diameter of the round bar that is touched
    diameter_mm: Width
    diameter_sigma_mm: DiameterSigma = 0.0


@dataclass(frozen=True, kw_only=True)
class BoardKeys(GivenKeys):
    """[board] of session.toml."""

    # "charuco" (default), "checkerboard", "circles", "asymmetric_circles", "aprilgrid" or "body": equal
    # ChArUco boards on the faces of a rigid body, such as a cube
    kind: Literal[
        "charuco", "checkerboard", "circles", "asymmetric_circles", "aprilgrid", "body"
    ] = "charuco"
    # Kalibr's file of an aprilgrid or checkerboard beside session.toml, in place of the sizes below
    kalibr_target: str | None = None
    # how many squares [along x, along y]; circles or tags of the other kinds
    squares: Annotated[list[int], _TWO] | None = None
    # side of a square as printed, over many of them; all lengths seen depend on it. From circle to circle or tag to tag, of
    # asymmetric circles from row to row
    square_mm: Width | None = None
    square_sigma_mm: Annotated[float, Assumed(share=1e-3, origin="a caliper along the print")] = 0.0
    # share by which the print may be longer along y than along x
    stretch_sigma: Annotated[
        float, Assumed(absolute=1e-3, unstated="stretch", origin="a printer's feed")
    ] = 0.0
    # side of a marker or tag, diameter of a circle; not of a checkerboard. Its sigma enters nothing
    marker_mm: Width | None = None
    marker_sigma_mm: float = 0.0
    # of a ChArUco board: OpenCV's name, such as "DICT_5X5_100"
    dictionary: str | None = None
    # of a ChArUco board: the number of its first marker, 0 by default
    first_id: int | None = None
    # of a body: the number of the first marker on each face; the first face is the body's frame
    first_ids: list[int] | None = None
    # OpenCV's pattern from before 4.6
    legacy: bool = False
    # printed white on black
    inverted: bool = False


@dataclass(frozen=True, kw_only=True)
class RigKeys(GivenKeys):
    """[rig] of session.toml."""

    # 3 × 4 or 4 × 4, mm: rig = rows · [board x, y, z, 1] for the board in boards/rig; absent: by
    # rig.toml, else by free strokes
    T_rig_board: Annotated[list[Row4], _THREE_OR_FOUR] | None = None
    # standard deviation of each shift
    T_rig_board_sigma_mm: Annotated[
        float, Assumed(absolute=0.2, of="T_rig_board", origin=_BY_HAND)
    ] = 0.0
    # standard deviation of each turn
    T_rig_board_sigma_deg: Annotated[
        float, Assumed(absolute=0.2, of="T_rig_board", origin=_BY_HAND)
    ] = 0.0


@dataclass(frozen=True, kw_only=True)
class CameraKeys(Keys):
    """One [[cameras]] of session.toml."""

    # name of the folder or film; of a part of another camera's picture: its own
    name: str
    # the camera in whose picture it is, by a mirror or in a split view ([bring.md](bring.md))
    of: str | None = None
    # [left, top, width, height] there, px
    crop: Annotated[list[int], _FOUR] | None = None
    # true: seen in a mirror
    mirrored: bool = False
    # for the record: checked, not used otherwise
    exposure_s: Exposure | None = None
    exposure_sigma_s: float = 0.0
    # fx/fy where pixels are not square: 0.75 of a camera that squashes 16:9 to 4:3. What is seen
    # must agree within 3 %; left out: square, or squashed with a warning
    pixel_aspect: Annotated[float, plausible.PIXEL_ASPECT] | None = None


@dataclass(frozen=True, kw_only=True)
class GaugeKeys(GivenKeys):
    """[gauges] of session.toml, and gauges.toml."""

    # [y, z] where there is no moment
    offset_V: Pair
    offset_sigma_V: Pair | None = None
    # [m_y, m_z] in the follicle's axes = matrix · ([y_V, z_V] − offset)
    matrix_Nmm_per_V: Matrix
    matrix_sigma_Nmm_per_V: Annotated[
        Matrix | None, AssumedOfRows(share=0.01, origin="of a row's largest")
    ] = None


@dataclass(frozen=True, kw_only=True)
class ChannelNames(Keys):
    """[whiskers.channels] of session.toml: the file's own names of a whisker's columns."""

    # whiskers on one motor share it; no other channel is shared
    motor_deg: str | None = None
    # its own channels, as of one whisker
    y_V: str | None = None
    z_V: str | None = None
    m_y_Nmm: str | None = None
    m_z_Nmm: str | None = None
    f_x_N: str | None = None
    f_y_N: str | None = None
    f_z_N: str | None = None


@dataclass(frozen=True, kw_only=True)
class ArrayWhiskerKeys(WhiskerKeys):
    """One [[whiskers]] of session.toml."""

    # its own name; letters, digits, `_`, `-`, `.`
    name: str
    # [x, y, z] of its base in the rig frame
    base_mm: Place
    base_sigma_mm: Annotated[float, Assumed(absolute=0.2, origin=_BY_HAND)] = 0.0
    # its base frame, turned about the rig's x, then y, then z ([0, 0, 0]): z is the axis that it
    # turns about, x the whisker at motor angle 0
    base_deg: Turns = field(default_factory=lambda: [0.0, 0.0, 0.0])
    base_sigma_deg: Annotated[float, Assumed(absolute=0.2, of="base_mm", origin=_BY_HAND)] = 0.0
    # the table `[whiskers.gauges]`, with the keys of `[gauges]`
    gauges: GaugeKeys | None = None
    # the table `[whiskers.channels]`; left out: `y_V@<name>` and so on in signals.csv, and
    # `motor_deg` for all, where there is no `motor_deg@<name>`
    channels: ChannelNames = ChannelNames()


@dataclass(frozen=True, kw_only=True)
class ObjectKeys(GivenKeys):
    """[object] of trial.toml: what the object is, and perhaps where it stands, in the rig frame."""

    # "bar" (default), "ring": a bar bent to a circle, "sphere" or "cone"
    shape: Literal["bar", "ring", "sphere", "cone"] = "bar"
    # [x, y, z] of the bar's axis anywhere, the centre, or the cone's tip; left out: not known
    point_mm: Place | None = None
    point_sigma_mm: LengthSigma = 0.0
    # with `point_mm`: the bar's direction, the normal of the ring's plane, or where the cone points
    # ([0, 0, 1]; by `[truth]` that of `beta_deg`)
    axis: Annotated[list[float], _THREE] | None = None
    # [x, y, z] of the bar's axis anywhere in the frame of a board that is fixed to it, of which
    # `trials/<trial>/board_<camera>.png` are pictures; of trials that have traces and no pictures
    board_point_mm: Place | None = None
    board_point_sigma_mm: LengthSigma = 0.0
    # and the bar's direction in that frame
    board_axis: Annotated[list[float], _THREE] | None = None
    board_axis_sigma_deg: Annotated[
        float, Assumed(absolute=1.0, of="board_axis", origin=_BY_HAND)
    ] = 0.0
    # diameter of the circle that the ring's axis is
    ring_diameter_mm: RingDiameter | None = None
    # angle of the cone between its axis and its surface; with it `bar_diameter_mm` is twice the radius
    # along the normal at the contact
    half_angle_deg: HalfAngle | None = None

    @property
    def direction(self) -> list[float]:
        """Return its axis; upright where none is stated."""
        return [0.0, 0.0, 1.0] if self.axis is None else self.axis

    @property
    def sizes(self) -> dict[str, float]:
        """Return the sizes of its shape, in mm and rad, by their names in `StatedSizes`."""
        stated = {}
        for key in shape_of_size():
            value = getattr(self, key)
            if value is not None and key.endswith("_deg"):
                stated[f"{key.removesuffix('_deg')}_rad"] = math.radians(value)
            elif value is not None:
                stated[key] = value
        return stated


@dataclass(frozen=True, kw_only=True)
class TrialKeys(GivenKeys):
    """trial.toml, and [trial] of session.toml for all trials."""

    # groups trials in fits and plots
    surface: str = ""
    # where the motor's angle is from: "log" (default), the signals' motor_deg; "speed", the stated
    # speed times the time, of one forward stroke; "marker" on the hub or "whisker", seen in the
    # trial's own pictures by `calibrate angles` ([bring.md](bring.md))
    angle_from: Literal["log", "speed", "marker", "whisker"] = "log"
    # number of the marker on the hub, of angle_from = "marker"
    hub_marker: Marker | None = None
    # nominal speed of the motor; signals that say another give a warning; its sigma enters θ of
    # angle_from = "speed" alone
    speed_deg_s: Speed | None = None
    speed_sigma_deg_s: float = 0.0
    # nominal slope; one that is seen counts before it, with a warning where their sigmas do not
    # allow the difference
    beta_deg: Slope | None = None
    beta_sigma_deg: float = 0.0
    # nominal distance; one that is seen counts before it. With a sigma it is measured, and `calibrate rig`
    # places the rig by it. By `[truth]` it is the truth itself: from the base to the contact at first touch
    d_x_mm: Length | None = None
    d_x_sigma_mm: float = 0.0
    # diameter of the bar where it differs from the session's (paper wrapped round it)
    bar_diameter_mm: Width | None = None
    bar_diameter_sigma_mm: DiameterSigma = 0.0
    # "measure" (default), "gauge" (calibrates the gauges), "weight" (a force hung on the whisker)
    purpose: Literal["measure", "gauge", "weight"] = "measure"
    # force of a weight, along rig −z
    force_N: Force | None = None
    force_sigma_N: Annotated[float, Assumed(share=0.005, origin="a balance")] = 0.0
    # where the weight hangs, from the base
    at_mm: Length | None = None
    at_sigma_mm: LengthSigma = 0.0
    # gives the times of frames where no file has them; its sigma enters nothing
    frame_rate_Hz: Rate | None = None
    frame_rate_sigma_Hz: float = 0.0
    # time of frame 0 on the signals' clock; the sigma enters the touch seen
    first_frame_s: float | None = None
    first_frame_sigma_s: Annotated[float | None, Assumed(origin="half a frame")] = None
    # share by which a channel of moments may be scaled
    moment_gain_sigma: Annotated[
        float, Assumed(absolute=0.01, unstated="moments in N·mm", origin="a calibrated cell")
    ] = 0.0
    # −3 dB of the fourth-order Butterworth before the converter; 0: none. Its delay is taken out of
    # touch felt. Left out: the paper's 800 Hz, with a sigma
    gauge_filter_Hz: Filter | None = None
    # true: each way back is evaluated, too, and with the way there ([moving.md](moving.md))
    both_ways: bool = False
    # [x, y, z] in the rig frame of an object that moves steadily, and one sigma each way
    # ([moving.md](moving.md))
    object_velocity_mm_s: Velocity | None = None
    object_velocity_sigma_mm_s: Annotated[float, Assumed(share=0.01, origin="a stage's speed")] = (
        0.0
    )
    # true: the object gives way as it is pushed, and comes back; how far is fitted to the pictures
    # ([soft.md](soft.md))
    object_gives_way: bool = False
    # name of a contact that several trials approach, the plane of rotation turned between them
    contact: str = ""
    # how far that plane is turned about the whisker (+x); the rig frame turns with it, so `beta_deg` is
    # the slope against the turned plane. Its sigma enters nothing
    plane_turn_deg: Angle = 0.0
    plane_turn_sigma_deg: float = 0.0
    # how far the follicle is turned about the whisker (+x)
    follicle_roll_deg: Angle = 0.0
    follicle_roll_sigma_deg: Annotated[float, Assumed(share=1 / 90, origin="1° in 90°")] = 0.0
    # the table `[object]` (`[trial.object]` in session.toml); arrays are judged by it
    object: ObjectKeys | None = None


@dataclass(frozen=True, kw_only=True)
class ChannelKeys(Keys):
    """A channel of [signals]: scale · raw + offset."""

    channel: str
    scale: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True)
class SignalKeys(Keys):
    """[signals] of session.toml: the DAQ's file in each trial's folder, and its channels."""

    # its name in each trial's folder: .csv, .mat, .h5, .hdf5 or .tdms. HDF5 (and .mat 7.3) and TDMS
    # need the extras `hdf5` and `tdms`. Within a MATLAB structure: a/b; in TDMS: group/channel
    file: str
    # where no channel holds the times; the first sample is at 0 s
    rate_Hz: Rate | None = None
    # times in seconds
    time_s: ChannelKeys | None = None
    # the motor's angle; left out where angle_from has it from elsewhere
    motor_deg: ChannelKeys | None = None
    # the gauges
    y_V: ChannelKeys | None = None
    z_V: ChannelKeys | None = None
    # moments, in place of volts
    m_y_Nmm: ChannelKeys | None = None
    m_z_Nmm: ChannelKeys | None = None
    # forces of a load cell; all three or none
    f_x_N: ChannelKeys | None = None
    f_y_N: ChannelKeys | None = None
    f_z_N: ChannelKeys | None = None
    # pressure of a microphone at the base
    p_Pa: ChannelKeys | None = None
    # each rising edge through its middle is a frame of every camera, where there is no frames.csv
    frame_V: ChannelKeys | None = None


@dataclass(frozen=True, kw_only=True)
class TruthKeys(GivenKeys):
    """[truth] of session.toml: without it the pictures say where the contact is."""

    # "stage": `d_x_mm`, `[object]` or `stage.csv` of each trial do; pictures are compared with it
    source: Literal["stage"]
    # how far the stage's origin may be from the whisker's base, each way: alike in all whisks
    origin_sigma_mm: Annotated[
        float, Assumed(absolute=0.2, unstated="the stage's origin", origin=_BY_HAND)
    ] = 0.0


@dataclass(frozen=True, kw_only=True)
class SessionKeys(Keys):
    """session.toml."""

    # version of this format: 1
    format: int
    # shown in the summary; the folder's name where it is absent
    name: str = ""
    # true: what has no sigma is exact, in tables that do not say otherwise
    exact: bool = False
    # order of surfaces in tables and figures, such as ["steel", "sandpaper"]; others follow by name
    # of trial
    surfaces: tuple[str, ...] = ()
    # the tables below; `whisker` or `whiskers`
    whisker: WhiskerKeys | None = None
    whiskers: tuple[ArrayWhiskerKeys, ...] = ()
    bar: BarKeys | None = None
    board: BoardKeys | None = None
    rig: RigKeys = RigKeys()
    cameras: tuple[CameraKeys, ...] = ()
    gauges: GaugeKeys | None = None
    signals: SignalKeys | None = None
    truth: TruthKeys | None = None
    trial: TrialKeys = TrialKeys()


@lru_cache
def shape_of_size() -> dict[str, str]:
    """Return of which shape a key of [object] is a size, by key."""
    declared = declared_parts(ObjectKeys, SizeOf)
    return {key: size.shape for key, size in declared.items()}


def sigma_key(key: str) -> str:
    """Return the key of a value's standard deviation: 'd_x_mm' -> 'd_x_sigma_mm'; '' without one."""
    for name in key_names(TrialKeys):
        if is_sigma(name) and name.replace("_sigma", "") == key:
            return name
    return ""
