"""gauges.toml and [gauges]: coefficients brought along, or made by `calibrate gauges` and copied here."""

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
import tomli_w

from bench.base.atomic import write_whole
from bench.base.doubts import Doubts
from bench.gauges.matrix import FROM_FILE, FROM_MANIFEST, GaugeMatrix, Gauges
from bench.session import manifest
from bench.session.session import Session
from bench.session.strict_toml import Keys, as_keys, read_toml

Rows4 = Annotated[
    list[manifest.Row4],
    msgspec.Meta(min_length=4, max_length=4),
]


class WithoutKeys(Keys, kw_only=True, forbid_unknown_fields=True):
    """Coefficients without one trial; no matrix where the others do not fix it."""

    matrix_Nmm_per_V: manifest.Matrix | None = None
    covariance: Rows4 | None = None


class FileKeys(manifest.GaugeKeys, kw_only=True):
    """The keys of [gauges], and what `calibrate gauges` adds to them."""

    # 4 × 4, of the matrix row by row
    covariance: Rows4 | None = None
    # 3 E I that the coefficients rest on: with another, they are scaled, so that C cancels in d_x
    C_Nmm2: float | None = None
    C_sigma_Nmm2: float | None = None
    # largest moments that were calibrated
    full_scale_Nmm: manifest.Pair | None = None
    # the paper's way: one factor a channel, no cross-talk
    one_factor_Nmm_per_V: list[float] | None = None
    # by gauge trial: `matrix_Nmm_per_V` and `covariance` without it, by which that trial itself is
    # judged
    without: dict[str, WithoutKeys] | None = None


def given_gauges(session: Session) -> Gauges | None:
    """Coefficients in gauges.toml, which has the last word, or in [gauges]; None where there are none."""
    if session.gauges_toml is not None:
        return read_gauges(session.gauges_toml, session.whisker.C_Nmm2)
    if session.gauges is None:
        return None
    given = session.gauges
    return Gauges(_matrix(given.matrix_Nmm_per_V, given.matrix_sigma_Nmm_per_V), FROM_MANIFEST)


def read_gauges(path: Path, C_Nmm2: float) -> Gauges:
    """Coefficients with their covariance, scaled to the session's C where they rest on another: so C cancels in d_x.

    Raises BadInput where the file is not as the session format says.
    """
    keys = as_keys(read_toml(path, path.name), FileKeys, path.name, Doubts())
    scale = 1.0 if keys.C_Nmm2 is None else C_Nmm2 / keys.C_Nmm2
    without = {
        name: _scaled(w.matrix_Nmm_per_V, w.covariance, scale)
        for name, w in (keys.without or {}).items()
    }
    sigma = keys.matrix_sigma_Nmm_per_V
    given = _matrix(keys.matrix_Nmm_per_V, sigma)
    covariance = given.covariance if keys.covariance is None else np.array(keys.covariance)
    factors = keys.one_factor_Nmm_per_V
    return Gauges(
        _scaled(keys.matrix_Nmm_per_V, covariance, scale),
        FROM_FILE,
        without,
        None if factors is None else GaugeMatrix(scale * np.diag(factors)),
        full_scale_Nmm=None
        if keys.full_scale_Nmm is None
        else scale * np.array(keys.full_scale_Nmm),
        notes=()
        if abs(scale - 1.0) < 1e-9
        else (f"scaled by {scale:.6g} from the C that they were made with",),
    )


def write_gauges(
    path: Path,
    gauges: Gauges,
    zero: tuple[np.ndarray, np.ndarray],
    C: tuple[float, float],
    header: list[str],
) -> None:
    """Write gauges.toml whole; `header` goes before it as comments.

    zero: volts (2,) and their sigma (2,); C: the stiffness in whose unit the coefficients are, with its sigma.
    """
    document = {
        "offset_V": _listed(zero[0]),
        "offset_sigma_V": _listed(zero[1]),
        "matrix_Nmm_per_V": _listed(gauges.all.matrix),
        "matrix_sigma_Nmm_per_V": _listed(gauges.all.sigma),
        "covariance": _listed(gauges.all.covariance),
        "C_Nmm2": float(C[0]),
        "C_sigma_Nmm2": float(C[1]),
        "full_scale_Nmm": _listed(gauges.full_scale_Nmm),
    }
    if gauges.one_factor is not None and np.isfinite(gauges.one_factor.matrix).all():
        document["one_factor_Nmm_per_V"] = _listed(np.diag(gauges.one_factor.matrix))
    document["without"] = {name: _without(matrix) for name, matrix in gauges.without.items()}
    write_whole(
        path,
        "".join(f"# {line}".rstrip() + "\n" for line in header) + "\n" + tomli_w.dumps(document),
    )


def _without(matrix: GaugeMatrix | None) -> dict:
    if matrix is None:
        return {}
    return {"matrix_Nmm_per_V": _listed(matrix.matrix), "covariance": _listed(matrix.covariance)}


def _listed(values) -> list:
    return np.asarray(values, dtype=float).tolist()


def _scaled(matrix, covariance, scale: float) -> GaugeMatrix | None:
    if matrix is None:
        return None
    covariance = np.zeros((4, 4)) if covariance is None else np.asarray(covariance, dtype=float)
    return GaugeMatrix(scale * np.asarray(matrix, dtype=float), scale**2 * covariance)


def _matrix(values, sigmas) -> GaugeMatrix:
    """Sigmas that are not given are taken as exact."""
    sigmas = np.zeros((2, 2)) if sigmas is None else np.asarray(sigmas, dtype=float)
    return GaugeMatrix(np.asarray(values, dtype=float), np.diag(np.ravel(sigmas) ** 2))
