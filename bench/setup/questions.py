"""The numbers that a new session.toml needs, each a question and an option."""

from collections.abc import Iterator
from dataclasses import dataclass

from bench.base.errors import BadInput
from bench.session.angle_source import SOURCES
from bench.session.file_names import SESSION_TOML
from bench.session.givens import Assumed
from bench.session.manifest import BarKeys, BoardKeys, TrialKeys, TruthKeys, WhiskerKeys
from bench.session.plausible import SIGMA, PlausibleRange
from bench.session.stated_board import marker_is_part
from bench.session.strict_toml import declared_parts, plausible_ranges
from bench.setup.lab import Ask, Lab

_TABLES = {
    "whisker": WhiskerKeys,
    "bar": BarKeys,
    "board": BoardKeys,
    "truth": TruthKeys,
    "trial": TrialKeys,
}


@dataclass(frozen=True)
class Question:
    """A number that session.toml needs.

    option: its name on the command line. table, key: in session.toml. wanted: what the number is.
    """

    option: str
    table: str
    key: str
    wanted: str

    @property
    def plausible_range(self) -> PlausibleRange:
        """Return the range of plausible answers."""
        return plausible_ranges(_TABLES[self.table]).get(self.key, SIGMA)

    @property
    def assumed(self) -> float | None:
        """Return the number that stands where the key is left out; None where it must be there."""
        assumption = declared_parts(_TABLES[self.table], Assumed).get(self.key)
        return None if assumption is None else assumption.absolute

    def ask(self, ask: Ask) -> dict[str, float]:
        """Return a plausible answer by option, requested until it is one; nothing for an empty one."""
        default = "fill in later" if self.assumed is None else f"{self.assumed:g} is assumed"
        while text := ask(f"{self.wanted} (Enter: {default}): ").strip():
            try:
                self.plausible_range.check(float(text), self.key, SESSION_TOML)
                return {self.option: float(text)}
            except ValueError:
                print(f"  {text!r} is no number; a decimal point, no unit")
            except BadInput as bad:
                print(f"  {bad.reason}")
        return {}


QUESTIONS = (
    Question("whisker_length_mm", "whisker", "length_mm", "length of the whisker, base to tip, mm"),
    Question(
        "whisker_diameter_mm", "whisker", "diameter_mm", "diameter of the whisker at its base, mm"
    ),
    Question(
        "youngs_modulus_GPa", "whisker", "youngs_modulus_GPa", "Young's modulus of the whisker, GPa"
    ),
    Question(
        "bar_diameter_mm", "bar", "diameter_mm", "diameter of the round bar that is touched, mm"
    ),
    Question("square_mm", "board", "square_mm", "side of a square of the board, as measured, mm"),
    Question("marker_mm", "board", "marker_mm", "side of a marker of the board, mm"),
    Question(
        "origin_sigma_mm",
        "truth",
        "origin_sigma_mm",
        "how well the stage's origin is known against the whisker's base, one sigma, mm",
    ),
    Question("speed_deg_s", "trial", "speed_deg_s", "speed of the motor, deg/s"),
    Question(
        "speed_sigma_deg_s", "trial", "speed_sigma_deg_s", "one standard deviation of it, deg/s"
    ),
    Question("hub_marker", "trial", "hub_marker", "number of the marker on the hub"),
)


def questions_of(lab: Lab) -> Iterator[Question]:
    """Yield the questions that a lab's session.toml answers."""
    tables = {"whisker", "bar"}
    if lab.truth == "stage":
        tables.add("truth")
    if lab.has_cameras:
        tables.add("board")
    for question in QUESTIONS:
        has_table = question.table in tables
        if has_table and (question.option != "marker_mm" or marker_is_part(lab.board_kind)):
            yield question
        if question.table == "trial" and question.key in SOURCES[lab.angle_from].keys:
            yield question
