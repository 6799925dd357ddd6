"""The gauges' coefficients."""

from collections.abc import Iterator

from bench.gauges.certificate import matrix_lines
from bench.gauges.matrix import GaugeCalibration, GaugeMatrix


def gauge_lines(gauges: GaugeCalibration | None) -> Iterator[str]:
    """The matrices with 95 % limits, and what is not known; nothing without gauges."""
    if gauges is None:
        return
    yield f"from {gauges.source}; [m_y, m_z] = matrix · [y, z] above each free stroke"
    yield from _matrix_lines("", gauges.all)
    yield from _matrix_lines(
        "the paper's way, one factor a channel, no cross-talk", gauges.one_factor
    )
    yield from _matrix_lines("four coefficients at one angle, (2)", gauges.at_angle)
    missing = [name for name, matrix in gauges.without.items() if matrix is None]
    if missing:
        yield f"not known without one of these trials, so they are not judged: {', '.join(missing)}"
    yield from gauges.notes


def _matrix_lines(title: str, gauges: GaugeMatrix | None) -> Iterator[str]:
    if gauges is not None:
        yield from [f"{title}:"] * bool(title)
        yield from matrix_lines(gauges)
