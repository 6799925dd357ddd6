"""The certificate of a gauge calibration, in the manner of ISO 376: what was found with U95, and what was not."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bench.gauges.felt import Stroke
from bench.gauges.gauge_readings import Pairs
from bench.gauges.matrix import GaugeMatrix, Gauges
from bench.gauges.reversal import Reversal, in_percent
from bench.gauges.weights import Scale
from bench.session.whisker import Whisker

if TYPE_CHECKING:
    from matplotlib.figure import Figure

U95 = 1.96  # half an interval of 95 % of the normal distribution, in sigmas
NOT_MEASURED = "not measured"
_MOST_NAMED = 6  # trials or whisks; more names than that have no room on the page
_LEAST_POINTS = 4  # for a curvature beside a line, with something left over


@dataclass(frozen=True)
class Certificate:
    """All that the certificate states. pairs and strokes: what the coefficients rest on; drift_rate (2,): V/s.

    roll_sigma_deg: how well the follicle's turn is known, the least well of the trials.
    """

    session: str
    whisker: Whisker
    gauges: Gauges
    pairs: tuple[Pairs, ...]
    strokes: tuple[Stroke, ...]
    drift_rate: np.ndarray
    reversals: tuple[Reversal, ...] = ()
    scale: Scale | None = None
    roll_sigma_deg: float = 0.0

    def in_newtons_of(self, scale: Scale | None) -> "Certificate":
        """The same, all moments in the newtons of the weights; as it is where there were none."""
        if scale is None:
            return self
        f = scale.factor
        pairs = tuple(
            replace(p, moments=f * p.moments, moments_covariance=f**2 * p.moments_covariance)
            for p in self.pairs
        )
        return replace(self, gauges=self.gauges.scaled(f), pairs=pairs, scale=scale)

    @property
    def stiffness(self) -> tuple[float, float]:
        """C, N·mm², in whose unit the coefficients are, and its sigma."""
        if self.scale is None:
            return self.whisker.C_Nmm2, self.whisker.C_sigma_Nmm2
        return self.scale.of(self.whisker.C_Nmm2)

    @property
    def moments(self) -> np.ndarray:
        """Moments (n, 2) from the deflection seen, in the follicle's axes."""
        return np.concatenate([p.moments for p in self.pairs])

    @property
    def residuals(self) -> np.ndarray:
        """Moments from the gauges less those seen, (n, 2)."""
        return np.concatenate([p.residuals(self.gauges.all.matrix) for p in self.pairs])

    def nonlinearity_percent(self, axis: int) -> tuple[float, float] | None:
        """Largest departure of a parabola through the origin from its best line, % of full scale, with U95.

        Over the pairs in which this axis takes most of the moment; None where these are too few.
        """
        driven = np.abs(self.moments[:, axis]) > np.abs(self.moments[:, 1 - axis])
        if driven.sum() < _LEAST_POINTS:
            return None
        share = self.moments[driven, axis] / self.gauges.full_scale_Nmm[axis]
        off = self.residuals[driven, axis] / self.gauges.full_scale_Nmm[axis]
        design = np.stack([share, share * np.abs(share)], axis=1)
        coefficients, squares, *_ = np.linalg.lstsq(design, off, rcond=None)
        scatter = np.sqrt(squares[0] / (len(off) - 2)) if len(squares) else 0.0
        sigma = scatter * np.sqrt(np.linalg.inv(design.T @ design)[1, 1])
        return 25.0 * abs(
            coefficients[1]
        ), 25.0 * U95 * sigma  # a parabola b s² is b/4 from its chord at half scale

    def repeatability_percent(self) -> float | None:
        """Standard deviation, in %, of the gain over whisks in one position of the follicle; None without a second."""
        gains: dict[float, list[float]] = {}
        for p in self.pairs:
            felt = p.volts @ self.gauges.all.matrix.T
            gains.setdefault(p.roll_deg, []).append(
                float(np.sum(felt * p.moments) / np.sum(p.moments**2))
            )
        groups = [np.array(values) for values in gains.values() if len(values) > 1]
        if not groups:
            return None
        squares = sum(((g - g.mean()) ** 2).sum() for g in groups)
        return 100.0 * float(np.sqrt(squares / sum(len(g) - 1 for g in groups)))

    def lines(self) -> list[str]:
        """The certificate as plain lines."""
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
        yield "Coefficients, N·mm/V, one weighted regression over all touching frames:"
        yield from matrix_lines(self.gauges.all)
        answer = np.linalg.inv(self.gauges.all.matrix)
        yield "Sensitivities, V per N·mm (rows: channel y, z; columns: m_y, m_z):"
        yield from ("  " + "   ".join(f"{value:+.5f}" for value in row) for row in answer)
        diagonal = np.diag(self.gauges.all.matrix)
        cross = 100.0 * self.gauges.all.matrix / diagonal
        u95 = 100.0 * U95 * self.gauges.all.sigma / diagonal
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
        for axis, name in enumerate(("m_y", "m_z")):
            bow = self.nonlinearity_percent(axis)
            said = NOT_MEASURED if bow is None else f"{bow[0]:.2f} ± {bow[1]:.2f} % of full scale"
            yield f"Non-linearity of {name}: {said}"
        again = self.repeatability_percent()
        yield "Repeatability of the gain: " + (
            f"{NOT_MEASURED} (no second whisk in one position)"
            if again is None
            else f"{again:.2f} % (one SD)"
        )
        hysteresis, returned = in_percent(
            self.reversals, self.gauges.all.matrix, self.gauges.full_scale_Nmm
        )
        yield f"Hysteresis, friction along the rod included: {_of_full_scale(hysteresis)}"
        yield f"Zero return: {_of_full_scale(returned)}"
        rms = np.sqrt(np.mean(self.residuals**2, axis=0))
        share = 100.0 * rms / self.gauges.full_scale_Nmm
        yield f"Residuals, RMS: m_y {rms[0]:.4f} N·mm ({share[0]:.2f} %), m_z {rms[1]:.4f} N·mm ({share[1]:.2f} %)"
        drift = 1e3 * self.drift_rate
        yield f"Drift allowed for, from the free strokes: y {drift[0]:.2g}, z {drift[1]:.2g} mV/s"
        yield ""

    def _basis(self) -> Iterator[str]:
        most = self.gauges.full_scale_Nmm
        yield f"Range of validity: |m_y| up to {most[0]:.2f} N·mm, |m_z| up to {most[1]:.2f} N·mm (full scale)"
        yield f"Points used: {len(self.moments)} frames of {len(self.pairs)} whisks"
        yield f"Saturated samples left out: {sum(stroke.saturated for stroke in self.strokes)}"
        missing = [name for name, rest in self.gauges.without.items() if rest is None]
        yield f"Trials used: {len(self.gauges.without)}, each judged by coefficients fitted without it"
        if missing:
            yield f"Not known without one of these, so that they are not judged: {_named(missing)}"
        yield ""

    def _assumed(self) -> Iterator[str]:
        turn = (
            f"± {U95 * self.roll_sigma_deg:.2f}°, which is in U95"
            if self.roll_sigma_deg
            else "taken as exact"
        )
        yield f"The follicle's turn: {turn}; 1° of it would look like 1.75 points of cross-talk."
        if self.scale is not None:
            yield from self._by_weights(self.scale)
            return
        sigma = self.whisker.C_sigma_Nmm2
        stated = f"± {sigma:.1f}" if sigma else "taken as exact"
        yield f"Assumed: C = 3EI = {self.whisker.C_Nmm2:.1f} N·mm² ({stated}). C cancels between calibration and"
        yield "estimate: an error of E moves these newtons, never a distance. The rod is held by one"
        yield "force; friction along it is anything from 0 to 0.4 of the normal force. Temperature was not recorded."

    def _by_weights(self, scale: Scale) -> Iterator[str]:
        """The absolute scale, and the stiffness that it amounts to."""
        C, C_sigma = scale.of(self.whisker.C_Nmm2)
        by_diameter = 4.0 * self.whisker.diameter_sigma_mm / self.whisker.diameter_mm
        E, E_sigma = scale.of(self.whisker.implied_modulus_GPa, by_diameter)
        yield f"Absolute scale, by weights ({', '.join(scale.trials)}): {scale.factor:.4f} ± {U95 * scale.sigma:.4f} of"
        yield "what the stated stiffness gives; all coefficients are in these newtons. So C = 3EI ="
        yield f"{C:.1f} ± {U95 * C_sigma:.1f} N·mm², E = {E:.2f} ± {U95 * E_sigma:.2f} GPa. C cancels between"
        yield "calibration and estimate: an error of E never shows in a distance. The rod is held by one force;"
        yield "friction along it is anything from 0 to 0.4 of the normal force."


def _named(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) <= _MOST_NAMED else f"{len(names)} of them"


def _of_full_scale(percent) -> str:
    """Largest values (2,) of m_y and m_z."""
    if percent is None:
        return f"{NOT_MEASURED} (no back stroke)"
    return f"m_y {percent[0]:.2f} %, m_z {percent[1]:.2f} % of full scale at most"


def matrix_lines(made: GaugeMatrix | None) -> Iterator[str]:
    """Rows of coefficients with U95, where they have one."""
    for row, sigmas in zip(made.matrix, made.sigma) if made is not None else ():
        cells = [f"{v:+9.4f}" + (f" ± {U95 * s:.4f}" if s > 0 else "") for v, s in zip(row, sigmas)]
        yield "  " + "   ".join(cells)


def page(certificate: Certificate) -> "Figure":
    """The certificate as one page: its lines, and the residuals over the moments."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.27, 11.69))
    figure.text(
        0.08,
        0.965,
        "\n".join(certificate.lines()),
        va="top",
        fontsize=7.6,
        family="monospace",
        linespacing=1.4,
    )
    grid = figure.subplots(
        1, 2, gridspec_kw={"left": 0.1, "right": 0.96, "bottom": 0.06, "top": 0.34, "wspace": 0.3}
    )
    for axis, (axes, name) in enumerate(zip(grid, ("m_y", "m_z"))):
        _draw_residuals(axes, certificate.pairs, certificate.gauges.all.matrix, axis)
        axes.set(xlabel=f"{name} seen  [N·mm]", ylabel="gauge less seen  [N·mm]")
        axes.axhline(0.0, color="0.6", lw=0.7)
    if len(certificate.pairs) <= _MOST_NAMED:
        grid[0].legend(fontsize=6)
    return figure


def _draw_residuals(axes, pairs: Sequence[Pairs], matrix, axis: int) -> None:
    for p in pairs:
        off, sigma = p.residuals(matrix)[:, axis], p.moments_sigma[:, axis]
        axes.errorbar(
            p.moments[:, axis],
            off,
            sigma,
            fmt="o",
            ms=3,
            lw=0.8,
            label=f"{p.trial}, whisk {p.whisk}",
        )
