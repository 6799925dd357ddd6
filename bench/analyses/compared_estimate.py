"""An estimate beside the truth of its whisk."""

from dataclasses import dataclass
from math import degrees

from bench.analyses.cells import as_cell, value_cells
from bench.records.trial_result import EstimateRow
from vision import Value


@dataclass(frozen=True, eq=False)
class ComparedEstimate:
    """An estimate, with a status alone where there is none, and the true distance."""

    estimate: EstimateRow
    d_x_mm: Value

    @property
    def error_mm(self) -> float:
        """Return estimate less truth."""
        return self.estimate.error_mm(self.d_x_mm).value

    @property
    def error_percent(self) -> float:
        """Return estimate less truth, percent of the truth."""
        return self.estimate.error_percent(self.d_x_mm).value

    @property
    def inside(self) -> bool | None:
        """Return whether the 95 % interval holds the truth; None where either is not known."""
        return self.estimate.holds(self.d_x_mm.value)

    @property
    def cells(self) -> dict:
        """Return the cells of estimate, truth and difference; a table takes those that it has columns for."""
        estimate = self.estimate
        return {
            "estimator": estimate.estimator,
            "alpha_est_deg": degrees(estimate.alpha_est_rad),
            "beta_est_deg": degrees(estimate.beta_est_rad),
            **value_cells("d_x_est_mm", estimate.d_x_est_mm),
            "d_x_est_low_mm": estimate.d_x_est_low_mm,
            "d_x_est_high_mm": estimate.d_x_est_high_mm,
            **value_cells("d_x_mm", self.d_x_mm),
            "error_mm": self.error_mm,
            "error_percent": self.error_percent,
            "inside": as_cell(self.inside),
        }
