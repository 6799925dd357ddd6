"""summary.txt: the verdict first, then what it rests on. Also shown in the terminal."""

from collections.abc import Iterable, Sequence

from bench.base.atomic import write_whole
from bench.friction.curved import curved_lines
from bench.friction.soft import soft_lines
from bench.friction.tables import alpha_lines
from bench.report.against_theta import AtTheta, theta_lines
from bench.report.evaluation import Evaluation
from bench.report.summary.doubts import light_lines, taken_as_exact, whisk_doubts
from bench.report.summary.errors import contact_lines, error_lines
from bench.report.summary.gauges import gauge_lines
from bench.report.summary.shared import shared_doubts, shared_lines
from bench.report.summary.truth import beam_lines, budget_lines, clock_lines, truth_lines
from bench.report.summary.verdict import gauges_of_all, run_lines, verdict
from bench.trials.compare import judge

DONE, DOUBTFUL = 0, 1
_TABLES = (
    *("whisks", "estimates", "budget", "beam", "friction", "phases", "surfaces", "explained", "error_map"),
    *("against_theta", "compliance", "curvature"),
)


def write_summary(
    evaluation: Evaluation, scores: Sequence[str], figures: Sequence[str], by_theta: Sequence[AtTheta] = ()
) -> int:
    """Write and print the summary. Returns 0, or 1 where something is doubtful.

    scores: lines on a synthetic session's truth; figures: names of the pictures; by_theta: errors against θ.
    """
    doubtful = [*evaluation.doubts, *shared_doubts(evaluation.results), *whisk_doubts(evaluation.results)]
    text = "\n".join(_lines(evaluation, doubtful, scores, figures, by_theta)).rstrip()
    write_whole(evaluation.out / "summary.txt", text + "\n")
    print(text)
    return DOUBTFUL if doubtful else DONE


def _lines(
    evaluation: Evaluation,
    doubtful: Sequence[str],
    scores: Sequence[str],
    figures: Sequence[str],
    by_theta: Sequence[AtTheta],
) -> list[str]:
    results, settings, judged = evaluation.results, evaluation.settings, judge(evaluation.results)
    errors = f"Error of d_x at θ = {settings.theta_deg:g}°, estimate less truth, in % of the truth (± one sigma)"
    truth = [*truth_lines(results), *budget_lines(results), *shared_lines(results), *beam_lines(results)]
    return [
        *verdict(evaluation.session, results, judged, settings, len(doubtful)),
        *gauges_of_all(evaluation.gauges),
        "",
        *_titled("Truth, from the pictures (± one sigma)", truth),
        *_titled("Clocks", clock_lines(results)),
        *_titled(errors, [*error_lines(judged), *contact_lines(results)]),
        *_titled("Error and sigma against θ (against_theta.csv)", theta_lines(by_theta, settings.theta_deg)),
        *_titled("Friction angle α (± one sigma)", [*alpha_lines(evaluation.friction), *run_lines(judged, settings)]),
        *_titled("The object", [*soft_lines(evaluation.soft), *curved_lines(evaluation.shapes)]),
        *_titled("Gauges, N·mm/V (± 95 %)", gauge_lines(evaluation.gauges)),
        *_titled("Cameras", evaluation.camera_notes),
        *_titled("Light from one side", light_lines(results)),
        *_titled("Doubtful", doubtful),
        *_titled("Score against the truth files of this synthetic session (no result knows them)", scores),
        *_titled("Taken as exact, for no sigma was given", taken_as_exact(evaluation.session)),
        *_titled("Files", _files(figures)),
    ]


def _titled(title: str, lines: Iterable[str]) -> list[str]:
    lines = list(lines)
    return [title, *(f"  {line}" for line in lines), ""] if lines else []


def _files(figures: Sequence[str]) -> list[str]:
    single = [name for name in figures if "/" not in name]
    folders = sorted({name.split("/")[0] for name in figures if "/" in name})
    tables = [f"{name}.csv" for name in _TABLES]
    return [", ".join([*tables, "track/", *single, *(f"{folder}/" for folder in folders)])]
