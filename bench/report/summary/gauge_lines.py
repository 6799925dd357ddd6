"""The gauges' coefficients."""

from collections.abc import Iterator

from bench.gauges.certificate import matrix_lines
from bench.gauges.matrix import GaugeCalibration


def gauge_lines(gauges: GaugeCalibration | None) -> Iterator[str]:
    """Yield the matrices with 95 % limits, and what is not known; nothing without gauges."""
    if gauges is None:
        return
    yield f"from {gauges.source}; [m_y, m_z] = matrix · [y, z] above each free stroke"
    yield from matrix_lines(gauges.all)
    others = {
        "the paper's way, one factor a channel, no cross-talk": gauges.one_factor,
        "four coefficients at one angle, (2)": gauges.at_angle,
    }
    for title, matrix in others.items():
        if matrix is not None:
            yield f"{title}:"
            yield from matrix_lines(matrix)
    missing = [name for name, matrix in gauges.without.items() if matrix is None]
    if missing:
        yield f"not known without one of these trials, so they are not judged: {', '.join(missing)}"
    yield from gauges.notes
