"""`whisker-bench new`: the folders of a session, and an annotated session.toml to fill in."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import tomli_w

from bench.base.atomic import write_whole
from bench.base.errors import BadInput
from bench.session.manifest import BarKeys, BoardKeys, TruthKeys, WhiskerKeys
from bench.session.plausible import SIGMA, PlausibleRange
from bench.session.session import MANIFEST
from bench.session.stated_board import marker_is_part
from bench.session.strict_toml import plausible_ranges
from vision.boards import CharucoBoard

FOLDERS = ("boards", "boards/rig", "trials")
# Folders by where the truth comes from.
_FOLDERS_OF = {"pictures": FOLDERS, "stage": ("trials",)}
Ask: TypeAlias = Callable[[str], str]
_TABLES = {"whisker": WhiskerKeys, "bar": BarKeys, "board": BoardKeys, "truth": TruthKeys}


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


_RODS = (
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
)
QUESTIONS = (
    *_RODS,
    Question("square_mm", "board", "square_mm", "side of a square of the board, as measured, mm"),
    Question("marker_mm", "board", "marker_mm", "side of a marker of the board, mm"),
)
_ORIGIN = Question(
    "origin_sigma_mm",
    "truth",
    "origin_sigma_mm",
    "how well the stage's origin is known against the whisker's base, one sigma, mm",
)
# Questions by where the truth comes from.
QUESTIONS_OF = {"pictures": QUESTIONS, "stage": (*_RODS, _ORIGIN)}


@dataclass(frozen=True)
class BoardLines:
    """What a new session.toml says of its board: its kind, squares, and a ChArUco board's dictionary."""

    kind: str
    squares: tuple[int, int]
    dictionary: str

    def text(self) -> str:
        """Return the lines."""
        kind = f'kind = "{self.kind}"'.ljust(32) + "# docs/bring.md has the others"
        squares = f"squares = [{self.squares[0]}, {self.squares[1]}]".ljust(32)
        lines = [kind, f"{squares}# along x, along y"]
        if self.kind == CharucoBoard.kind:
            lines.append(f'dictionary = "{self.dictionary}"')
        return "\n".join(lines)


def new_session(
    path: Path,
    name: str,
    given: Mapping[str, float],
    board: "BoardLines",
    ask: Ask | None = None,
    truth: str = "pictures",
    *,
    motor_log: bool = True,
) -> list[str]:
    """Make the folder of a session with its manifest; return lines on what comes next.

    given: by option's name; ask: answers a question, '' for not known; None asks nothing. truth: where
    it comes from, a key of QUESTIONS_OF.
    motor_log: the signals have motor_deg. Raises BadInput where there is a session already, or a number
    is implausible.
    """
    if (path / MANIFEST).exists():
        raise BadInput(f"there is a {MANIFEST} already; nothing was written", file=path)
    questions = _questions(truth, board.kind)
    for question in questions:
        if question.option in given:
            option = f"--{question.option.replace('_', '-')}"
            question.plausible_range.check(given[question.option], option, str(path))
    answers = dict(given)
    for question in questions if ask else ():
        if question.option not in answers:
            answers |= _ask_until_plausible(question, ask)
    for folder in _FOLDERS_OF[truth]:
        (path / folder).mkdir(parents=True, exist_ok=True)
    text = manifest_text(name or path.resolve().name, answers, board, truth)
    write_whole(path / MANIFEST, text if motor_log else _without_motor_log(text))
    missing = [question for question in questions if question.option not in answers]
    return list(_next_steps(path, missing, truth))


def _ask_until_plausible(question: Question, ask: Ask) -> dict[str, float]:
    """Return a plausible answer by option, requested until it is one; nothing for an empty one."""
    while text := ask(f"{question.wanted} (Enter: fill in later): ").strip():
        try:
            question.plausible_range.check(float(text), question.key, MANIFEST)
            return {question.option: float(text)}
        except ValueError:
            print(f"  {text!r} is no number; a decimal point, no unit")
        except BadInput as bad:
            print(f"  {bad.reason}")
    return {}


def manifest_text(
    name: str, answers: Mapping[str, float], board: "BoardLines", truth: str = "pictures"
) -> str:
    """Return session.toml with what is known, and a line to fill in for what is not."""
    lines = {q.option: _line(q.key, answers.get(q.option), q.wanted) for q in QUESTIONS_OF[truth]}
    if not marker_is_part(board.kind):
        lines["marker_mm"] = "# marker_mm                     # of other kinds of board"
    named = tomli_w.dumps({"name": name}).strip()
    return _TEMPLATES[truth].format(named=named, board=board.text(), **lines)


def _without_motor_log(text: str) -> str:
    """Return session.toml for signals without motor_deg: the angle is by the motor's stated speed."""
    return text.replace(_SPEED, _BY_SPEED).replace("time_s,motor_deg,", "time_s,")


def _line(key: str, value: float | None, wanted: str) -> str:
    """Return the line of a key; one to fill in for None."""
    if value is None:
        return f"# {key} =        # FILL IN: {wanted}"
    return f"{key} = {value:.10g}".ljust(32) + f"# {wanted}"


def _questions(truth: str, kind: str) -> list[Question]:
    """Return the questions by where the truth comes from, with a kind of board: not all have marker_mm."""
    has_marker = marker_is_part(kind)
    return [q for q in QUESTIONS_OF[truth] if has_marker or q.option != "marker_mm"]


def _next_steps(path: Path, missing: Sequence[Question], truth: str) -> Iterator[str]:
    """Yield lines on what to do next. missing: questions that were not answered."""
    yield f"written: {path / MANIFEST}"
    if missing:
        yield f"{len(missing)} lines are to be filled in: look for FILL IN"
    folders = "trials/" if truth == "stage" else "boards/ and trials/"
    yield f"then record {folders} (comments in the file say how), and run: whisker-bench check {path}"


_HEAD = """\
# A session of whisker-bench: what was recorded in one sitting, with one whisker on one rig.
# Lengths in mm, angles in degrees, gauges in volts. Any length or angle may have its standard deviation beside it:
# length_sigma_mm, square_sigma_mm. What has none is known as well as a careful lab knows it (docs/formats.md), and the
# report marks it. Exact is what has a sigma of 0, or none in a table with exact = true.
# Every key: docs/formats.md. `whisker-bench check` on this folder lists all that is wrong or doubtful.
format = 1
{named}
# surfaces = ["steel", "sandpaper"]  # their order in tables and figures

[whisker]
shape = "cylinder"              # "cone": base diameter to a point; "tapered": to tip_diameter_mm
{whisker_length_mm}
{whisker_diameter_mm}
{youngs_modulus_GPa}
# flexural_rigidity_Nmm2 =      # E I at the base, in place of Young's modulus

[bar]
{bar_diameter_mm}

"""

_CAMERAS = """\
[board]                         # `whisker-bench board` prints one with these numbers
{board}
{square_mm}
{marker_mm}

[rig]
# Where the board stands on the rig, in the pictures boards/rig/<camera>.png, is measured: record free strokes of some
# 20 degrees, with a spare marker of the board's dictionary on the hub, then run `whisker-bench calibrate rig` on this
# folder. It writes rig.toml, and there is nothing to fill in here.
# Who has measured it otherwise writes T_rig_board, 3 rows of 4, mm: rig = rows * [board x, board y, board z, 1], with
# T_rig_board_sigma_mm and T_rig_board_sigma_deg. Rig frame: origin at the whisker's base, z the motor's axis, x along
# the whisker at motor angle 0. Board frame: origin at its upper left corner, x right, y down, z into the board.

"""

_STAGE = """\
[truth]
source = "stage"                # d_x, or the object's place, is what trials state; no camera is needed
{origin_sigma_mm}

"""

_SPEED = """\
# speed_deg_s = 10.0            # nominal
"""

_BY_SPEED = """\
angle_from = "speed"            # no motor log: one forward stroke at constant speed a recording
# speed_deg_s =        # FILL IN: of the motor, deg/s
# speed_sigma_deg_s =  # FILL IN: one standard deviation of it
"""

_TRIAL = f"""\
[trial]                         # for all trials; a key in trials/<trial>/trial.toml goes before it
# surface = "steel"             # groups trials in fits and figures
{_SPEED}"""

_FRAMES = """\
# frame_rate_Hz = 20.0          # where no frames.csv tells the frames' times
# first_frame_s = 0.0

"""

_RECORD_PICTURES = """\
# What to record:
#   boards/<camera>/*.png       10 or more views of the board a camera: tilted, near and far, into the corners
#   boards/rig/<camera>.png     the empty rig with the board standing on it, one picture a camera
#   trials/<trial>/<camera>/*   the frames, or <camera>.mp4, .avi, .mkv
#   trials/<trial>/frames.csv   frame,time_s
#   trials/<trial>/signals.csv  time_s,motor_deg,y_V,z_V
#   trials/<trial>/trial.toml   surface, speed_deg_s, beta_deg; purpose = "gauge" for trials that calibrate the gauges:
#                               two of them, follicle_roll_deg = 0 and 90
"""

_RECORD_STAGE = """\

# What to record:
#   trials/<trial>/signals.csv  time_s,motor_deg,y_V,z_V, or m_y_Nmm,m_z_Nmm
#   trials/<trial>/trial.toml   surface, speed_deg_s, beta_deg, beta_sigma_deg, and one of these:
#                               d_x_mm, d_x_sigma_mm   from the base to the contact at first touch
#                               [object] point_mm      of the bar's axis, rig frame; point_sigma_mm
#   trials/<trial>/stage.csv    time_s,x_mm,y_mm,z_mm,x_sigma_mm,y_sigma_mm,z_sigma_mm: where the stage has the
#                               bar's axis, on the signals' clock; added to point_mm where both are there
# Gauges in volts need [gauges], or trials of purpose = "gauge" at slope 0, follicle_roll_deg = 0 and 90.
"""

# What each way to the truth has in session.toml.
_TEMPLATES = {
    "pictures": _HEAD + _CAMERAS + _TRIAL + _FRAMES + _RECORD_PICTURES,
    "stage": _HEAD + _STAGE + _TRIAL + _RECORD_STAGE,
}
