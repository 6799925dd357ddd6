"""What a lab has, as `new` asks for it: a few questions with few answers, each also an option.

Imports nothing heavy: the command line makes its options of these.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from bench.base.errors import BadInput

# Of a board on one plane.
KIND_NAMES = ("charuco", "checkerboard", "circles", "asymmetric_circles", "aprilgrid")
BODY = "body"
Ask: TypeAlias = Callable[[str], str]


@dataclass(frozen=True)
class Choice:
    """A question with few answers, of which Enter takes the first that goes with what is known.

    option: its name on the command line, and in `Lab`. wanted: the question.
    """

    option: str
    wanted: str
    answers: tuple[str, ...]


CHOICES = (
    Choice("cameras", "cameras: two or more, one and a mirror, or none", ("two", "mirror", "none")),
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
        return self.cameras != "none"

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
    if choice.option == "cameras" and (
        known.get("truth") == "stage" or known.get("angle_from") == "speed"
    ):
        return tuple(reversed(choice.answers))
    if choice.option == "cameras" and "truth" in known:
        return choice.answers[:-1]  # all but none
    if choice.option == "truth" and (
        known.get("cameras") == "none" or known.get("angle_from") == "speed"
    ):
        return ("stage",)
    if choice.option == "board_kind" and known.get("cameras") == "none":
        return ("none",)
    if choice.option == "angle_from":
        return tuple(_angles(known["cameras"], known["truth"]))
    return choice.answers


def _angles(cameras: str, truth: str) -> Iterator[str]:
    """Yield where the motor's angle may be from: pictures of trials show it, and give no truth with a stated speed."""
    yield "log"
    if cameras != "none" and truth != "traces-only":
        yield "marker"
        yield "whisker"
    if truth == "stage":
        yield "speed"


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
