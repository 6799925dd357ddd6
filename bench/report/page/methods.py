"""methods.md and results.bib: what a paper's methods section takes as it is, every number from this run."""

from collections.abc import Iterator, Sequence

from bench.analyses.analysis import EvaluatedRun
from bench.analyses.estimator_accuracy import Accuracy, TruthUncertainty
from bench.analyses.friction_tables import SurfaceFriction
from bench.report.page.words import MISSING, number, value_text
from bench.report.run_facts import CameraFacts, RunRecord

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
    """Return BibTeX of the program and of the paper whose method it measures."""
    version = record.versions.get("whisker-bench", "unknown")
    program = (
        "@software{whiskerbench,\n"
        "  author  = {{whisker-bench contributors}},\n"
        "  title   = {whisker-bench: a ground-truth bench for robotic whiskers},\n"
        f"  version = {{{version}}}\n}}\n"
    )
    return f"{program}\n{_PAPER}"


def methods(record: RunRecord, run: EvaluatedRun) -> str:
    """Return two paragraphs and two tables, as Markdown."""
    accuracy_of_all = run.accuracy.estimators
    lines = [
        f"# Methods: {_escaped(record.session)}",
        "",
        " ".join(_truth(record, run)),
        "",
        " ".join(_estimates(record, accuracy_of_all)),
        "",
        *_accuracy_table(accuracy_of_all),
        *_friction_table(run.friction),
        "References: results.bib (solomon2008artificial, whiskerbench).",
        "",
    ]
    return "\n".join(lines)


def _truth(record: RunRecord, run: EvaluatedRun) -> Iterator[str]:
    """Yield the sentences on the whisker, the cameras, and how well the truth is known."""
    truth = run.accuracy.truth
    slope = f"slope {number(truth.beta_deg, 3)}°"
    yield _sentence_on_whisker(record, run)
    if run.is_by_stage:
        yield _sentence_on_distance(truth, " by a stage", slope)
    elif record.cameras:
        yield _sentence_on_cameras(record.cameras)
        touch = f"touch {number(truth.touch_deg, 4)}°"
        slip = f"slip {number(truth.slip_mm, 4)} mm"
        yield _sentence_on_distance(truth, "", f"{touch}, {slope}, {slip}")
    else:
        yield "No pictures were recorded, so that no truth stands beside the estimates."


def _sentence_on_distance(truth: TruthUncertainty, source: str, others: str) -> str:
    """Return the sentence on how well the distance is known. others: sigmas of other quantities."""
    return (
        f"The true radial distance d_x is known{source} for {truth.known} of {truth.measured} whisks, with a median "
        f"standard uncertainty of {number(truth.d_x_mm, 4)} mm, of which {number(truth.d_x_own_mm, 4)} mm are each "
        f"whisk's own and {number(truth.d_x_shared_mm, 4)} mm are common to all ({others})."
    )


def _sentence_on_whisker(record: RunRecord, run: EvaluatedRun) -> str:
    """Return the sentence on the whisker and how often it was pushed."""
    whisker = record.whisker
    form = {"cylinder": "cylindrical", "cone": "conical", "tapered": "tapered"}[whisker.shape]
    trials = {result.trial.name for result in run.results if result.trial.purpose == "measure"}
    return (
        f"A {form} whisker of {whisker.diameter_mm:g} mm base diameter and {whisker.length_mm:g} mm length "
        f"(C = 3EI = {whisker.C_Nmm2:.0f} N·mm²) was pushed against a bar in {run.accuracy.truth.measured} measured "
        f"whisks of {len(trials)} trials."
    )


def _sentence_on_cameras(cameras: Sequence[CameraFacts]) -> str:
    """Return the sentence on the cameras, their pictures' sizes, and what was fitted to these."""
    rms = ", ".join(f"{camera.name} {camera.rms_px:.3f} px" for camera in cameras)
    sizes = {f"{camera.size_px[0]} × {camera.size_px[1]} px" for camera in cameras}
    return (
        f"{len(cameras)} calibrated cameras ({', '.join(sorted(sizes))}; RMS reprojection error: {rms}) saw "
        "wire and bar; their centrelines were fitted together over all frames and cameras, and gave first touch, "
        "contact, slope of the bar and slip without any use of the gauges."
    )


def _estimates(record: RunRecord, accuracy_of_all: Sequence[Accuracy]) -> Iterator[str]:
    """Yield the sentences on how distances were estimated, and on each estimator's error."""
    settings = record.settings
    yield (
        f"Estimates were taken at a pushing angle of {settings.theta_deg:g}° from the moments at the whisker's base "
        "and the touch angle that these show; equation (10) of Solomon and Hartmann (2008) assumed a friction angle "
        f"of {settings.alpha_est_deg:g}°."
    )
    if record.gauges is not None:
        yield f"Gauge coefficients are from {record.gauges.source}."
    for accuracy in accuracy_of_all:
        if not accuracy.judged:
            continue
        held = ""
        if accuracy.intervals:
            held = f"; {_intervals(accuracy)} of its 95 % intervals hold the truth"
        yield (
            f"{accuracy.label}: error of d_x {number(accuracy.bias_percent)} % in the mean and "
            f"{number(accuracy.rms_percent)} % RMS over {len(accuracy.judged)} whisks{held}."
        )
    versions = ", ".join(f"{name} {version}" for name, version in record.versions.items())
    yield f"Computed with {versions}."


def _intervals(accuracy: Accuracy) -> str:
    """Return how many of an estimator's 95 % intervals hold the truth."""
    if not accuracy.intervals:
        return MISSING
    return f"{accuracy.intervals_holding} of {accuracy.intervals}"


def _accuracy_table(accuracy_of_all: Sequence[Accuracy]) -> Iterator[str]:
    """Yield the table of estimators, line by line."""
    if not accuracy_of_all:
        return
    yield "| estimator | whisks | mean error / % | RMS error / % | largest / % | 95 % intervals that hold |"
    yield "|---|---|---|---|---|---|"
    for accuracy in accuracy_of_all:
        cells = (
            _escaped(accuracy.label),
            f"{len(accuracy.judged)} of {accuracy.with_truth}",
            number(accuracy.bias_percent),
            number(accuracy.rms_percent),
            number(accuracy.worst_percent),
            _intervals(accuracy),
        )
        yield f"| {' | '.join(cells)} |"
    yield ""


def _friction_table(friction: Sequence[SurfaceFriction]) -> Iterator[str]:
    """Yield the table of friction angles, line by line."""
    if not friction:
        return
    yield "| surface and speed | whisks | α seen / ° | α felt / ° | α of Fig. 8 / ° |"
    yield "|---|---|---|---|---|"
    for of_surface in friction:
        cells = [_escaped(of_surface.surface.title), str(len(of_surface.surface.felt))]
        for way in ("seen", "felt", "least_squares"):
            cells.append(value_text(of_surface.alpha(way).in_degrees()))
        yield f"| {' | '.join(cells)} |"
    yield ""


def _escaped(text: str) -> str:
    """Return a name that cannot break a table or a line of Markdown, nor bring HTML into it."""
    kept = "".join(" " if not c.isprintable() else c for c in text)
    return kept.replace("&", "&amp;").replace("<", "&lt;").replace("|", "\\|")
