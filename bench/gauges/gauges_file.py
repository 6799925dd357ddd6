"""gauges.toml and [gauges]: coefficients brought along, or made by `calibrate gauges` and copied here."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tomli_w

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.base.toml_text import read_toml
from bench.gauges.matrix import FROM_FILE, FROM_MANIFEST, GaugeCalibration, GaugeMatrix
from bench.session import manifest, plausible
from bench.session.givens import with_sigmas
from bench.session.session import Session
from bench.session.strict_toml import as_keys, convert
from bench.session.written_covariance import is_covariance

Rows4 = Annotated[
    list[manifest.Row4],
    msgspec.Meta(min_length=4, max_length=4),
]


class WithoutKeys(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Coefficients without one trial; no matrix where the others do not fix it."""

    matrix_Nmm_per_V: manifest.Matrix | None = None
    covariance: Rows4 | None = None


@dataclass(frozen=True, kw_only=True)
class FileKeys(manifest.GaugeKeys):
    """The keys of [gauges], and what `calibrate gauges` adds to them."""

    # 4 × 4, of the matrix row by row
    covariance: Rows4 | None = None
    # 3 E I that the coefficients rest on: with another, they are scaled, so that C cancels in d_x
    C_Nmm2: Annotated[float, plausible.THREE_RIGIDITIES] | None = None
    C_sigma_Nmm2: float | None = None
    # largest moments that were calibrated
    full_scale_Nmm: manifest.Pair | None = None
    # the paper's way: one factor a channel, no cross-talk
    one_factor_Nmm_per_V: list[float] | None = None
    # by gauge trial: `matrix_Nmm_per_V` and `covariance` without it, by which that trial itself is
    # judged
    without: dict[str, WithoutKeys] | None = None


def given_gauges(session: Session) -> GaugeCalibration | None:
    """Return the coefficients in gauges.toml, else in [gauges]; None where there are none."""
    if session.gauges_toml is not None:
        return read_gauges(session.gauges_toml, session.whisker.C_Nmm2)
    given = session.gauges
    if given is None:
        return None
    covariance = np.diag(given.matrix_sigma_Nmm_per_V.ravel() ** 2)
    return GaugeCalibration(GaugeMatrix(given.matrix_Nmm_per_V, covariance), FROM_MANIFEST)


def read_gauges(path: Path, C_Nmm2: float) -> GaugeCalibration:
    """Read coefficients with their covariance, scaled to the session's C where they rest on another.

    C so cancels in d_x. Raises BadInput where the file is not as the session format says.
    """
    table = read_toml(path, path.name)
    as_keys(table, FileKeys, path.name, InputProblems())
    filled, _ = with_sigmas(table, FileKeys)
    keys = convert(filled, FileKeys)
    covariance = keys.covariance
    if covariance is None:
        covariance = np.diag(np.ravel(keys.matrix_sigma_Nmm_per_V) ** 2)
    without = {}
    for name, rest in (keys.without or {}).items():
        place = f"[without.{name}] "
        without[name] = _matrix(rest.matrix_Nmm_per_V, rest.covariance, path.name, place)
    factors = keys.one_factor_Nmm_per_V
    full_scale = keys.full_scale_Nmm
    gauges = GaugeCalibration(
        _matrix(keys.matrix_Nmm_per_V, covariance, path.name),
        FROM_FILE,
        without,
        one_factor=None if factors is None else GaugeMatrix(np.diag(factors)),
        full_scale_Nmm=None if full_scale is None else np.array(full_scale),
    )
    return gauges if keys.C_Nmm2 is None else _in_unit(gauges, C_Nmm2 / keys.C_Nmm2)


def _in_unit(gauges: GaugeCalibration, scale: float) -> GaugeCalibration:
    """Return coefficients that were made with a C that is `scale` times smaller, with a note on it."""
    if abs(scale - 1.0) >= 1e-9:
        note = f"scaled by {scale:.6g} from the C that they were made with"
        gauges = replace(gauges, notes=(note,))
    return gauges.scaled(scale)


def write_gauges(
    path: Path,
    gauges: GaugeCalibration,
    zero: tuple[np.ndarray, np.ndarray],
    C: tuple[float, float],
    header: list[str],
) -> None:
    """Write gauges.toml whole; `header` goes before it as comments.

    zero: volts (2,) and their sigma (2,); C: the stiffness in whose unit the coefficients are, with
    its sigma.
    """
    document = {
        "offset_V": zero[0],
        "offset_sigma_V": zero[1],
        "matrix_Nmm_per_V": gauges.all.matrix,
        "matrix_sigma_Nmm_per_V": gauges.all.sigma,
        "covariance": gauges.all.covariance,
        "C_Nmm2": C[0],
        "C_sigma_Nmm2": C[1],
        "full_scale_Nmm": gauges.full_scale_Nmm,
    }
    if gauges.one_factor is not None and np.isfinite(gauges.one_factor.matrix).all():
        document["one_factor_Nmm_per_V"] = np.diag(gauges.one_factor.matrix)
    without = {name: _coefficients(rest) for name, rest in gauges.without.items()}
    comments = "".join(f"# {line}".rstrip() + "\n" for line in header)
    tables = _as_lists(document) | {"without": without}
    write_whole(path, f"{comments}\n{tomli_w.dumps(tables)}")


def _coefficients(rest: GaugeMatrix | None) -> dict[str, list]:
    """Return coefficients without one trial as TOML has them; nothing where they are not fixed."""
    if rest is None:
        return {}
    return _as_lists({"matrix_Nmm_per_V": rest.matrix, "covariance": rest.covariance})


def _as_lists(arrays: Mapping[str, np.ndarray | float]) -> dict[str, list | float]:
    """Return arrays and numbers by name as TOML has them."""
    return {name: np.asarray(value, dtype=float).tolist() for name, value in arrays.items()}


def _matrix(
    coefficients: list | None, covariance: list | np.ndarray | None, file: str, place: str = ""
) -> GaugeMatrix | None:
    """Return coefficients with their covariance, exact where it is not given; None without them.

    Raises BadInput, naming file and place, for what is no matrix of numbers, or no covariance.
    """
    if coefficients is None:
        return None
    matrix = np.array(coefficients, dtype=float)
    known = np.zeros((4, 4)) if covariance is None else np.array(covariance, dtype=float)
    if not np.all(np.abs(matrix) <= plausible.NUMBER.high):
        found = f"{place}matrix_Nmm_per_V is not of numbers {plausible.NUMBER.allowed}"
        raise BadInput(found, file=file)
    if not is_covariance(known):
        found = f"{place}covariance is none: symmetric, with variances of 0 or more, is allowed"
        raise BadInput(found, file=file)
    return GaugeMatrix(matrix, known)
