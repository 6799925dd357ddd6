"""summary.txt: the verdict first, then what it rests on. The verdict and what is doubtful are shown in the terminal."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bench.analyses.against_theta import AtTheta, theta_lines
from bench.analyses.curved import curved_lines
from bench.analyses.friction_tables import alpha_lines
from bench.analyses.gave import gave_lines
from bench.analyses.ledger import Entry, ledger_lines
from bench.analyses.soft import soft_lines
from bench.analyses.table_i_sensors import SensorWorth, sensor_lines
from bench.analyses.tilted import tilted_lines
from bench.report.evaluation import Evaluation
from bench.report.run_facts import Section
from bench.report.run_tables import RUN_TABLES
from bench.report.summary.error_lines import contact_lines, error_lines
from bench.report.summary.gauge_lines import gauge_lines
from bench.report.summary.shared import shared_doubts, shared_lines
from bench.report.summary.truth import beam_lines, budget_lines, clock_lines, truth_lines
from bench.report.summary.verdict import (
    gauge_source_lines,
    known_friction_lines,
    preset_lines,
    verdict,
)
from bench.report.summary.warning_lines import (
    frame_lines,
    light_lines,
    taken_as_exact,
    whisk_doubts,
)
from bench.trials.estimate_errors import Judged, judge

DOUBTFUL = "Doubtful"
_MOST_ON_SCREEN = 20  # lines: a screen


@dataclass(frozen=True)
class Summary:
    """The verdict, what is doubtful, and titled sections, of which "Doubtful" is one."""

    verdict: tuple[str, ...]
    doubtful: tuple[str, ...]
    sections: tuple[Section, ...]

    @property
    def text(self) -> str:
        """As summary.txt has it."""
        return "\n".join([*self.verdict, "", *section_lines(self.sections)]).rstrip() + "\n"

    def on_screen(self, out: Path) -> str:
        """What is seen at a glance: the verdict, what is doubtful, and where the rest is."""
        shown = self.doubtful[:_MOST_ON_SCREEN]
        more = len(self.doubtful) - len(shown)
        doubtful = [
            _titled(DOUBTFUL, [*shown, *([f"and {more} more, in summary.txt"] if more else [])])
        ]
        rest = f"All of it: {out / 'report.html'}, {out / 'summary.txt'}"
        return "\n".join([*self.verdict, "", *(section_lines(doubtful) if shown else ()), rest])


def section_lines(sections: Iterable[Section]) -> Iterator[str]:
    """Titles with their lines below them, and an empty line after each."""
    return (line for s in sections for line in (s.title, *(f"  {line}" for line in s.lines), ""))


def summary_of(
    evaluation: Evaluation,
    scores: Sequence[str],
    figures: Sequence[str],
    by_theta: Sequence[AtTheta] = (),
    needed: Sequence[Entry] = (),
    sensors: Sequence[SensorWorth] = (),
    moving: Sequence[str] = (),
    both_ways: Sequence[str] = (),
    one_camera: Sequence[str] = (),
) -> Summary:
    """The summary of a run. scores: lines on a synthetic session's truth; figures: names of the pictures; by_theta:
    errors against θ; needed: which refinements are; sensors: what each is worth, where a load cell was recorded;
    moving, both_ways, one_camera: lines on objects that moved, on ways back, and on shapes seen by one camera."""
    doubtful = [
        *evaluation.doubts,
        *shared_doubts(evaluation.results),
        *whisk_doubts(evaluation.results),
    ]
    judged = judge(evaluation.results)
    name, pictures = (
        evaluation.session.name,
        any(trial.camera_sources for trial in evaluation.session.trials),
    )
    said = verdict(name, pictures, evaluation.results, evaluation.settings, len(doubtful))
    said = (
        *said,
        *gauge_source_lines(evaluation.gauges),
        *preset_lines(evaluation.results, evaluation.settings),
    )
    others = moving, both_ways, one_camera
    sections = _sections(
        evaluation, judged, doubtful, scores, figures, by_theta, needed, sensors, *others
    )
    return Summary(said, tuple(doubtful), tuple(section for section in sections if section.lines))


def _sections(
    evaluation: Evaluation,
    judged: Sequence[Judged],
    doubtful: Sequence[str],
    scores: Sequence[str],
    figures: Sequence[str],
    by_theta: Sequence[AtTheta],
    needed: Sequence[Entry],
    sensors: Sequence[SensorWorth],
    moving: Sequence[str],
    both_ways: Sequence[str],
    one_camera: Sequence[str],
) -> Iterator[Section]:
    results, settings = evaluation.results, evaluation.settings
    errors = f"Error of d_x at θ = {settings.theta_deg:g}°, estimate less truth, in % of the truth (± one sigma)"
    truth = [
        *truth_lines(results),
        *budget_lines(results),
        *shared_lines(results),
        *beam_lines(results),
    ]
    yield _titled("Truth, from the pictures (± one sigma)", truth)
    yield _titled("Clocks", clock_lines(results))
    yield _titled(errors, [*error_lines(judged), *contact_lines(results)])
    yield _titled("Sensors of Table I: error of d_x, RMS (sensors.csv)", sensor_lines(sensors))
    yield _titled("Ways back (both_ways.csv)", both_ways)
    yield _titled(
        "By one camera's pictures of its own trial, no gauge (one_camera.csv)", one_camera
    )
    yield _titled("Objects that moved (moving.csv)", moving)
    yield _titled(
        "Error and sigma against θ (against_theta.csv)", theta_lines(by_theta, settings.theta_deg)
    )
    friction = [
        *alpha_lines(evaluation.friction),
        *known_friction_lines(results, settings),
        *tilted_lines(evaluation.tilted),
    ]
    yield _titled("Friction angle α (± one sigma)", friction)
    soft = [*soft_lines(evaluation.soft), *gave_lines(results)]
    yield _titled("The object", [*soft, *curved_lines(evaluation.shapes)])
    yield _titled("Gauges, N·mm/V (± 95 %)", gauge_lines(evaluation.gauges))
    yield _titled(
        "Only what the scene requires: the effect of leaving it out (ledger.csv)",
        ledger_lines(needed),
    )
    yield _titled("Cameras", evaluation.calibration.notes)
    yield _titled("Light from one side", light_lines(results))
    yield _titled("Frames", frame_lines(results))
    yield _titled(DOUBTFUL, doubtful)
    yield _titled(
        "Score against the truth files of this synthetic session (no result knows them)", scores
    )
    yield _titled("Taken as exact, for no sigma was given", taken_as_exact(evaluation.session))
    yield _titled("Files", _files(figures))


def _titled(title: str, lines: Iterable[str]) -> Section:
    return Section(title, tuple(lines))


def _files(figures: Sequence[str]) -> list[str]:
    single = [name for name in figures if "/" not in name]
    folders = sorted({name.split("/")[0] for name in figures if "/" in name})
    tables = [table.file for table in RUN_TABLES.values()]
    return [
        ", ".join(
            ["report.html", *tables, "track/", *single, *(f"{folder}/" for folder in folders)]
        )
    ]
