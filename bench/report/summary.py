"""summary.txt: the verdict first, then what it rests on. Also shown in the terminal."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from bench.base.atomic import write_whole
from bench.base.drawing import label_of
from bench.base.results import number
from bench.base.settings import Settings
from bench.friction.runs import FITTED, RUNS, SEEN
from bench.friction.tables import SurfaceFriction, alpha_lines
from bench.gauges.felt import GAUGE_DELAY_S, lateness
from bench.gauges.matrix import GaugeMatrix, Gauges
from bench.report.assembly import beam_rows, budget_rows
from bench.session.session import Session
from bench.trials.compare import Judged, judge, whisks
from bench.trials.seen import NO_PICTURES
from bench.trials.unit import OWN_GAUGES
from vision.fit.uncertainty import CAUSES

DONE, DOUBTFUL = 0, 1
_SILENT = ("", NO_PICTURES, OWN_GAUGES)
# (10) run again repeats what it said first; what the others miss is the result, no fault of the run.
_UNTOLD = ("no_slip", "frictionless", *RUNS)
_U95 = 1.96
_LEAST_TOLD_PERCENT = 0.5


def write_summary(
    session: Session,
    out: Path,
    results: Sequence[dict],
    gauges: Gauges | None,
    doubts: Sequence[str],
    cameras: Sequence[str],
    settings: Settings,
    scores: Sequence[str],
    figures: Sequence[str],
    friction: Sequence[SurfaceFriction],
) -> int:
    """Write and print the summary. Returns 0, or 1 where something is doubtful."""
    judged = judge(results)
    doubtful = [*doubts, *_whisk_doubts(results)]
    text = "\n".join(
        [
            *_verdict(session, results, judged, settings, doubtful),
            "",
            *_titled(
                "Truth, from the pictures (± one sigma)",
                [*_truth_lines(results), *_budget_lines(results), *_beam_lines(results)],
            ),
            *_titled("Clocks", _clock_lines(results)),
            *_titled(
                f"Error of d_x at θ = {settings.theta_deg:g}°, estimate less truth, in % of the truth (± one sigma)",
                _error_lines(judged),
            ),
            *_titled("Friction angle α (± one sigma)", [*alpha_lines(friction), *_run_lines(judged, settings)]),
            *_titled("Gauges, N·mm/V (± 95 %)", _gauge_lines(gauges)),
            *_titled("Cameras", cameras),
            *_titled("Light from one side", _light_lines(results)),
            *_titled("Doubtful", doubtful),
            *_titled("Score against the truth files of this synthetic session (no result knows them)", scores),
            *_titled("Taken as exact, for no sigma was given", _exact(session)),
            *_titled("Files", _files(figures)),
        ]
    )
    write_whole(out / "summary.txt", text.rstrip() + "\n")
    print(text.rstrip())
    return DOUBTFUL if doubtful else DONE


def _titled(title: str, lines: Iterable[str]) -> list[str]:
    lines = list(lines)
    return [title, *(f"  {line}" for line in lines), ""] if lines else []


def _verdict(session: Session, results, judged: Sequence[Judged], settings: Settings, doubtful) -> Iterator[str]:
    measured = _measured(judged)
    seen = [s for result, s, _ in whisks(results) if result["trial"]["purpose"] == "measure"]
    known = sum(s.get("d_x_mm") is not None for s in seen)
    asked = [j for j in judged if j.purpose == "measure" and not j.one_factor and np.isfinite(j.d_x_mm)]
    for name in dict.fromkeys(j.estimator for j in asked if j.estimator not in RUNS):
        mine = [j for j in measured if j.estimator == name]
        told = _told([j for j in asked if j.estimator == name])
        yield (_verdict_on(name, mine, settings) if mine else f"{label_of(name)} gave no distance.") + told
    if not measured:
        yield "No verdict on the estimators: no whisk has both a truth and an estimate."
    pictures = any(trial.camera_sources for trial in session.trials)
    yield (
        f"{session.name}: truth for {known} of {len(seen)} measured whisks"
        if pictures
        else f"{session.name}: no pictures, so no truth; {len(seen)} measured whisks felt"
    ) + (f"; {len(doubtful)} doubtful, see below." if doubtful else "; nothing doubtful.")


def _told(asked: Sequence[Judged]) -> str:
    """How many of an estimator's answers are none, and how many more come with a status."""
    none = [j for j in asked if not np.isfinite(j.error_percent)]
    doubted = [j for j in asked if j.status and np.isfinite(j.error_percent)]
    parts = [f"{len(none)} of {len(asked)} without a distance ({none[0].status})"] if none else []
    parts += [f"{len(doubted)} with a status ({doubted[0].status})"] if doubted else []
    return f" {'; '.join(parts)}.".replace(" (95 %)", "") if parts else ""


def _measured(judged: Sequence[Judged]) -> list[Judged]:
    return [j for j in judged if j.purpose == "measure" and not j.one_factor and np.isfinite(j.error_percent)]


def _run_lines(judged: Sequence[Judged], settings: Settings) -> Iterator[str]:
    """(10) once more with what is known of the friction, where that is anything."""
    for name, what in ((FITTED, "to the other whisks of the surface"), (SEEN, "which no robot has; what is left then")):
        mine = [j for j in _measured(judged) if j.estimator == name]
        if mine:
            yield _verdict_on(name, mine, settings).replace(label_of(name), f"{label_of(name)} ({what}),", 1)


def _verdict_on(name: str, judged: Sequence[Judged], settings: Settings) -> str:
    errors = np.array([j.error_percent for j in judged])
    worst = judged[int(np.argmax(np.abs(errors)))]
    assumed = f", α_est = {settings.alpha_est_deg:g}°," if name == "with_friction" else ""
    spread = f"{errors.min():+.1f} to {errors.max():+.1f} %" if len(errors) > 1 else f"{errors[0]:+.1f} %"
    return (
        f"{label_of(name)}{assumed} is wrong by {spread} of d_x over {len(errors)} whisks, "
        f"most at β = {worst.beta_deg:.1f}° ({worst.trial})."
    )


def _truth_lines(results) -> Iterator[str]:
    rows = [(r, s, f) for r, s, f in whisks(results) if s.get("d_x_mm") is not None]
    if rows:
        yield (
            f"{'trial':<18}{'whisk':>5}  {'β seen':>16}  {'d_x':>17}  {'slip at θ':>17}  {'touch seen':>17}  "
            f"{'felt − seen':>17}"
        )
    for result, s, felt in rows:
        at = s["at"]
        late, late_sigma = np.degrees(lateness(s, felt))
        yield (
            f"{result['trial']['name']:<18}{s['whisk']:>5}  {_pm(s, 'beta', 2, degrees=True):>15}°  "
            f"{_pm(s, 'd_x', 3):>14} mm  {_pm(at, 'slip', 3):>14} mm  {_pm(s, 'touch', 3, degrees=True):>16}°  "
            f"{f'{late:+.3f} ± {late_sigma:.3f}':>16}°"
        )


def _clock_lines(results) -> Iterator[str]:
    """What ties the frames to the signals, a line for each way, and what the felt touch is late by."""
    clocks = [result["seen"]["clock"] for result in results if result["seen"].get("clock")]
    ways = Counter((clock["source"], clock["sigma_s"], clock["recorded"]) for clock in clocks)
    for (source, sigma_s, recorded), number_of in ways.items():
        count = f"{number_of} of {len(clocks)} trials"
        known = f"taken as known to {1e3 * sigma_s:.3g} ms, which is in the sigma of touch seen"
        if recorded:
            yield f"frame times as recorded ({source}), {count}; their clock is " + (
                known if sigma_s else "taken as that of the signals"
            )
        else:
            yield (
                f"frame times by {source}, {count}: no recorded edge ties them to the signals, and forward "
                f"strokes do not tell the clock from the encoder's zero; {known}"
            )
    if ways:
        yield (
            f"felt − seen: its sigma holds {1e3 * GAUGE_DELAY_S:.2f} ms of delay by a gauges' filter of 800 Hz, fourth "
            "order (the session does not name its own)"
        )


def _budget_lines(results) -> Iterator[str]:
    """Where the variance of d_x comes from, in the mean over the whisks."""
    rows = list(budget_rows(results))
    if rows:
        table = np.array([[row[f"{cause}_percent"] for cause in CAUSES] for row in rows])
        shares = dict(zip(CAUSES, np.nan_to_num(table).mean(axis=0)))
        largest = sorted(shares.items(), key=lambda item: -item[1])
        parts = (f"{cause} {share:.0f} %" for cause, share in largest if share >= _LEAST_TOLD_PERCENT)
        yield f"variance of d_x by cause, mean over the whisks: {', '.join(parts)} (docs/truth.md, budget.csv)"
        if np.isnan(table).any():
            yield "  cameras.npz does not tell the rig board's part from the lenses': `cameras` is both"


def _beam_lines(results) -> Iterator[str]:
    """How far the truth would move if the wire's curve were a spline: the largest of each quantity."""
    rows = list(beam_rows(results))
    parts = []
    for name, unit in (("d_x", "mm"), ("touch", "deg"), ("slip", "mm")) if rows else ():
        moved = [(row[f"{name}_spline_{unit}"] - row[f"{name}_beam_{unit}"]) for row in rows]
        k = int(np.argmax(np.abs(moved)))
        sigma = rows[k][f"{name}_difference_sigma_{unit}"]
        parts.append(f"{name} {moved[k]:+.4f} ± {sigma:.4f} {unit} ({rows[k]['trial']})")
    if parts:
        yield f"by a spline instead of a beam with a point load, at most: {', '.join(parts)} (beam.csv)"


def _pm(source: dict, name: str, digits: int, *, degrees: bool = False) -> str:
    unit, turn = ("rad", np.degrees) if degrees else ("mm", float)
    value, sigma = number(source.get(f"{name}_{unit}")), number(source.get(f"{name}_sigma_{unit}"))
    return f"{turn(value):.{digits}f} ± {turn(sigma):.{digits}f}" if np.isfinite(value) else "-"


def _error_lines(judged: Sequence[Judged]) -> Iterator[str]:
    judged = [j for j in judged if np.isfinite(j.error_percent)]
    if not judged:
        return
    columns = list(dict.fromkeys((j.estimator, j.one_factor) for j in sorted(judged, key=lambda j: j.one_factor)))
    columns = [c for c in columns if not c[1] or c[0] == "with_friction"]
    names = [label_of(name) + (", one factor" if one else "") for name, one in columns]
    widths = [max(17, len(name)) for name in names]
    yield f"{'trial':<18}{'whisk':>5}  {'β':>6}   " + "  ".join(f"{n:>{width}}" for n, width in zip(names, widths))
    for key in dict.fromkeys((j.trial, j.whisk) for j in judged):
        mine = {(j.estimator, j.one_factor): j for j in judged if (j.trial, j.whisk) == key}
        cells = [f"{_error(mine.get(c)):>{width}}" for c, width in zip(columns, widths)]
        yield f"{key[0]:<18}{key[1]:>5}  {next(iter(mine.values())).beta_deg:>5.1f}°   " + "  ".join(cells)


def _error(j: Judged | None) -> str:
    return "-" if j is None else f"{j.error_percent:+.2f} ± {j.error_sigma_percent:.2f}"


def _gauge_lines(gauges: Gauges | None) -> Iterator[str]:
    if gauges is None:
        return
    yield f"from {gauges.source}; [m_y, m_z] = matrix · [y, z] above each free stroke"
    yield from _matrix_lines("", gauges.all)
    yield from _matrix_lines("the paper's way, one factor a channel, no cross-talk", gauges.one_factor)
    yield from _matrix_lines("four coefficients at one angle, (2)", gauges.at_angle)
    missing = [name for name, matrix in gauges.without.items() if matrix is None]
    if missing:
        yield f"not known without one of these trials, so they are not judged: {', '.join(missing)}"
    yield from gauges.notes


def _matrix_lines(title: str, gauges: GaugeMatrix | None) -> Iterator[str]:
    if gauges is None:
        return
    if title:
        yield f"{title}:"
    for row, sigmas in zip(gauges.matrix, gauges.sigma):
        cells = [f"{value:9.4f}" + (f" ± {_U95 * sigma:.4f}" if sigma > 0 else "") for value, sigma in zip(row, sigmas)]
        yield "  " + "   ".join(cells)


def _whisk_doubts(results) -> Iterator[str]:
    """A line for each whisk that something is doubtful of. A gauge trial that cannot be judged is as it should be."""
    for result, seen, felt in whisks(results):
        name = f"{result['trial']['name']}, whisk {seen['whisk']}"
        parts = [part for part in dict.fromkeys((seen["status"], felt["status"])) if part not in _SILENT]
        if parts:
            yield f"{name}: {'; '.join(parts)}"
        if felt.get("saturated"):
            yield f"{name}: {felt['saturated']} saturated samples left out"
        for answer in felt["estimates"]:
            if answer["status"] and answer["estimator"] not in _UNTOLD:
                yield f"{name}, {answer['estimator']}: {answer['status']}"


def _light_lines(results: Sequence[dict]) -> Iterator[str]:
    """A line a camera that saw the wire lit from one side: the first trial's, and in how many it was so."""
    told: dict[str, list[str]] = {}
    for result in results:
        for note in result["seen"]["notes"]:
            told.setdefault(note.split(" sees ")[0], []).append(f"{result['trial']['name']}: {note}")
    for notes in told.values():
        yield notes[0] + (f" (and so in {len(notes) - 1} more trials)" if len(notes) > 1 else "")


def _exact(session: Session) -> Iterator[str]:
    whisker = session.whisker
    given = {
        "whisker length": whisker.length_sigma_mm,
        "whisker diameter": whisker.diameter_sigma_mm,
        "bar diameter": session.bar_diameter_sigma_mm,
        "stiffness C": whisker.C_sigma_Nmm2,
    }
    if session.T_rig_board is not None:
        given["T_rig_board"] = session.T_rig_board_sigma_mm + session.T_rig_board_sigma_rad
    if session.board is not None:
        given["board square"] = session.board.square_sigma_mm
    exact = [name for name, sigma in given.items() if not sigma]
    if exact:
        yield ", ".join(exact)


def _files(figures: Sequence[str]) -> list[str]:
    single = [name for name in figures if "/" not in name]
    folders = sorted({name.split("/")[0] for name in figures if "/" in name})
    tables = ["whisks.csv", "estimates.csv", "budget.csv", "beam.csv", "friction.csv", "phases.csv", "surfaces.csv"]
    tables += ["explained.csv", "error_map.csv"]
    return [", ".join([*tables, "track/", *single, *(f"{folder}/" for folder in folders)])]
