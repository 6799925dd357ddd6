"""gauges.toml and [gauges]: coefficients brought along, or made by `calibrate gauges` and copied here."""

from pathlib import Path

import numpy as np

from bench import manifest
from bench.doubts import Doubts
from bench.gauges import FROM_FILE, FROM_MANIFEST, GaugeMatrix, Gauges
from bench.session import Session
from bench.strict_toml import as_keys, read_toml


def given_gauges(session: Session) -> Gauges | None:
    """Coefficients in gauges.toml, which has the last word, or in [gauges]; None where there are none."""
    if session.gauges_toml is not None:
        return read_gauges(session.gauges_toml)
    if session.gauges is None:
        return None
    given = session.gauges
    return Gauges(_matrix(given.matrix_Nmm_per_V, given.matrix_sigma_Nmm_per_V), FROM_MANIFEST)


def read_gauges(path: Path) -> Gauges:
    """Coefficients with their sigmas. Raises BadInput where the file is not as the session format says."""
    keys = as_keys(read_toml(path, path.name), manifest.GaugeKeys, path.name, Doubts())
    return Gauges(_matrix(keys.matrix_Nmm_per_V, keys.matrix_sigma_Nmm_per_V), FROM_FILE)


def _matrix(values, sigmas) -> GaugeMatrix:
    """Sigmas that are not given are taken as exact."""
    sigmas = np.zeros((2, 2)) if sigmas is None else np.asarray(sigmas, dtype=float)
    return GaugeMatrix(np.asarray(values, dtype=float), np.diag(np.ravel(sigmas) ** 2))
