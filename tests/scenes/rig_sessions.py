"""Protocols of small sessions that the rig makes, and readers of what it wrote."""

import csv
import math
from pathlib import Path

import numpy as np

TINY = """
name = "tiny"
[[cameras]]
name = "left"
position_mm = [30.0, -150.0, 250.0]
size_px = [320, 180]
focal_px = 420.0
[[cameras]]
name = "right"
position_mm = [100.0, -300.0, 90.0]
size_px = [320, 180]
focal_px = 480.0
[board]
views = 2
[pictures]
clock_offset_s = 0.003
[[trials]]
beta_deg = [20, 50]
[[trials]]
purpose = "gauge"
d_x_mm = 50.0
follicle_roll_deg = 90.0
[[trials]]
surface = "rough"
beta_deg = 60
friction = 0.2
static_friction = 0.3
whisks = 3
speed_deg_s = 90.0
"""

# The two cameras of the protocol `quick`, without distortion.
CAMERAS_OF_QUICK = """[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
focal_px = 2010.0
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
target_mm = [53.0, 7.0, 0.0]
focal_px = 1932.0
"""


def protocol_file(folder: Path, text: str) -> Path:
    path = folder / "protocol.toml"
    path.write_text(text)
    return path


def state_of_whisker(session: Path, line: str) -> None:
    """Add a line to [whisker] of session.toml."""
    file = session / "session.toml"
    file.write_text(file.read_text().replace("[whisker]\n", f"[whisker]\n{line}\n", 1))


def contents(folder):
    return {
        p.relative_to(folder).as_posix(): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file()
    }


def rows(path):
    return list(csv.DictReader(path.read_text().splitlines()))


def bar_of(truth, both_radii_mm):
    """Axis, P0 and the axis' point next to it, from truth.toml's keys as the conventions define them."""
    beta, psi, touch = (math.radians(truth[k]) for k in ("beta_deg", "psi_deg", "touch_deg"))
    c, s = math.cos(touch), math.sin(touch)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    axis = turn @ [math.sin(psi), math.cos(psi) * math.sin(beta), math.cos(psi) * math.cos(beta)]
    p0 = turn @ [truth["d_x_mm"], 0, 0]
    return (
        axis,
        p0,
        p0 + turn @ [0, both_radii_mm * math.cos(beta), -both_radii_mm * math.sin(beta)],
    )
