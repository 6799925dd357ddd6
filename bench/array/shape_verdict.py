"""The object's shape by an array's cloud of contacts: table and lines."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.analyses.pooling import rms_of_known
from bench.array.cloud import SEEN, ContactPoint
from bench.base.drawing import label_of
from bench.base.tables import TRIAL, WHISK, WHISKER, Column, Kind, Table, alike, status, with_sigma
from bench.records.trial_result import WITH_FRICTION
from estimator.uncertainty import Z_95
from vision.geometry import counted

_ON_CENTRELINE = "on the whisker's centreline"
SURFACE_POINTS = Table(
    "surface",
    "Of an array: a row a measured whisk's contact at first touch in the rig frame, by each "
    "estimator and as seen ([arrays.md](arrays.md)).",
    (
        WHISKER,
        TRIAL,
        WHISK,
        Column("estimator", "as in estimates.csv, or seen", Kind.TEXT),
        *with_sigma("x_mm", _ON_CENTRELINE),
        *with_sigma("y_mm", _ON_CENTRELINE),
        *with_sigma("z_mm", _ON_CENTRELINE),
        *alike(
            ("xy_covariance_mm2", "xz_covariance_mm2", "yz_covariance_mm2"),
            "the rest of their covariance",
        ),
        *with_sigma("distance_mm", "from the object's surface to the whisker's, positive outside"),
        *with_sigma("along_mm", "along the whisker, from where it comes nearest to the object"),
        Column(
            "normal_off_deg",
            "angle between the normal felt and the object's where the whisker comes nearest",
        ),
        Column("normal_sigma_deg", "sigma of the felt slope, where it is stated"),
        Column(
            "surface_from",
            "manifest: `[object]`; pictures: the bar as this whisker's cameras see it; empty where "
            "the object is not known, and of contacts seen on that bar",
            Kind.TEXT,
        ),
        status("its warnings"),
    ),
)
FELT = WITH_FRICTION  # whose contacts are the array's verdict


def write_surface(out: Path, cloud: Iterable[ContactPoint]) -> None:
    """Write surface.csv into a folder: a row a contact."""
    SURFACE_POINTS.write(out, map(_row, cloud))


def _row(contact: ContactPoint) -> dict:
    """Return the row of a contact."""
    covariance = contact.covariance_mm2
    x_mm, y_mm, z_mm = contact.point_mm.tolist()
    x_sigma_mm, y_sigma_mm, z_sigma_mm = np.sqrt(np.diag(covariance)).tolist()
    return {
        "whisker": contact.whisker,
        "trial": contact.trial,
        "whisk": contact.whisk,
        "estimator": contact.estimator,
        "x_mm": x_mm,
        "x_sigma_mm": x_sigma_mm,
        "y_mm": y_mm,
        "y_sigma_mm": y_sigma_mm,
        "z_mm": z_mm,
        "z_sigma_mm": z_sigma_mm,
        "xy_covariance_mm2": covariance[0, 1],
        "xz_covariance_mm2": covariance[0, 2],
        "yz_covariance_mm2": covariance[1, 2],
        "distance_mm": contact.distance_mm.value,
        "distance_sigma_mm": contact.distance_mm.sigma,
        "along_mm": contact.along_mm.value,
        "along_sigma_mm": contact.along_mm.sigma,
        "normal_off_deg": math.degrees(contact.normal_off_rad),
        "normal_sigma_deg": math.degrees(contact.normal_sigma_rad),
        "surface_from": contact.source,
        "status": contact.status,
    }


def _sound_contacts(cloud: Iterable[ContactPoint], estimator: str) -> list[ContactPoint]:
    """Return one estimator's contacts near a known surface that carry no status."""
    sound = []
    for contact in cloud:
        is_known = contact.distance_mm.is_known
        if contact.estimator == estimator and not contact.status and is_known:
            sound.append(contact)
    return sound


def surface_verdict(cloud: Sequence[ContactPoint]) -> Iterator[str]:
    """Yield the array's verdict in a sentence; nothing where no object is known."""
    sound = _sound_contacts(cloud, FELT)
    if not sound:
        return
    errors = _Errors.of_contacts(sound)
    across = rms_of_known(errors.across_mm[:, 0])
    along = rms_of_known(errors.along_mm[:, 0])
    worst = max(sound, key=lambda contact: abs(contact.along_mm.value))
    largest = f"{worst.along_mm.value:+.2f} ± {worst.along_mm.sigma:.2f} mm"
    whiskers = counted(len({contact.whisker for contact in sound}), "whisker")
    sources = " and ".join(sorted({contact.source for contact in sound}))
    off_deg = errors.normals_rms_deg
    normals = f"; normals are {off_deg:.1f}° RMS off" if math.isfinite(off_deg) else ""
    yield (
        f"Surface by {label_of(FELT)}: {counted(len(sound), 'contact')} felt by {whiskers} lie "
        f"{across:.2f} mm RMS off the object ({sources}) and {along:.2f} mm along the whisker, most "
        f"{largest} ({worst.whisker}, {worst.trial}){normals}."
    )


def surface_lines(cloud: Sequence[ContactPoint]) -> Iterator[str]:
    """Yield a line an estimator, and one on the seen contacts, below a head line."""
    lines = []
    for name in dict.fromkeys(contact.estimator for contact in cloud):
        sound = _sound_contacts(cloud, name)
        if sound:
            label = "seen" if name == SEEN else label_of(name)
            errors = _Errors.of_contacts(sound)
            across = _statistics(errors.across_mm)
            along = _statistics(errors.along_mm)
            off_deg = errors.normals_rms_deg
            normals = f"{off_deg:8.1f}°" if math.isfinite(off_deg) else f"{'-':>8}"
            lines.append(f"{label:<24}{len(sound):>4}     {across}     {along}    {normals}")
    if lines:
        yield f"{'':<24}{'n':>4}   off it: mean     RMS  in 95 %   along: mean     RMS  in 95 %   normals RMS"
    yield from lines


@dataclass(frozen=True, eq=False)
class _Errors:
    """How far n contacts are from the object.

    across_mm, along_mm (n, 2): distance from the surface and place along the whisker, each with its
    sigma. normals_rad (n,): angles between the normals, NaN where they are not known.
    """

    across_mm: np.ndarray
    along_mm: np.ndarray
    normals_rad: np.ndarray

    @classmethod
    def of_contacts(cls, contacts: Iterable[ContactPoint]) -> "_Errors":
        """Return the errors of contacts near a known surface."""
        rows = []
        for contact in contacts:
            across = contact.distance_mm
            along = contact.along_mm
            normal = contact.normal_off_rad
            rows.append([across.value, across.sigma, along.value, along.sigma, normal])
        table = np.array(rows)
        return cls(table[:, :2], table[:, 2:4], table[:, 4])

    @property
    def normals_rms_deg(self) -> float:
        """Return the RMS angle between felt normals and the object's; NaN where none is known."""
        return math.degrees(rms_of_known(self.normals_rad))


def _statistics(errors: np.ndarray) -> str:
    """Return mean, RMS and the share within the 95 % interval about 0 of errors (n, 2) as text."""
    values, sigmas = errors.T
    covered = 100.0 * np.mean(np.abs(values) <= Z_95 * sigmas)
    return f"{values.mean():>+9.2f}{rms_of_known(values):>8.2f}{covered:>6.0f} %"
