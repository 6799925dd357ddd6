"""The certificate of a gauge calibration, in the manner of ISO 376: results with U95, and what was not measured."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bench.gauges.felt import FeltStroke
from bench.gauges.gauge_readings import NOMINAL, WIRE_ALONE, Pairs
from bench.gauges.matrix import GaugeCalibration, GaugeMatrix
from bench.gauges.reversal import Reversal, in_percent
from bench.gauges.weights import NewtonScale
from bench.session.whisker import Whisker

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# [sigmas] Half an interval of 95 % of the normal distribution.
U95 = 1.96
NOT_MEASURED = "not measured"
# [names] Of trials or whisks; more have no room on the page. A layout.
_MOST_NAMED = 6
# [points] For a curvature beside a line, with something left over. Derived.
_LEAST_POINTS = 4
_MOMENTS = ("m_y", "m_z")


@dataclass(frozen=True)
class Certificate:
    """The certificate of a gauge calibration.

    pairs and strokes: what the coefficients rest on; drift_rate (2,): V/s. roll_sigma_deg: how well
    the follicle's turn is known, the least well of the trials.
    """

    session: str
    whisker: Whisker
    gauges: GaugeCalibration
    pairs: tuple[Pairs, ...]
    strokes: tuple[FeltStroke, ...]
    drift_rate: np.ndarray
    reversals: tuple[Reversal, ...] = ()
    scale: NewtonScale | None = None
    roll_sigma_deg: float = 0.0

    def in_newtons_of(self, scale: NewtonScale | None) -> "Certificate":
        """Return the certificate with all moments in the newtons of the weights; as it is without."""
        if scale is None:
            return self
        pairs = []
        for p in self.pairs:
            scaled = replace(
                p,
                moments=scale.factor * p.moments,
                moments_covariance=scale.factor**2 * p.moments_covariance,
                by_camera_error=scale.factor * p.by_camera_error,
            )
            pairs.append(scaled)
        gauges = self.gauges.scaled(scale.factor)
        return replace(self, gauges=gauges, pairs=tuple(pairs), scale=scale)

    @property
    def stiffness(self) -> tuple[float, float]:
        """Return C, N·mm², in whose unit the coefficients are, and its sigma."""
        if self.scale is None:
            return self.whisker.C_Nmm2, self.whisker.C_sigma_Nmm2
        return self.scale.corrected(self.whisker.C_Nmm2)

    @property
    def moments(self) -> np.ndarray:
        """Return the moments (n, 2) from the deflection seen, in the follicle's axes."""
        return np.concatenate([p.moments for p in self.pairs])

    @property
    def residuals(self) -> np.ndarray:
        """Return the moments from the gauges less those seen, (n, 2)."""
        return np.concatenate([p.residuals(self.gauges.all.matrix) for p in self.pairs])

    def nonlinearity_percent(self, axis: int) -> tuple[float, float] | None:
        """Return the largest departure of a parabola from its best line, % of full scale, with U95.

        The parabola goes through the origin, over the pairs in which this axis takes most of the
        moment; None where these are too few.
        """
        driven = np.abs(self.moments[:, axis]) > np.abs(self.moments[:, 1 - axis])
        if driven.sum() < _LEAST_POINTS:
            return None
        full_scale = self.gauges.full_scale_Nmm[axis]
        share = self.moments[driven, axis] / full_scale
        residual = self.residuals[driven, axis] / full_scale
        curvature, sigma = _curvature(share, residual)
        # a parabola b s² is b/4 from its chord at half scale
        return 25.0 * abs(curvature), 25.0 * U95 * sigma

    def repeatability_percent(self) -> float | None:
        """Return the scatter of the gain over whisks in one position of the follicle, % (one SD).

        None without a second whisk in any position.
        """
        gains: dict[float, list[float]] = {}
        for p in self.pairs:
            felt = p.volts @ self.gauges.all.matrix.T
            gain = float(np.sum(felt * p.moments) / np.sum(p.moments**2))
            gains.setdefault(p.roll_deg, []).append(gain)
        squares = sum(np.var(group) * len(group) for group in gains.values())
        freedom = sum(len(group) - 1 for group in gains.values())
        return 100.0 * float(np.sqrt(squares / freedom)) if freedom else None

    def lines(self) -> list[str]:
        """Return the certificate as plain lines."""
        return [
            f"Gauge calibration of the session {self.session!r}",
            "[m_y, m_z] in the follicle's axes = matrix · ([y_V, z_V] − zero of each free stroke); U95 = 1.96 sigma",
            "",
            *self._coefficients(),
            *self._quality(),
            *self._basis(),
            *self._assumed(),
        ]

    def _coefficients(self) -> Iterator[str]:
        """Yield the lines on the coefficients."""
        fitted = self.gauges.all
        yield "Coefficients, N·mm/V, one weighted regression over all touching frames:"
        yield from matrix_lines(fitted)
        yield "Sensitivities, V per N·mm (rows: channel y, z; columns: m_y, m_z):"
        for row in np.linalg.inv(fitted.matrix):
            yield "  " + "   ".join(f"{value:+.5f}" for value in row)
        diagonal = np.diag(fitted.matrix)
        cross = 100.0 * fitted.matrix / diagonal
        u95 = 100.0 * U95 * fitted.sigma / diagonal
        yield (
            f"Cross-talk, % of the column's diagonal: y into m_z {cross[1, 0]:+.2f} ± {u95[1, 0]:.2f}, "
            f"z into m_y {cross[0, 1]:+.2f} ± {u95[0, 1]:.2f}"
        )
        yield "Beside it, the paper's way, (2) at one angle: one factor a channel and no cross-talk"
        yield from matrix_lines(self.gauges.one_factor)
        if self.gauges.at_angle is not None:
            yield "and four coefficients from the same readings"
            yield from matrix_lines(self.gauges.at_angle)
        yield ""

    def _quality(self) -> Iterator[str]:
        """Yield the lines on departures from a line: curvature, scatter, hysteresis, drift."""
        for axis, name in enumerate(_MOMENTS):
            bow = self.nonlinearity_percent(axis)
            found = NOT_MEASURED if bow is None else f"{bow[0]:.2f} ± {bow[1]:.2f} % of full scale"
            yield f"Non-linearity of {name}: {found}"
        scatter = self.repeatability_percent()
        found = f"{NOT_MEASURED} (no second whisk in one position)"
        if scatter is not None:
            found = f"{scatter:.2f} % (one SD)"
        yield f"Repeatability of the gain: {found}"
        full_scale = self.gauges.full_scale_Nmm
        hysteresis, returned = in_percent(self.reversals, self.gauges.all.matrix, full_scale)
        yield f"Hysteresis, friction along the rod included: {_of_full_scale(hysteresis)}"
        yield f"Zero return: {_of_full_scale(returned)}"
        yield from self._scatter()
        yield ""

    def _scatter(self) -> Iterator[str]:
        """Yield the lines on residuals and drift."""
        rms = np.sqrt(np.mean(self.residuals**2, axis=0))
        share = 100.0 * rms / self.gauges.full_scale_Nmm
        yield f"Residuals, RMS: m_y {rms[0]:.4f} N·mm ({share[0]:.2f} %), m_z {rms[1]:.4f} N·mm ({share[1]:.2f} %)"
        drift = 1e3 * self.drift_rate
        yield f"Drift allowed for, from the free strokes: y {drift[0]:.2g}, z {drift[1]:.2g} mV/s"

    def _basis(self) -> Iterator[str]:
        """Yield the lines on what the coefficients rest on."""
        most = self.gauges.full_scale_Nmm
        without = self.gauges.without
        yield f"Range of validity: |m_y| up to {most[0]:.2f} N·mm, |m_z| up to {most[1]:.2f} N·mm (full scale)"
        yield f"Points used: {len(self.moments)} frames of {len(self.pairs)} whisks"
        for source in (WIRE_ALONE, NOMINAL):
            names = dict.fromkeys(p.trial for p in self.pairs if p.source == source)
            if names:
                yield f"Moments {source}: {_few(list(names))}"
        yield f"Saturated samples left out: {sum(stroke.saturated for stroke in self.strokes)}"
        yield f"Trials used: {len(without)}, each judged by coefficients fitted without it"
        missing = [name for name, rest in without.items() if rest is None]
        if missing:
            yield f"Not known without one of these, so that they are not judged: {_few(missing)}"
        yield ""

    def _assumed(self) -> Iterator[str]:
        """Yield the lines on what was assumed and not measured."""
        turn = "taken as exact"
        if self.roll_sigma_deg:
            turn = f"± {U95 * self.roll_sigma_deg:.2f}°, which is in U95"
        yield f"The follicle's turn: {turn}; 1° of it would look like 1.75 points of cross-talk."
        if self.scale is not None:
            yield from self._by_weights(self.scale)
            return
        sigma = self.whisker.C_sigma_Nmm2
        stated = f"± {sigma:.1f}" if sigma else "taken as exact"
        yield f"Assumed: C = 3EI = {self.whisker.C_Nmm2:.1f} N·mm² ({stated}). C cancels between calibration and"
        yield "estimate: an error of E moves these newtons, never a distance. The rod is held by one"
        yield "force; friction along it is anything from 0 to 0.4 of the normal force. Temperature was not recorded."

    def _by_weights(self, scale: NewtonScale) -> Iterator[str]:
        """Yield the lines on the absolute scale, and the stiffness that it amounts to."""
        C, C_sigma = scale.corrected(self.whisker.C_Nmm2)
        by_diameter = 4.0 * self.whisker.diameter_sigma_mm / self.whisker.diameter_mm
        E, E_sigma = scale.corrected(self.whisker.implied_modulus_GPa, by_diameter)
        yield f"Absolute scale, by weights ({', '.join(scale.trials)}): {scale.factor:.4f} ± {U95 * scale.sigma:.4f} of"
        yield "what the stated stiffness gives; all coefficients are in these newtons. So C = 3EI ="
        yield f"{C:.1f} ± {U95 * C_sigma:.1f} N·mm², E = {E:.2f} ± {U95 * E_sigma:.2f} GPa. C cancels between"
        yield "calibration and estimate: an error of E never shows in a distance. The rod is held by one force;"
        yield "friction along it is anything from 0 to 0.4 of the normal force."


def _few(names: Sequence[str]) -> str:
    """Return names in one line, or how many there are where they are many."""
    return ", ".join(names) if len(names) <= _MOST_NAMED else f"{len(names)} of them"


def _curvature(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return b of y = a x + b x |x| over points (n,), and its sigma by their scatter."""
    design = np.stack([x, x * np.abs(x)], axis=1)
    coefficients, squares, *_ = np.linalg.lstsq(design, y, rcond=None)
    variance = squares[0] / (len(y) - 2) if len(squares) else 0.0  # of a point
    covariance = variance * np.linalg.inv(design.T @ design)
    return coefficients[1], np.sqrt(covariance[1, 1])


def _of_full_scale(percent: np.ndarray | None) -> str:
    """Return the largest values (2,) of m_y and m_z in words."""
    if percent is None:
        return f"{NOT_MEASURED} (no back stroke)"
    return f"m_y {percent[0]:.2f} %, m_z {percent[1]:.2f} % of full scale at most"


def matrix_lines(made: GaugeMatrix | None) -> Iterator[str]:
    """Yield rows of coefficients with U95, where they have one; nothing for None."""
    if made is None:
        return
    for row, sigmas in zip(made.matrix, made.sigma):
        cells = [f"{v:+9.4f}" + (f" ± {U95 * s:.4f}" if s > 0 else "") for v, s in zip(row, sigmas)]
        yield "  " + "   ".join(cells)


def page(certificate: Certificate) -> "Figure":
    """Draw the certificate as one page: its lines, and the residuals over the moments."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.27, 11.69))
    text = "\n".join(certificate.lines())
    figure.text(0.08, 0.965, text, va="top", fontsize=7.6, family="monospace", linespacing=1.4)
    margins = {"left": 0.1, "right": 0.96, "bottom": 0.06, "top": 0.34, "wspace": 0.3}
    grid = figure.subplots(1, 2, gridspec_kw=margins)
    for axis, name in enumerate(_MOMENTS):
        _draw_residuals(grid[axis], certificate.pairs, certificate.gauges.all.matrix, axis)
        grid[axis].set(xlabel=f"{name} seen  [N·mm]", ylabel="gauge less seen  [N·mm]")
        grid[axis].axhline(0.0, color="0.6", lw=0.7)
    if len(certificate.pairs) <= _MOST_NAMED:
        grid[0].legend(fontsize=6)
    return figure


def _draw_residuals(axes: "Axes", pairs: Sequence[Pairs], matrix: np.ndarray, axis: int) -> None:
    """Draw the residuals of one axis over its moments, a colour a whisk."""
    for p in pairs:
        axes.errorbar(
            p.moments[:, axis],
            p.residuals(matrix)[:, axis],
            p.moments_sigma[:, axis],
            fmt="o",
            ms=3,
            lw=0.8,
            label=f"{p.trial}, whisk {p.whisk}",
        )
