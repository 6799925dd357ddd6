"""methods.md and results.bib: what a paper's methods section takes as it is, every number from this run."""

from collections.abc import Iterator, Sequence

import numpy as np

from bench.analyses.friction_tables import SurfaceFriction
from bench.records.trial_result import TrialResult
from bench.report.estimator_accuracy import Accuracy, accuracies, truth_uncertainty
from bench.report.page.words import MISSING, number, with_sigma
from bench.report.run_facts import RunRecord

_PAPER = """@article{solomon2008artificial,
  author  = {Solomon, Joseph H. and Hartmann, Mitra J. Z.},
  title   = {Artificial whiskers suitable for array implementation: accounting for lateral slip and surface friction},
  journal = {IEEE Transactions on Robotics},
  volume  = {24},
  number  = {5},
  pages   = {1157--1167},
  year    = {2008},
  doi     = {10.1109/TRO.2008.2002562}
}
"""


def bibliography(record: RunRecord) -> str:
    """BibTeX of the program and of the paper whose method it measures."""
    version = record.versions.get("whisker-bench", "unknown")
    program = (
        "@software{whiskerbench,\n"
        "  author  = {{whisker-bench contributors}},\n"
        "  title   = {whisker-bench: a ground-truth bench for robotic whiskers},\n"
        f"  version = {{{version}}}\n}}\n"
    )
    return f"{program}\n{_PAPER}"


def methods(
    record: RunRecord, results: Sequence[TrialResult], friction: Sequence[SurfaceFriction]
) -> str:
    """Two paragraphs and two tables, Markdown."""
    accuracy_of_all = accuracies(results)
    return "\n".join(
        [
            f"# Methods: {_plain(record.session)}",
            "",
            " ".join(_truth(record, results)),
            "",
            " ".join(_estimates(record, results, accuracy_of_all)),
            "",
            *_accuracy_table(accuracy_of_all),
            *_friction_table(friction),
            "References: results.bib (solomon2008artificial, whiskerbench).",
            "",
        ]
    )


def _truth(record: RunRecord, results: Sequence[TrialResult]) -> Iterator[str]:
    whisker, sure = record.whisker, truth_uncertainty(results)
    made = {"cylinder": "cylindrical", "cone": "conical", "tapered": "tapered"}[whisker.shape]
    yield (
        f"A {made} whisker of {whisker.diameter_mm:g} mm base diameter and {whisker.length_mm:g} mm length "
        f"(C = 3EI = {whisker.C_Nmm2:.0f} N·mm²) was pushed against a bar in {sure.measured} measured whisks of "
        f"{len({r.trial.name for r in results if r.trial.purpose == 'measure'})} trials."
    )
    if not record.cameras:
        yield "No pictures were recorded, so that no truth stands beside the estimates."
        return
    rms = ", ".join(f"{c.name} {c.rms_px:.3f} px" for c in record.cameras)
    sizes = sorted({f"{c.size_px[0]} × {c.size_px[1]} px" for c in record.cameras})
    yield (
        f"{len(record.cameras)} calibrated cameras ({', '.join(sizes)}; RMS reprojection error: {rms}) saw wire and "
        "bar; their centrelines were fitted together over all frames and cameras, and gave first touch, contact, slope "
        "of the bar and slip without any use of the gauges."
    )
    yield (
        f"The true radial distance d_x is known for {sure.known} of {sure.measured} whisks, with a median standard "
        f"uncertainty of {number(sure.d_x_mm, 4)} mm (touch {number(sure.touch_deg, 4)}°, slope "
        f"{number(sure.beta_deg, 3)}°, slip {number(sure.slip_mm, 4)} mm)."
    )


def _estimates(
    record: RunRecord, results: Sequence[TrialResult], accuracy_of_all: Sequence[Accuracy]
) -> Iterator[str]:
    settings = record.settings
    yield (
        f"Estimates were taken at a pushing angle of {settings.theta_deg:g}° from the moments at the whisker's base "
        "and the touch angle that these show; equation (10) of Solomon and Hartmann (2008) assumed a friction angle "
        f"of {settings.alpha_est_deg:g}°."
    )
    gauges = record.lines("gauges")
    if gauges:
        yield f"Gauge coefficients are from {gauges[0].split(';')[0].removeprefix('from ')}."
    for s in accuracy_of_all:
        if s.judged:
            held = (
                f"; {s.intervals_holding} of {s.intervals} of its 95 % intervals hold the truth"
                if s.intervals
                else ""
            )
            yield (
                f"{s.label}: error of d_x {number(s.bias_percent, 2)} % in the mean and "
                f"{number(s.rms_percent, 2)} % RMS over {len(s.judged)} whisks{held}."
            )
    versions = ", ".join(f"{name} {version}" for name, version in record.versions.items())
    yield f"Computed with {versions}."


def _accuracy_table(accuracy_of_all: Sequence[Accuracy]) -> Iterator[str]:
    if not accuracy_of_all:
        return
    yield "| estimator | whisks | mean error / % | RMS error / % | largest / % | 95 % intervals that hold |"
    yield "|---|---|---|---|---|---|"
    for s in accuracy_of_all:
        numbers = (number(v, 2) for v in (s.bias_percent, s.rms_percent, s.worst_percent))
        held = f"{s.intervals_holding} of {s.intervals}" if s.intervals else MISSING
        yield f"| {_plain(s.label)} | {len(s.judged)} of {s.with_truth} | {' | '.join(numbers)} | {held} |"
    yield ""


def _friction_table(friction: Sequence[SurfaceFriction]) -> Iterator[str]:
    if not friction:
        return
    yield "| surface and speed | whisks | α seen / ° | α felt / ° | α of Fig. 8 / ° |"
    yield "|---|---|---|---|---|"
    for of in friction:
        angles = (
            with_sigma(*np.degrees(of.alpha(name)).tolist())
            for name in ("seen", "felt", "least_squares")
        )
        yield f"| {_plain(of.surface.title)} | {len(of.surface.felt)} | {' | '.join(angles)} |"
    yield ""


def _plain(text: str) -> str:
    """A name that cannot break a table or a line of Markdown, nor bring HTML into it."""
    kept = "".join(" " if not c.isprintable() else c for c in text)
    return kept.replace("&", "&amp;").replace("<", "&lt;").replace("|", "\\|")
