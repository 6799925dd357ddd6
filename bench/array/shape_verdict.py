"""What an array's cloud of contacts says of the object's shape: table and lines."""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.array.cloud import SEEN, Contact
from bench.base.drawing import label_of
from bench.base.tables import (
    TRIAL,
    WHISK,
    WHISKER,
    Column,
    Kind,
    Table,
    alike,
    status,
    with_sigma,
)
from estimator.uncertainty import Z_95
from vision.geometry.counted import counted
from vision.truth.value import Value

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
        status("what is doubtful of it"),
    ),
)
FELT = "with_friction"  # equation (10), whose contacts are the array's verdict


def write_surface(out: Path, cloud: Iterable[Contact]) -> None:
    """Write surface.csv into a folder: a row a contact."""
    SURFACE_POINTS.write(out, map(_row, cloud))


def _row(contact: Contact) -> dict:
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


def _judged(cloud: Iterable[Contact], estimator: str) -> list[Contact]:
    """Contacts beside a known surface, by one estimator; nothing doubtful is said of them."""
    mine = (c for c in cloud if c.estimator == estimator and not c.status)
    return [c for c in mine if math.isfinite(c.distance_mm.value)]


def surface_verdict(cloud: Sequence[Contact]) -> Iterator[str]:
    """The array's verdict in a sentence; nothing where no object is known."""
    known = _judged(cloud, FELT)
    if not known:
        return
    across, along = (
        _rms([c.distance_mm.value for c in known]),
        _rms([c.along_mm.value for c in known]),
    )
    worst = max(known, key=lambda c: abs(c.along_mm.value))
    whiskers, source = (
        len({c.whisker for c in known}),
        " and ".join(sorted({c.source for c in known})),
    )
    most = f"{worst.along_mm.value:+.2f} ± {worst.along_mm.sigma:.2f} mm ({worst.whisker}, {worst.trial})"
    yield (
        f"Surface by {label_of(FELT)}: {counted(len(known), 'contact')} felt by {counted(whiskers, 'whisker')} lie "
        f"{across:.2f} mm RMS off the object ({source}) and {along:.2f} mm along the whisker, most {most}"
        f"{_normals(known)}."
    )


def _rms(values: Sequence[float]) -> float:
    """Of those that are known; NaN without any."""
    known = [value for value in values if math.isfinite(value)]
    return math.sqrt(sum(value**2 for value in known) / len(known)) if known else math.nan


def _normals(known: Sequence[Contact]) -> str:
    off_deg = math.degrees(_rms([c.normal_off_rad for c in known]))
    return f"; normals are {off_deg:.1f}° RMS off" if math.isfinite(off_deg) else ""


def surface_lines(cloud: Sequence[Contact]) -> Iterator[str]:
    """A line an estimator, and one on what is seen."""
    names = dict.fromkeys(contact.estimator for contact in cloud)
    rows = [(name, _judged(cloud, name)) for name in names]
    if any(known for _, known in rows):
        yield f"{'':<24}{'n':>4}   off it: mean     RMS  in 95 %   along: mean     RMS  in 95 %   normals RMS"
    for name, known in rows:
        if known:
            off_deg = math.degrees(_rms([c.normal_off_rad for c in known]))
            numbers = f"{_numbers(c.distance_mm for c in known)}     {_numbers(c.along_mm for c in known)}"
            normals = f"{off_deg:8.1f}°" if math.isfinite(off_deg) else f"{'-':>8}"
            yield f"{'seen' if name == SEEN else label_of(name):<24}{len(known):>4}     {numbers}    {normals}"


def _numbers(values: Iterable[Value]) -> str:
    errors, sigmas = np.array([(one.value, one.sigma) for one in values]).T
    held = 100.0 * np.mean(np.abs(errors) <= Z_95 * sigmas)
    return f"{errors.mean():>+9.2f}{_rms(errors):>8.2f}{held:>6.0f} %"
