"""The picture of a shaded cylinder: its radiance round the rod, seen from the side and blurred by
the lens.

Each shading function of the angle round the rod has a blurred profile across the picture. Profiles
are integrated once for each ratio of half-width and blur, tabulated (`_tables`), and
interpolated linearly for all pixels.
"""

from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array

# [functions] Of the angle round a thin rod. Study: tests/vision/wire/test_cylinder.py.
WAVES = 8
# [functions] Of the angle at the two rims of a thick rod, whose edges `touched/edges.py` takes.
# Study: coverage.py alone.
RIMS = 6
# [nodes] Of Gauss and Legendre over half the circumference for each blur in the radius; the
# integrand is smooth there: 1e-5 of the contrast. Study: tests/vision/wire/test_cylinder.py.
_NODES_PER_RADIUS_TO_BLUR = 4
# [1] Segments whose half-widths differ by a smaller share take one table, whose blur is off by half
# of it at most. Study: thresholds.py wire.cylinder _SAME_RADIUS ….
_SAME_RADIUS = 0.05
# [1] Of the table: step of the logarithm of half-width over blur; interpolated in between. Study:
# tests/vision/wire/test_cylinder.py.
_RATIO_STEP = 0.05
# [rows] Of the table in each blur; interpolated in between. Study: tests/vision/wire/test_cylinder.py.
_ROWS_PER_BLUR = 12
# [blurs] How far beyond the edge the table reaches. Study: tests/vision/wire/test_cylinder.py.
_REACH_BLURS = 6.0
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
    """Return blurred pictures (…, terms + 2) of a cylinder with each shading function in turn.

    The first function (`round_the_rod`) gives the share of the pixel that the rod covers; the last
    two columns are `rim_bells`. offset_px (…): distance from the axis. radius_px: one, or (s, 1) for
    offsets (s, p). weight (…): of each pixel. room: so many more columns, of zeros.

    One table serves all pixels of nearly the same radius, scaled by it (which scales the blur by as
    little).
    """
    weight = np.ones(offset_px.shape) if weight is None else weight
    radius_px = np.maximum(radius_px, _LEAST_RADIUS_PX)
    ratio = _common_ratio(radius_px, blur_px)
    if ratio is None:
        values = np.empty((*offset_px.shape, terms + 2 + room))
        for some in alike(radius_px[:, 0]):
            values[some] = shading_basis(
                offset_px[some], radius_px[some], blur_px, terms, weight[some], room
            )
        return values
    rows_per_radius, table = _table(ratio, terms)
    between = _interpolation(offset_px / radius_px, weight, rows_per_radius, len(table))
    wide = np.pad(table, ((0, 0), (0, room)))
    return (between @ wide).reshape(*offset_px.shape, wide.shape[1])


def _interpolation(
    offset: np.ndarray, weight: np.ndarray, rows_per_radius: float, count: int
) -> csr_array:
    """Return the matrix (pixels, count) that interpolates a table of count rows at offsets, in
    radii.

    Its rows are multiplied by the weights of the pixels.
    """
    before, part = _places(offset, rows_per_radius, count)
    shares = np.empty((*before.shape, 2))
    np.multiply(part, weight, out=shares[..., 1])
    np.subtract(weight, shares[..., 1], out=shares[..., 0])
    places = np.empty((*before.shape, 2), dtype=np.int32)
    places[..., 0] = before
    places[..., 1] = before + 1
    ends = np.arange(0, shares.size + 1, 2, dtype=np.int32)
    return csr_array((shares.ravel(), places.ravel(), ends), shape=(before.size, count))


def profiles(offset_px: np.ndarray, radius_px: float, blur_px: float, terms: int) -> np.ndarray:
    """Return blurred pictures (…, terms + 2) at a few distances (…) from one cylinder's axis.

    The columns are those of `shading_basis`.
    """
    radius_px = max(radius_px, _LEAST_RADIUS_PX)
    rows_per_radius, table = _table(radius_px / blur_px, terms)
    before, part = _places(offset_px / radius_px, rows_per_radius, len(table))
    here = table[before]
    return here + part[..., None] * (table[before + 1] - here)


def slopes_of(
    offset_px: np.ndarray, radius_px: np.ndarray, blur_px: float, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return first and second derivatives by offset, (2, s, p) each, per px and per px².

    The first row is of the light that s cylinders add, the second of the share that they hide.
    offset_px (s, p), radius_px (s,); coefficients (s, terms): radiance in terms of `round_the_rod`.
    """
    radius_px = np.maximum(radius_px, _LEAST_RADIUS_PX)
    ratio = _common_ratio(radius_px, blur_px)
    if ratio is not None:
        return _slopes_of_alike(offset_px, radius_px[:, None], ratio, coefficients)
    slopes = np.empty((2, *offset_px.shape))
    curvatures = np.empty((2, *offset_px.shape))
    for some in alike(radius_px):
        slopes[:, some], curvatures[:, some] = slopes_of(
            offset_px[some], radius_px[some], blur_px, coefficients[some]
        )
    return slopes, curvatures


def _slopes_of_alike(
    offset_px: np.ndarray, radius_px: np.ndarray, ratio: float, coefficients: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return `slopes_of` cylinders of nearly one radius (s, 1), which is `ratio` blurs."""
    count, terms = coefficients.shape
    rows_per_radius, table = _table(ratio, terms)
    before, part = _places(offset_px / radius_px, rows_per_radius, len(table))
    after = before + 1
    own = before * count + np.arange(count)[:, None]  # in a table with a column a cylinder
    own_after = own + count
    change = table[:, :terms]
    per_px = rows_per_radius / radius_px
    found = []
    for scale in (per_px, per_px**2):
        change = np.gradient(change, axis=0)
        both = np.empty((2, *offset_px.shape))
        both[0] = _between(change @ coefficients.T, own, own_after, part)
        both[1] = _between(change[:, 0], before, after, part)
        both *= scale
        found.append(both)
    return found[0], found[1]


def _between(
    table: np.ndarray, before: np.ndarray, after: np.ndarray, part: np.ndarray
) -> np.ndarray:
    """Return a flat table's values between two places (…) each, `part` (…) of the way."""
    here = table.take(before)
    change = table.take(after)
    change -= here
    change *= part
    change += here
    return change


def rim_bells(offset_px: np.ndarray, radius_px: np.ndarray | float, blur_px: float) -> np.ndarray:
    """Return slope and curvature (…, 2) of the blurred share that the rod covers, in units of the
    blur.

    With z, the distance from an edge over the blur, these are the normal density of z and z times it;
    those of the edge at negative offset are subtracted from the other's.
    """
    bells = 0.0
    for side in (1.0, -1.0):
        z = (offset_px - side * radius_px) / blur_px
        bell = np.exp(-0.5 * z * z) * (side / np.sqrt(2.0 * np.pi))
        bells = bells + np.stack([bell, z * bell], axis=-1)
    return bells


def _common_ratio(radius_px: np.ndarray, blur_px: float) -> float | None:
    """Return radius over blur where it is nearly the same for all, else None."""
    thick = np.maximum(radius_px, _LEAST_RADIUS_PX)
    least = np.min(thick, initial=np.inf)
    most = np.max(thick, initial=_LEAST_RADIUS_PX)
    is_same = most - least < _SAME_RADIUS * least
    return 0.5 * (least + most) / blur_px if is_same else None


def alike(radius_px: np.ndarray) -> list[np.ndarray]:
    """Return groups of indices of radii (s,) that are nearly the same."""
    if _common_ratio(radius_px, 1.0) is not None:
        return [np.arange(len(radius_px))]
    thick = np.maximum(radius_px, _LEAST_RADIUS_PX)
    group = np.floor(np.log(thick) / np.log1p(_SAME_RADIUS))
    return [np.flatnonzero(group == one) for one in np.unique(group)]


def _places(
    offset: np.ndarray, rows_per_radius: float, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the row before each offset (…), in radii, and the part of the way to the next row."""
    place = np.clip(offset * rows_per_radius + count // 2, 0.0, count - 1.001)
    before = place.astype(np.intp)
    return before, place - before


def _table(ratio: float, terms: int) -> tuple[float, np.ndarray]:
    """Return rows per radius, and the table (n, terms + 2) for this radius over blur; 0 lies in the
    middle.
    """
    step, share = divmod(np.log(ratio) / _RATIO_STEP, 1.0)
    rows_per_radius, one, other = _tables(int(step), terms)
    return rows_per_radius, one + share * (other - one)


@lru_cache(maxsize=512)
def _tables(step: int, terms: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Return rows per radius, and tables (n, terms + 2) at this step of log(radius / blur) and the
    next.

    Rows are counted in radii, for then edges coincide and only their blur differs: 5e-4 of the
    contrast between rows and steps.
    """
    ratio = float(np.exp(_RATIO_STEP * np.float64(step)))
    next_ratio = float(np.exp(_RATIO_STEP * np.float64(step + 1)))
    rows_per_radius = _ROWS_PER_BLUR * next_ratio
    reach = int(np.ceil(rows_per_radius * (1.0 + _REACH_BLURS / ratio)))
    row = np.arange(-reach, reach + 1)
    one = _integrated(row * (ratio / rows_per_radius), ratio, terms)
    other = _integrated(row * (next_ratio / rows_per_radius), next_ratio, terms)
    return rows_per_radius, one, other


def _integrated(offset: np.ndarray, radius: float, terms: int) -> np.ndarray:
    """Return `shading_basis` at offsets (n,) by Gauss–Legendre integration round the rod; lengths in
    blurs.
    """
    count = int(np.clip(np.ceil(_NODES_PER_RADIUS_TO_BLUR * radius), 16, 96))
    nodes, shares = _legendre(count)
    t = 0.5 * np.pi * nodes  # angle round the rod
    distance = offset[:, None] - radius * np.sin(t)  # (n, nodes), from each point of the rod
    bell = np.exp(-0.5 * distance * distance)
    width = 0.5 * np.pi * shares * np.cos(t) / np.sqrt(2 * np.pi)  # of what a node stands for
    light = (bell * (radius * width)) @ round_the_rod(t, terms)
    return np.concatenate([light, rim_bells(offset, radius, 1.0)], axis=-1)


_legendre = lru_cache(np.polynomial.legendre.leggauss)


def round_the_rod(t: np.ndarray, terms: int) -> np.ndarray:
    """Return shading functions (n, terms) of the angle t (n,) round the rod; the first is 1.

    t goes from edge (-π/2) to edge (π/2). As many as RIMS: for each side its own square polynomial
    in the angle from the edge, for a rod so thick that the two rims can be fitted alone. Else a
    Fourier series, 1, sin t, cos t, sin 2t, …, for the whole of a thin rod.
    """
    functions = []
    if terms == RIMS:
        side = np.sign(t)
        inward = np.pi / 2 - np.abs(t)
        for k in range(RIMS // 2):
            functions += [inward**k, side * inward**k]
        return np.stack(functions, axis=-1)
    functions.append(np.ones_like(t))
    for k in range(1, terms // 2 + 1):
        functions += [np.sin(k * t), np.cos(k * t)]
    return np.stack(functions[:terms], axis=-1)
