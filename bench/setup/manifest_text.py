"""The text of a new session.toml: what is known, a line to fill in for what is not, what to record."""

from collections.abc import Iterator, Mapping

import tomli_w

from bench.session.angle_source import SOURCES
from bench.setup.lab import BODY, Lab
from bench.setup.questions import Question, questions_of
from vision.boards import CharucoBoard

# The camera of whose picture the mirror's part is, as its folder is named.
WHOLE_CAMERA = "camera"
_LINE = 32  # characters before a comment
TO_FILL_IN = "FILL IN"


def manifest_text(
    name: str,
    numbers: Mapping[str, float],
    lab: Lab,
    squares: tuple[int, int],
    dictionary: str,
) -> str:
    """Return session.toml for what a lab has. numbers: by the option of their question."""
    lines = {question.option: _line(question, numbers) for question in questions_of(lab)}
    named = tomli_w.dumps({"name": name}).strip()
    tables = [_HEAD.format(named=named, **lines)]
    if lab.truth == "stage":
        tables.append(_STAGE.format(**lines))
    if lab.has_cameras:
        board = _board_lines(lab.board_kind, squares, dictionary)
        lines.setdefault("marker_mm", "# marker_mm".ljust(_LINE) + "# of other kinds of board")
        tables.append(_CAMERAS.format(board=board, **lines))
    if lab.cameras == "mirror":
        tables.append(_MIRROR)
    if lab.gauges == "known":
        tables.append(_GAUGES)
    tables.append(_TRIAL.format(angle=_angle_lines(lab, lines)))
    tables.append(_FRAMES if lab.has_frames else "")
    tables.append(_recording_text(lab))
    return "".join(tables)


def _line(question: Question, numbers: Mapping[str, float]) -> str:
    """Return the line of a key; of one that is not known one to fill in, or with what is assumed."""
    number = numbers.get(question.option)
    if number is not None:
        return f"{question.key} = {number:.10g}".ljust(_LINE) + f"# {question.wanted}"
    if question.assumed is not None:
        assumed = f"# {question.key} = {question.assumed:.10g}".ljust(_LINE)
        return f"{assumed}# {question.wanted}; left out, this is assumed"
    return f"# {question.key} =        # {TO_FILL_IN}: {question.wanted}"


def _board_lines(kind: str, squares: tuple[int, int], dictionary: str) -> str:
    """Return the lines of a board's kind, squares, and of ChArUco boards' dictionary and markers."""
    lines = [
        f'kind = "{kind}"'.ljust(_LINE) + "# docs/bring.md has the others",
        f"squares = [{squares[0]}, {squares[1]}]".ljust(_LINE) + "# along x, along y",
    ]
    if kind in (CharucoBoard.kind, BODY):
        lines.append(f'dictionary = "{dictionary}"')
    if kind == BODY:
        wanted = "[., ., ...], first marker of each face (board --first-id)"
        lines.append(f"# first_ids =        # {TO_FILL_IN}: {wanted}")
    return "\n".join(lines)


def _angle_lines(lab: Lab, lines: Mapping[str, str]) -> str:
    """Return the lines of [trial] on the motor's angle. lines: of keys, by the option of their question."""
    needed = SOURCES[lab.angle_from].keys
    found = [lines[key] for key in needed]
    if lab.angle_from in _ANGLE_FROM:
        source = f'angle_from = "{lab.angle_from}"'.ljust(_LINE)
        found.insert(0, f"{source}# {_ANGLE_FROM[lab.angle_from]}")
    if "speed_deg_s" not in needed:
        found.append("# speed_deg_s = 10.0            # nominal")
    return "\n".join(found)


def _recording_text(lab: Lab) -> str:
    """Return the comment on what is to be recorded."""
    rows = [f"#   {file.ljust(27)} {what}\n" for file, what in _to_record(lab)]
    return "".join(["\n# What to record:\n", *rows])


def _to_record(lab: Lab) -> Iterator[tuple[str, str]]:
    """Yield the files that are to be recorded, and what is in each."""
    if lab.has_cameras:
        yield from _pictures_to_record(lab)
    if lab.has_traces:
        yield "trials/<trial>/trace_<camera>.csv", "frame,u_px,v_px, or your tracker's own file"
    if lab.truth == "traces-only":
        yield (
            "trials/<trial>/object_<camera>.csv",
            "likewise, two places or more of the bar's middle (or joints bar_... of the trace)",
        )
    motor = "motor_deg," if lab.angle_from == "log" else ""
    channels = "m_y_Nmm,m_z_Nmm" if lab.gauges == "moments" else "y_V,z_V"
    yield "trials/<trial>/signals.csv", f"time_s,{motor}{channels}"
    yield "trials/<trial>/trial.toml", "surface, speed_deg_s, beta_deg"
    has_place = lab.truth == "stage" and lab.angle_from == "log"  # no zero: no touch of a place
    if lab.truth == "stage":
        yield "", "beta_sigma_deg; d_x_mm and d_x_sigma_mm, from the base to the"
        yield "", "contact at first touch" + (", or one of the next two" if has_place else "")
    if has_place:
        yield "", "[object] point_mm of the bar's axis, rig frame, point_sigma_mm"
    if lab.gauges == "trials":
        yield "", 'purpose = "gauge" for trials that calibrate the gauges:'
        yield "", "two of them, at slope 0, follicle_roll_deg = 0 and 90"
    if has_place:
        yield "trials/<trial>/stage.csv", "time_s,x_mm,y_mm,z_mm,x_sigma_mm,y_sigma_mm,z_sigma_mm:"
        yield "", "where the stage has the bar's axis, on the signals' clock;"
        yield "", "added to point_mm where both are there"


def _pictures_to_record(lab: Lab) -> Iterator[tuple[str, str]]:
    """Yield the files of the cameras, and what is in each."""
    name = WHOLE_CAMERA if lab.cameras == "mirror" else "<camera>"
    both = ", seen in both parts at once" if lab.cameras == "mirror" else ""
    yield f"boards/{name}/*.png", f"10 or more views of the board a camera{both}:"
    yield "", "tilted, near and far, into the corners"
    if lab.board_kind == BODY:
        yield "", "some with two faces at once, which say how these stand"
    yield f"boards/rig/{name}.png", "the empty rig with the board standing on it"
    if lab.has_frames:
        yield f"trials/<trial>/{name}/*", f"the frames, or {name}.mp4, .avi, .mkv"
    yield "trials/<trial>/frames.csv", "frame,time_s"


_HEAD = """\
# A session of whisker-bench: what was recorded in one sitting, with one whisker on one rig.
# Lengths in mm, angles in degrees, gauges in volts. Any length or angle may have its standard deviation beside it:
# length_sigma_mm, square_sigma_mm. What has none is known as well as a careful lab knows it (docs/formats.md), and the
# report marks it. Exact is what has a sigma of 0, or none in a table with exact = true.
# Every key: docs/formats.md. `whisker-bench check` on this folder lists all errors and warnings.
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
# square_sigma_mm = 0.15        # of a square that nobody measured on the print; left out: 0.1 %, a caliper's
{marker_mm}

[rig]
# Where the board stands on the rig, in the pictures boards/rig/<camera>.png, is measured: record free strokes of some
# 20 degrees, with a spare marker of the board's dictionary on the hub, then run `whisker-bench calibrate rig` on this
# folder. It writes rig.toml, and there is nothing to fill in here.
# Who has measured it otherwise writes T_rig_board, 3 rows of 4, mm: rig = rows * [board x, board y, board z, 1], with
# T_rig_board_sigma_mm and T_rig_board_sigma_deg. Rig frame: origin at the whisker's base, z the motor's axis, x along
# the whisker at motor angle 0. Board frame: origin at its upper left corner, x right, y down, z into the board.

"""

_MIRROR = f"""\
[[cameras]]
name = "mirrored"
of = "{WHOLE_CAMERA}"                   # the camera in whose picture the mirror is
# crop =        # {TO_FILL_IN}: [left, top, width, height] of the mirror's part of the picture, px
mirrored = true

"""

_GAUGES = f"""\
[gauges]                        # [m_y, m_z] in the follicle's axes = matrix * ([y_V, z_V] - offset)
# offset_V =        # {TO_FILL_IN}: [y, z] where there is no moment, V
# matrix_Nmm_per_V =        # {TO_FILL_IN}: [[., .], [., .]], N mm/V

"""

_STAGE = """\
[truth]
source = "stage"                # d_x, or the object's place, is what trials state; no camera is needed
{origin_sigma_mm}

"""

# Of an angle that is not from a log.
_ANGLE_FROM = {
    "speed": "no motor log: one forward stroke at constant speed a recording",
    "marker": "no motor log: a spare marker of the board's dictionary on the hub, by `calibrate angles`",
    "whisker": "no motor log: one forward stroke a recording, by `calibrate angles`",
}

_TRIAL = """\
[trial]                         # for all trials; a key in trials/<trial>/trial.toml goes before it
# surface = "steel"             # groups trials in fits and figures
{angle}
"""

_FRAMES = """\
# frame_rate_Hz = 20.0          # where no frames.csv tells the frames' times
# first_frame_s = 0.0
"""
