"""Error of (10) over slope and friction: measured cells, and what (13), (14) predict for the same α and α_est.

A whisk's friction is its surface's: α as seen, where pictures show it, else as Fig. 8's fit has it. Cells in which
nothing was measured stay empty.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bench.analyses.analysis import Analysis, EvaluatedRun
from bench.analyses.friction_tables import SurfaceFriction
from bench.base.drawing import blank
from bench.base.tables import Column, Kind, Table, alike
from bench.records.trial_result import TrialResult
from bench.trials.estimate_errors import judge
from estimator.beam import Beam
from estimator.threshold import distance_error
from vision.geometry import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ERROR_MAP = Table(
    "error_map",
    "A row a cell of slope and friction with whisks in it.",
    (
        *alike(("beta_from_deg", "beta_to_deg", "alpha_from_deg", "alpha_to_deg"), "the cell"),
        Column("whisks", "how many whisks in it", Kind.WHOLE),
        Column("error_percent", "error of (10), mean"),
        Column("error_sd_percent", "error of (10), standard deviation"),
        Column("predicted_percent", "error by (13) and (14)"),
    ),
)
_BETA_DEG = 5.0  # width of a cell; slopes of 0, 5, 10 … lie in the middles of theirs
_ALPHA_DEG = 2.5  # height of a cell
# [cells] A map of fewer is nearly blank: its table says as much. Stated.
_FEWEST_CELLS = 3
_STEEPEST_DEG = 82.5  # the map's edge, the upper end of the cell of 80°


@dataclass(frozen=True)
class MapCell:
    """Whisks of alike slope and friction.

    beta_deg, alpha_deg: lower edges of the cell. errors, predicted (whisks,): percent.
    """

    beta_deg: float
    alpha_deg: float
    errors: np.ndarray
    predicted: np.ndarray

    @property
    def error_percent(self) -> float:
        """Return the mean error of its whisks."""
        return float(self.errors.mean())


@dataclass(frozen=True, eq=False)
class MeasuredMap:
    """The cells that hold a whisk, and with what the whole field is predicted.

    beam, d_x_mm: a whisker that tapers changes relative errors, here at the session's median distance.
    """

    cells: tuple[MapCell, ...]
    alpha_est_rad: float
    beam: Beam
    d_x_mm: float

    @property
    def highest_deg(self) -> float:
        """Return the friction angle up to which the map is drawn."""
        return max(30.0, *(cell.alpha_deg + _ALPHA_DEG for cell in self.cells))

    @property
    def largest_percent(self) -> float:
        """Return the error at which the scale of colours ends."""
        return max(10.0, *(abs(cell.error_percent) for cell in self.cells))


class ErrorMap(Analysis):
    """How far (10) errs at which slope and friction."""

    tables = (ERROR_MAP,)
    figure_name = "error_map"
    figure_title = "Error of (10) over slope and friction"
    figure_caption = "Points: measured. Colours: as (13), (14) predict."

    def compute(self, run: EvaluatedRun) -> MeasuredMap:
        """Return the measured cells, and what the prediction needs."""
        alpha_est_rad = run.settings.alpha_est_rad
        cells = measured_cells(run.results, run.friction, alpha_est_rad)
        distances_mm = [one.surface.common_d_x_mm for one in run.friction]
        d_x_mm = float(np.median(distances_mm)) if distances_mm else np.nan
        return MeasuredMap(tuple(cells), alpha_est_rad, run.whisker.beam, d_x_mm)

    def rows(self, found: MeasuredMap) -> dict[Table, list[dict]]:
        """Return a row a cell."""
        return {ERROR_MAP: [_row(cell) for cell in found.cells]}

    def figure(self, found: MeasuredMap) -> "Figure | None":
        """Draw the measured cells, and to their right the predicted field, in one scale of colours.

        Return None where fewer than _FEWEST_CELLS were measured.
        """
        if len(found.cells) < _FEWEST_CELLS:
            return None
        drawing = blank(9.6, 3.9)
        left, right = drawing.subplots(1, 2, sharex=True, sharey=True)
        most = found.largest_percent
        top = found.highest_deg
        colours = {"cmap": "RdBu_r", "vmin": -most, "vmax": most}
        measured, beta_deg, alpha_deg = _field(found.cells, top)
        mesh = left.pcolormesh(beta_deg, alpha_deg, measured, **colours)
        _write_errors(left, found.cells, most)
        _draw_prediction(right, found, colours)
        _label_axes(left, right, found)
        drawing.colorbar(mesh, ax=[left, right], label="error of d$_x$ by (10)  [%]", extend="both")
        return drawing


def _draw_prediction(axes: "Axes", found: MeasuredMap, colours: dict) -> None:
    """Draw the error of (10) by (13), (14) over slopes and friction angles, in a scale of colours."""
    beta_deg = np.linspace(0.0, _STEEPEST_DEG, 166)
    alpha_deg = np.linspace(0.0, found.highest_deg, 121)
    slopes_rad, angles_rad = np.meshgrid(np.radians(beta_deg), np.radians(alpha_deg))
    error = distance_error(slopes_rad, angles_rad, found.alpha_est_rad)
    percent = 100.0 * found.beam.error_share(found.d_x_mm, error)
    most = found.largest_percent
    clipped = np.clip(percent, -most, most)
    axes.pcolormesh(beta_deg, alpha_deg, clipped, shading="nearest", rasterized=True, **colours)


def measured_cells(
    results: Sequence[TrialResult], friction: Sequence[SurfaceFriction], alpha_est_rad: float
) -> list[MapCell]:
    """Return the cells that hold a whisk, by slope and friction."""
    errors: dict[tuple[float, float], list[tuple[float, float]]] = {}
    half = 0.5 * _BETA_DEG
    for beta_deg, alpha_rad, error, beam, d_x_mm in _whisks(results, friction):
        slope_deg = abs(beta_deg)
        edges = (
            _edge(slope_deg + half, _BETA_DEG) - half,
            _edge(np.degrees(alpha_rad), _ALPHA_DEG),
        )
        on_cylinder = distance_error(np.radians(slope_deg), alpha_rad, alpha_est_rad)
        predicted = 100.0 * float(beam.error_share(d_x_mm, on_cylinder))
        errors.setdefault(edges, []).append((error, predicted))
    return [MapCell(*edges, *np.array(errors[edges]).T) for edges in sorted(errors)]


def _edge(value: float, size: float) -> float:
    """Return the lower edge of a value's cell."""
    return float(np.floor(value / size) * size)


def _whisks(
    results: Sequence[TrialResult], friction: Sequence[SurfaceFriction]
) -> Iterator[tuple[float, float, float, Beam, float]]:
    """Yield (β in degrees, α in rad, error in percent, beam, d_x in mm) of whisks with all known."""
    sound = {}
    for judged in judge(results):
        if judged.is_by_ten and not judged.has_warning:
            sound[judged.trial, judged.whisk] = judged
    for surface in friction:
        alpha = surface.best_alpha_rad
        for whisk in surface.whisks:
            judged = sound.get(whisk.key)
            if judged is None or not alpha >= 0:
                continue
            if np.isfinite([judged.beta_deg, judged.error_percent]).all():
                beam = surface.surface.beam
                yield judged.beta_deg, alpha, judged.error_percent, beam, judged.d_x_mm


def _row(cell: MapCell) -> dict:
    """Return the row of a cell."""
    count = len(cell.errors)
    return {
        "beta_from_deg": max(cell.beta_deg, 0.0),
        "beta_to_deg": cell.beta_deg + _BETA_DEG,
        "alpha_from_deg": cell.alpha_deg,
        "alpha_to_deg": cell.alpha_deg + _ALPHA_DEG,
        "whisks": count,
        "error_percent": cell.error_percent,
        "error_sd_percent": float(cell.errors.std(ddof=1)) if count > 1 else None,
        "predicted_percent": float(cell.predicted.mean()),
    }


def _label_axes(left: "Axes", right: "Axes", found: MeasuredMap) -> None:
    """Label the measured cells and the predicted field, and mark the assumed friction angle."""
    alpha_est_deg = np.degrees(found.alpha_est_rad)
    y_limits = (0.0, found.highest_deg)
    for axes, title in ((left, _title(found.cells)), (right, "predicted by (13), (14)")):
        axes.set(xlabel="slope β  [°]", title=title, xlim=(-2.5, _STEEPEST_DEG), ylim=y_limits)
        axes.axhline(alpha_est_deg, color="black", lw=0.8, ls=":")
    left.set_ylabel("friction angle α  [°]")
    left.text(80.0, alpha_est_deg, "α$_{est}$", va="bottom", ha="right", fontsize=8)


def _title(cells: Sequence[MapCell]) -> str:
    """Return on how many whisks the map rests, and that empty cells are empty."""
    counts = [len(cell.errors) for cell in cells]
    fewest = min(counts)
    most = max(counts)
    each = f"{fewest} a cell" if fewest == most else f"{fewest} to {most} a cell"
    return f"measured: {counted(sum(counts), 'whisk')}, {each}; blank: none"


def _field(cells: Sequence[MapCell], top: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mean errors (a, b), NaN where nothing was measured, and the cells' edges."""
    steepest = max(_STEEPEST_DEG, *(cell.beta_deg for cell in cells))
    beta = np.arange(-0.5 * _BETA_DEG, steepest + 1.5 * _BETA_DEG, _BETA_DEG)
    alpha = np.arange(0.0, top + _ALPHA_DEG, _ALPHA_DEG)
    field = np.full((len(alpha) - 1, len(beta) - 1), np.nan)
    for cell in cells:
        row = np.searchsorted(alpha, cell.alpha_deg)
        column = np.searchsorted(beta, cell.beta_deg)
        field[row, column] = cell.error_percent
    return field, beta, alpha


def _write_errors(axes: "Axes", cells: Sequence[MapCell], most: float) -> None:
    """Write each cell's mean error into it, light on the dark ends of the scale."""
    for cell in cells:
        text = f"{cell.error_percent:+.1f}".replace("-", "−").replace("−0.0", "0.0")
        axes.text(
            cell.beta_deg + 0.5 * _BETA_DEG,
            cell.alpha_deg + 0.5 * _ALPHA_DEG,
            text,
            ha="center",
            va="center",
            fontsize=6 if len(text) < 5 else 5,
            color="white" if abs(cell.error_percent) > 0.6 * most else "black",
        )
