"""Moments and force at the base as the pictures show them, frame by frame: base_moments.csv.

They belong to the truth: the exact rod of the stated whisker turns the wire's seen bend into them. No gauge enters
them, and no estimate reads them. Where moments are felt, the table compares the two.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun, Heading
from bench.analyses.cells import whisk_cells
from bench.base.tables import TRIAL, WHISK, Column, Kind, Table, shared_name, sigma_name, with_sigma
from bench.gauges.gauge_readings import frames_with_moments, loads_from_pictures
from bench.records.trial_result import Deflection, FeltWhisk, SeenWhisk, TrialResult, whisks
from bench.session.whisker import Whisker
from vision import Value
from vision.geometry import counted

# Columns of `WhiskerRod.loads`, with what they mean.
_LOADS = {
    "m_y_Nmm": "moment about y at the base, in the hub's axes; seen",
    "m_z_Nmm": "moment about z, the axis of rotation; seen",
    "f_axial_N": "force on the whisker along the clamped base, towards the tip positive",
    "f_push_N": "force against the push, in the plane of rotation",
    "f_lateral_N": "force along z",
}
_NAMES = tuple(_LOADS)
# Signs of `WhiskerRod.loads`, in whose axes the push is along +y.
_SIGNS = np.array([1.0, 1.0, 1.0, -1.0, 1.0])


def _load_columns() -> Iterator[Column]:
    """Yield the columns of the loads, each with its sigma's two parts."""
    for name, meaning in _LOADS.items():
        yield from with_sigma(name, meaning)
        yield Column(shared_name(name), "of that sigma, the stated stiffness' part")


BASE_MOMENTS = Table(
    "base_moments",
    "A row a touching frame of a whisk with a truth, from 0.3° on. Of the pictures and the stated whisker "
    "alone; no estimate takes it. With more than twelve such frames, a cubic between twelve.",
    (
        TRIAL,
        WHISK,
        Column("frame", "number of the frame in the trial", Kind.WHOLE),
        Column("time_s", "time of the frame"),
        Column("theta_deg", "pushing angle; seen"),
        *_load_columns(),
    ),
)
BASE_MOMENTS_FELT = Table(
    "base_moments_felt",
    "A row a whisk with a truth and felt moments, at the pushing angle of the estimates.",
    (
        TRIAL,
        WHISK,
        Column("theta_deg", "pushing angle"),
        *with_sigma("m_seen_Nmm", "size of the moment at the base; seen"),
        *with_sigma("m_felt_Nmm", "felt moment along that"),
        *with_sigma("ratio", "felt over seen", "ratio_sigma"),
        Column("z", "felt less seen, over the sigma of that"),
    ),
)


@dataclass(frozen=True, eq=False)
class BaseLoads:
    """Loads (n, 5), in the order of the table, at the base of one whisk in n touching frames.

    rows (n,): of these frames in the whisk's `FrameTruth`. motor_rad (n,): their motor angles.
    covariance (n, 5, 5): of each frame, without stiffness_share, one sigma of the stiffness' share of all.
    """

    rows: np.ndarray
    motor_rad: np.ndarray
    values: np.ndarray
    covariance: np.ndarray
    stiffness_share: float

    def at(self, motor_rad: float) -> tuple[np.ndarray, np.ndarray] | None:
        """Return the moments (2,) at a motor angle and their covariance (2, 2); None beyond the frames."""
        order = np.argsort(self.motor_rad)
        motor = self.motor_rad[order]
        if not motor[0] <= motor_rad <= motor[-1]:
            return None
        moments = [np.interp(motor_rad, motor, self.values[order, k]) for k in range(2)]
        nearest = int(np.argmin(np.abs(self.motor_rad - motor_rad)))
        return np.array(moments), self.covariance[nearest, :2, :2]


@dataclass(frozen=True, eq=False)
class WhiskLoads:
    """Loads at the base of one whisk, and what the gauges felt. is_by_wire: the gauges' scale is the wire's."""

    result: TrialResult
    seen: SeenWhisk
    felt: FeltWhisk
    loads: BaseLoads
    is_by_wire: bool


class BaseMoments(Analysis):
    """Which moments and force the pictures show at the base."""

    tables = (BASE_MOMENTS, BASE_MOMENTS_FELT)
    in_every_run = False
    heading = Heading("base_moments", "Moments at the base, seen (base_moments.csv)")

    def compute(self, run: EvaluatedRun) -> list[WhiskLoads]:
        """Return the loads of every whisk with a truth whose rod bends as it is seen to."""
        is_by_wire = any(result.trial.purpose == "gauge" for result in run.results)
        found = []
        for result, seen, felt in whisks(run.results):
            if seen.has_truth and seen.deflection is not None and not seen.contradicted:
                loads = base_loads(seen, run.whisker)
                if loads is not None:
                    found.append(WhiskLoads(result, seen, felt, loads, is_by_wire))
        return found

    def rows(self, found: list[WhiskLoads]) -> dict[Table, list[dict]]:
        """Return a row a frame, and a row a whisk with felt moments."""
        by_frame = []
        beside = []
        for one in found:
            by_frame += _frame_rows(one)
            felt = felt_beside(one)
            if felt is not None:
                beside.append(felt)
        return {BASE_MOMENTS: by_frame, BASE_MOMENTS_FELT: beside}

    def lines(self, found: list[WhiskLoads]) -> Iterator[str]:
        """Yield how far felt moments are from those seen, over the measured whisks."""
        beside = [felt_beside(one) for one in found if one.result.trial.purpose == "measure"]
        known = [row for row in beside if row is not None]
        if known:
            ratios = [row["ratio"] for row in known]
            z = [row["z"] for row in known]
            yield (
                f"felt over seen, at the pushing angle of the estimates: {np.mean(ratios):.4f} in the mean "
                f"of {counted(len(known), 'whisk')}, z {np.sqrt(np.mean(np.square(z))):.1f} RMS"
            )


def base_loads(seen: SeenWhisk, whisker: Whisker) -> BaseLoads | None:
    """Return the loads at the base in the touching frames of a whisk with a deflection.

    None where no touching frame is far enough from touch, or no rod of this stiffness is bent so.
    """
    d = seen.deflection
    good = frames_with_moments(d)
    if not good.any():
        return None
    try:
        values, covariance = loads_from_pictures(d, whisker)
    except ArithmeticError:
        return None
    rows, weights = _between(seen, d, good)
    if not len(rows):
        return None
    own = covariance.reshape(len(values), 5, len(values), 5)
    of_frames = np.einsum("fi,iajb,fj->fab", weights, own, weights)
    signs = np.outer(_SIGNS, _SIGNS)
    return BaseLoads(
        rows,
        seen.truth.frames.motor_rad[rows],
        weights @ values * _SIGNS,
        of_frames * signs,
        whisker.C_sigma_Nmm2 / whisker.C_Nmm2,
    )


def _between(seen: SeenWhisk, d: Deflection, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows (m,) of all touching frames between those (n,) of the deflection, and the weights
    (m, n) of the cubic through these."""
    from scipy.interpolate import CubicSpline

    known_rad = d.motor_rad[good]
    frames = seen.truth.frames
    is_between = (frames.motor_rad >= known_rad.min()) & (frames.motor_rad <= known_rad.max())
    rows = np.flatnonzero(frames.touching & is_between)
    order = np.argsort(known_rad)
    if len(order) == 1:
        return rows, np.ones((len(rows), 1))
    cubic = CubicSpline(known_rad[order], np.eye(len(order))[order])
    return rows, cubic(frames.motor_rad[rows])


def _frame_rows(one: WhiskLoads) -> Iterator[dict]:
    """Yield the rows of a whisk's frames."""
    loads = one.loads
    frames = one.seen.truth.frames
    for k, row in enumerate(loads.rows):
        cells = {
            **whisk_cells(one.result, one.seen.whisk),
            "frame": int(frames.index[row]),
            "time_s": float(frames.time_s[row]),
            "theta_deg": math.degrees(frames.theta_rad.value[row]),
        }
        own = np.sqrt(np.maximum(np.diag(loads.covariance[k]), 0.0))
        shared = loads.stiffness_share * np.abs(loads.values[k])
        for name, value, own_sigma, shared_sigma in zip(_NAMES, loads.values[k], own, shared):
            cells[name] = float(value)
            cells[sigma_name(name)] = math.hypot(own_sigma, shared_sigma)
            cells[shared_name(name)] = float(shared_sigma)
        yield cells


def felt_beside(one: WhiskLoads) -> dict | None:
    """Return the row of felt and of seen moments; None where either is not known."""
    felt = one.felt
    if not felt.has_moments or felt.covariance_at is None:
        return None
    touch_rad = one.seen.touch_rad
    seen = one.loads.at(touch_rad.value + one.result.theta_rad)
    if seen is None:
        return None
    moments, covariance = seen
    size = float(np.linalg.norm(moments))
    along = moments / size
    seen_sigma = _seen_sigma(one, size, along, covariance)
    felt_moment = _felt_along(felt, along)
    sigma = math.hypot(seen_sigma, felt_moment.sigma)
    return {
        **whisk_cells(one.result, one.seen.whisk),
        "theta_deg": one.result.theta_deg,
        "m_seen_Nmm": size,
        "m_seen_sigma_Nmm": seen_sigma,
        "m_felt_Nmm": felt_moment.value,
        "m_felt_sigma_Nmm": felt_moment.sigma,
        "ratio": felt_moment.value / size,
        "ratio_sigma": sigma / size,
        "z": (felt_moment.value - size) / sigma,
    }


def _seen_sigma(
    one: WhiskLoads, size: float, direction: np.ndarray, covariance: np.ndarray
) -> float:
    """Return the sigma of a seen moment, N·mm, of a size along a unit vector (2,).

    Gauges that were calibrated by the wire have its stiffness in common with what is seen, which
    cancels.
    """
    stiffness = 0.0 if one.is_by_wire else one.loads.stiffness_share * size
    return math.hypot(np.sqrt(direction @ covariance @ direction), stiffness)


def _felt_along(felt: FeltWhisk, direction: np.ndarray) -> Value:
    """Return the component of the felt moment, N·mm, along a unit vector (2,) of m_y and m_z."""
    component = direction @ [felt.m_y_Nmm.value, felt.m_z_Nmm.value]
    sigma = np.sqrt(direction @ felt.covariance_at @ direction)
    return Value(float(component), float(sigma))
