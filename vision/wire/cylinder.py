"""The picture of a shaded cylinder: its radiance round the rod, seen from the side and blurred by the lens."""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

# [functions] Of the angle: for a thin rod, and for the two rims of a thick one, whose edges
# `bar/edges.py` takes. Study: tests/vision/wire/test_cylinder.py, coverage.py alone.
WAVES, RIMS = 8, 6
# [nodes] Of Gauss and Legendre over half the circumference for each blur in the radius; the
# integrand is smooth there: 1e-5 of the contrast. Study: tests/vision/wire/test_cylinder.py.
_NODES_PER_RADIUS_TO_BLUR = 4
# [1] Pieces whose half-widths differ by a smaller share take one table, whose blur is off by half
# of it at most. Study: thresholds.py lines.cylinder _SAME_RADIUS ….
_SAME_RADIUS = 0.05
# [1, rows, blurs] Of the table: step of the logarithm of half-width over blur, rows, and how far
# beyond the edge; between rows it is interpolated. Study: tests/vision/wire/test_cylinder.py.
_RATIO_STEP, _ROWS_PER_BLUR, _REACH_BLURS = 0.05, 12, 6.0
# [px] Thinner is as good as nothing: a wire of 1 grey level beside 100. Derived.
_LEAST_RADIUS_PX = 0.05


def shading_basis(
    offset_px: np.ndarray,
    radius_px: np.ndarray,
    blur_px: float,
    terms: int,
    weight: np.ndarray | None = None,
    room: int = 0,
) -> np.ndarray:
    """Blurred pictures (..., terms + 2) of a cylinder whose radiance is each function of `round_the_rod` in turn; the
    last two are `rim_bells`.

    The first term is the share of the pixel that the rod covers. offset_px (...): distance from the axis; radius_px:
    one, or (s, 1) for offsets (s, p). One table serves all pixels of nearly the same radius, stretched by it (which
    stretches the blur with it, by as little). weight (...): of each pixel; room: so many more columns, of zeros.
    """
    weight = np.ones(offset_px.shape) if weight is None else weight
    ratio = _one_ratio(radius_px, blur_px)
    if ratio is None:
        values = np.empty((*offset_px.shape, terms + 2 + room))
        for some in alike(radius_px[:, 0]):
            values[some] = shading_basis(
                offset_px[some], radius_px[some], blur_px, terms, weight[some], room
            )
        return values
    rows, table = _table(ratio, terms)
    before, part = _places(offset_px / radius_px, rows, len(table))
    shares, places = np.empty((*before.shape, 2)), np.empty((*before.shape, 2), dtype=np.int32)
    np.multiply(part, weight, out=shares[..., 1])
    np.subtract(weight, shares[..., 1], out=shares[..., 0])
    places[..., 0], places[..., 1] = before, before + 1
    ends = np.arange(0, shares.size + 1, 2, dtype=np.int32)
    between = csr_array((shares.ravel(), places.ravel(), ends), shape=(before.size, len(table)))
    wide = np.zeros((len(table), table.shape[1] + room))
    wide[:, : table.shape[1]] = table
    return (between @ wide).reshape(*before.shape, wide.shape[1])


def profiles(offset_px: np.ndarray, radius_px: float, blur_px: float, terms: int) -> np.ndarray:
    """As `shading_basis`, of a few distances (...) from one cylinder's axis."""
    rows, table = _table(max(radius_px, _LEAST_RADIUS_PX) / blur_px, terms)
    before, part = _places(offset_px / max(radius_px, _LEAST_RADIUS_PX), rows, len(table))
    here = table[before]
    return here + part[..., None] * (table[before + 1] - here)


def slopes_of(
    offset_px: np.ndarray, radius_px: np.ndarray, blur_px: float, waves: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """First and second derivatives (2, s, p) each, by offset, per px and per px², of what s cylinders add to the light
    and of what they hide.

    offset_px (s, p), radius_px (s,); waves (s, terms): the radiance of each in terms of `round_the_rod`.
    """
    ratio = _one_ratio(radius_px, blur_px)
    slopes, curvatures = np.empty((2, 2, *offset_px.shape))
    if ratio is None:
        for some in alike(radius_px):
            slopes[:, some], curvatures[:, some] = slopes_of(
                offset_px[some], radius_px[some], blur_px, waves[some]
            )
        return slopes, curvatures
    radius_px, terms = radius_px[:, None], waves.shape[1]
    rows, table = _table(ratio, terms)
    before, part = _places(offset_px / radius_px, rows, len(table))
    each = before * len(waves) + np.arange(len(waves))[:, None]
    places = ((each, each + len(waves)), (before, before + 1))
    change = table[:, :terms]
    for found in (slopes, curvatures):
        change = np.gradient(change, axis=0)
        for into, profile, (row, next_row) in zip(found, (change @ waves.T, change[:, 0]), places):
            here = profile.take(row)
            into[:] = here + part * (profile.take(next_row) - here)
    return slopes * (rows / radius_px), curvatures * (rows / radius_px) ** 2


def rim_bells(offset_px: np.ndarray, radius_px: np.ndarray | float, blur_px: float) -> np.ndarray:
    """Bells (..., 2) where the blurred rod begins and ends: normal densities of z, the distance from the edge over the
    blur, and z times them; those of the edge at negative offset are taken away from the other's."""
    bells = 0.0
    for side in (1.0, -1.0):
        z = (offset_px - side * radius_px) / blur_px
        bell = np.exp(-0.5 * z * z) * (side / np.sqrt(2.0 * np.pi))
        bells = bells + np.stack([bell, z * bell], axis=-1)
    return bells


def _one_ratio(radius_px, blur_px: float) -> float | None:
    """Radius over blur, where it is nearly the same for all."""
    least, most = np.min(radius_px, initial=np.inf), np.max(radius_px, initial=0.0)
    same = most - least < _SAME_RADIUS * least or most <= _LEAST_RADIUS_PX
    return 0.5 * (least + most) / blur_px if same else None


def alike(radius_px: np.ndarray) -> list[np.ndarray]:
    """Of radii (s,) the places of those that are nearly the same, group by group."""
    if _one_ratio(radius_px, 1.0) is not None:
        return [np.arange(len(radius_px))]
    group = np.floor(np.log(np.maximum(radius_px, _LEAST_RADIUS_PX)) / np.log1p(_SAME_RADIUS))
    return [np.flatnonzero(group == one) for one in np.unique(group)]


def _places(offset, rows: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Row before each offset (...), in radii, and how far on to the next it lies."""
    place = np.clip(offset * rows + count // 2, 0.0, count - 1.001)
    before = place.astype(np.intp)
    return before, place - before


def _table(ratio: float, terms: int) -> tuple[float, np.ndarray]:
    """Rows per radius, and values (n, terms + 2) for this radius over blur; zero lies in the middle."""
    step, share = divmod(np.log(ratio) / _RATIO_STEP, 1.0)
    rows, one, other = _tables(int(step), terms)
    return rows, one + share * (other - one)


@lru_cache(maxsize=512)
def _tables(step: int, terms: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Rows per radius, and values (n, terms + 2) for radius over blur at this step of its logarithm and at the next.

    Counted in radii, for then edges coincide and only their blur differs: 5e-4 of the contrast between rows and steps.
    """
    ratios = np.exp(_RATIO_STEP * np.array([step, step + 1]))
    rows = _ROWS_PER_BLUR * ratios[1]
    reach = int(np.ceil(rows * (1.0 + _REACH_BLURS / ratios[0])))
    one, other = (
        _integrated(np.arange(-reach, reach + 1) * (ratio / rows), ratio, 1.0, terms)
        for ratio in ratios
    )
    return rows, one, other


def _integrated(offset_px, radius_px, blur_px: float, terms: int) -> np.ndarray:
    """`shading_basis` by integration round the rod."""
    ratio = np.max(radius_px, initial=1.0) / blur_px
    nodes, shares = _legendre(int(np.clip(np.ceil(_NODES_PER_RADIUS_TO_BLUR * ratio), 16, 96)))
    t = 0.5 * np.pi * nodes
    radius = np.asarray(radius_px)[..., None]
    z = (offset_px[..., None] - radius * np.sin(t)) / blur_px
    share = 0.5 * np.pi * shares * np.cos(t) / (blur_px * np.sqrt(2 * np.pi))
    weight = np.exp(-0.5 * z * z) * (radius * share)
    return np.concatenate(
        [weight @ round_the_rod(t, terms), rim_bells(offset_px, radius_px, blur_px)], axis=-1
    )


_legendre = lru_cache(np.polynomial.legendre.leggauss)


def round_the_rod(t: np.ndarray, terms: int) -> np.ndarray:
    """Functions (n, terms) of the angle t (n,) round the rod, from edge (-pi/2) to edge (pi/2); the first is 1.

    WAVES: 1, sin t, cos t, sin 2t …, the whole of a thin rod. RIMS: for each side its own square polynomial in the
    angle from the edge, for a rod so thick that the two rims can be looked at alone.
    """
    if terms == RIMS:
        side, inward = np.sign(t), np.pi / 2 - np.abs(t)
        return np.stack(
            [shape for k in range(RIMS // 2) for shape in (inward**k, side * inward**k)], axis=-1
        )
    waves = [np.ones_like(t)]
    for k in range(1, terms // 2 + 1):
        waves += [np.sin(k * t), np.cos(k * t)]
    return np.stack(waves[:terms], axis=-1)
