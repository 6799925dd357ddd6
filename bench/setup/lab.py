"""What a lab has, as `new` asks for it: a few questions with few answers, each also an option.

Imports nothing heavy: the command line makes its options of these.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from bench.base.errors import BadInput

# Of a board on one plane.
KIND_NAMES = ("charuco", "checkerboard", "circles", "asymmetric_circles", "aprilgrid")
BODY = "body"
Ask: TypeAlias = Callable[[str], str]
# The answer of who has no cameras, and so no board.
NOTHING = "none"


@dataclass(frozen=True)
class Choice:
    """A question with few answers, of which Enter takes the first that goes with what is known.

    option: its name on the command line, and in `Lab`. wanted: the question.
    """

    option: str
    wanted: str
    answers: tuple[str, ...]


CHOICES = (
    Choice(
        "cameras", "cameras: two or more, one and a mirror, or none", ("two", "mirror", NOTHING)
    ),
    Choice(
        "truth",
        "where the truth comes from: pictures, pictures with traces, traces without pictures, or a stage",
        ("pictures", "traces", "traces-only", "stage"),
    ),
    Choice("board_kind", "kind of board", (*KIND_NAMES, BODY)),
    Choice(
        "angle_from",
        "where the motor's angle is from: its log, a marker on its hub or the whisker's base in the pictures, "
        "or its constant speed",
        ("log", "marker", "whisker", "speed"),
    ),
    Choice(
        "gauges",
        "gauges: volts with trials that calibrate them, volts with known gauges, or N·mm",
        ("trials", "known", "moments"),
    ),
)


@dataclass(frozen=True)
class Lab:
    """What a lab has, an answer of each of CHOICES. board_kind: "none" without cameras."""

    cameras: str
    truth: str
    board_kind: str
    angle_from: str
    gauges: str

    @property
    def has_cameras(self) -> bool:
        """Return whether anything is seen."""
        return self.cameras != NOTHING

    @property
    def has_traces(self) -> bool:
        """Return whether another program traces the wire."""
        return self.truth in ("traces", "traces-only")

    @property
    def has_frames(self) -> bool:
        """Return whether there are pictures of the trials."""
        return self.has_cameras and self.truth != "traces-only"

    @classmethod
    def of(cls, given: Mapping[str, str], ask: Ask | None = None) -> "Lab":
        """Return the lab of some answers by option, the others requested by `ask` or else the defaults.

        ask: answers a question, '' for its default. Raises BadInput where two answers contradict.
        """
        answers = dict(given)
        for choice in CHOICES:
            option = choice.option
            allowed = _allowed(choice, answers)
            if option in given and given[option] not in allowed:
                raise BadInput(_contradiction(option, given, allowed), file="options")
            if option not in given and ask and len(allowed) > 1:
                answers[option] = _ask_until_allowed(choice.wanted, allowed, ask)
            answers.setdefault(option, allowed[0])
        return cls(**answers)


def _allowed(choice: Choice, known: Mapping[str, str]) -> tuple[str, ...]:
    """Return the answers that go with those known by option, the default first."""
    others = {option: answer for option, answer in known.items() if option != choice.option}
    found = []
    for answer in choice.answers:
        pairs = [{option: other, choice.option: answer} for option, other in others.items()]
        if all(map(_go_together, pairs)):
            found.append(answer)
    if not found:
        return (NOTHING,)  # no board where nothing is seen
    needs_no_camera = known.get("truth") == "stage" or known.get("angle_from") == "speed"
    if NOTHING in found and needs_no_camera:
        found.remove(NOTHING)
        found.insert(0, NOTHING)
    return tuple(found)


def _go_together(known: Mapping[str, str]) -> bool:
    """Return whether no two of the answers known by option contradict each other."""
    truth = known.get("truth", "stage")  # what goes with every other answer, where it is not known
    angle_from = known.get("angle_from", "log")
    board_kind = known.get("board_kind", NOTHING)
    angle_is_seen = angle_from in ("marker", "whisker")
    needs_cameras = truth != "stage" or angle_is_seen or board_kind != NOTHING
    if known.get("cameras") == NOTHING and needs_cameras:
        return False
    if truth == "traces-only" and angle_is_seen:
        return False  # the angle is seen in pictures of the trials
    return truth == "stage" or angle_from != "speed"  # no zero, no truth by pictures


def _ask_until_allowed(wanted: str, allowed: tuple[str, ...], ask: Ask) -> str:
    """Return one of the allowed answers, or the one that a beginning stands for; the first for ''."""
    while text := ask(f"{wanted}: {', '.join(allowed)} (Enter: {allowed[0]}): ").strip().lower():
        meant = [answer for answer in allowed if answer.startswith(text)]
        if text in allowed or len(meant) == 1:
            return text if text in allowed else meant[0]
        print(f"  {text!r} is none of {', '.join(allowed)}")
    return allowed[0]


def _contradiction(option: str, given: Mapping[str, str], allowed: tuple[str, ...]) -> str:
    """Return a line on an answer that does not go with the others that are given."""
    others = ", ".join(f"{name} {answer}" for name, answer in given.items() if name != option)
    return f"{option} {given[option]} does not go with {others}; allowed: {', '.join(allowed)}"
