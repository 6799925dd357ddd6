"""Measured diameters of a whisker as a lab states them: what wire and beam they are, and their faults."""

import re
import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.rig.simulation import simulate
from bench.session.session import load_session
from tests.scenes.refusals import refusal
from tests.scenes.rig_sessions import protocol_file, state_of_whisker

LENGTH_MM = 100.0  # of the sample's whisker, 1 mm thick
ARC_MM = np.linspace(0.0, LENGTH_MM, 16)


def diameters(arc_mm):
    """A root and a tip that are thicker than a cone's."""
    share = np.asarray(arc_mm) / LENGTH_MM
    return 1.0 - 0.35 * share - 0.9 * share**2 + 0.45 * share**3


@pytest.fixture
def session(steel_signals, tmp_path):
    """A session without pictures, to be changed."""
    return shutil.copytree(steel_signals, tmp_path / "session", copy_function=shutil.copyfile)


def measure(session, rows: np.ndarray, header: str = "arc_mm,diameter_mm") -> None:
    """Write rows (n, columns) to profile.csv, and name it in session.toml."""
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    (session / "profile.csv").write_text("\n".join([header, *lines]) + "\n")
    if 'profile = "' not in (session / "session.toml").read_text():
        state_of_whisker(session, 'profile = "profile.csv"')


ROWS = np.column_stack([ARC_MM, diameters(ARC_MM)])


def test_wire_and_beam_have_the_measured_diameters(session):
    """Written with six decimals of a mm: 1e-6 of the diameter."""
    measure(session, ROWS)
    whisker = load_session(session).whisker
    arc = np.linspace(0.0, LENGTH_MM, 41)
    assert 2 * whisker.wire.radius_mm(arc) == pytest.approx(diameters(arc), abs=2e-6)
    assert whisker.beam.width(arc / LENGTH_MM) == pytest.approx(diameters(arc), abs=2e-6)
    assert whisker.tip_diameter_mm == pytest.approx(0.2, abs=2e-6)


def test_noise_of_a_microscope_is_smoothed(session):
    """Readings of 1 % each: five coefficients of 40 readings leave 1 % · sqrt(5/40) of it, 0.9 % at 2.5 sigma;
    at the ends of the range, where a polynomial knows least, twice that."""
    arc = np.linspace(0.0, LENGTH_MM, 40)
    noise = np.random.default_rng(3).normal(0, 0.01, arc.size)
    measure(session, np.column_stack([arc, diameters(arc) + noise]))
    off = 2 * load_session(session).whisker.wire.radius_mm(arc) - diameters(arc)
    assert np.abs(off).max() < 0.018
    assert np.sqrt(np.mean(off**2)) < 0.006


def test_a_sigma_of_the_table_is_the_diameter_s(session):
    measure(
        session, np.column_stack([ROWS, np.full(16, 0.004)]), "arc_mm,diameter_mm,diameter_sigma_mm"
    )
    assert load_session(session).whisker.diameter_sigma_mm == pytest.approx(0.004)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            lambda p: p[4:],
            r"profile.csv: goes from 26.66\d+ to 100 mm, length_mm is 100; the first",
        ),
        (
            lambda p: p[:13],
            r"profile.csv: goes from 0 to 80 mm, length_mm is 100; the first and the last",
        ),
        (lambda p: p[:5], r"profile.csv: has 5 places; 6 or more are needed"),
        (
            lambda p: p[[0, 2, 1, *range(3, 16)]],
            r"profile.csv, row 4, column arc_mm: goes back from",
        ),
        (
            lambda p: p * [1, -1],
            r"profile.csv, row 2, column diameter_mm: -1; diameters are above 0",
        ),
        (
            lambda p: p + np.outer(np.arange(16) == 7, [0, 0.3]),
            r"profile.csv, row 9: lies 0.\d+ mm from the smooth curve",
        ),
        (
            lambda p: p * [1, 1000],
            r"session.toml: .*diameter_mm = 1, but profile says 1000 mm there",
        ),
    ],
)
def test_a_fault_of_the_table_is_named_by_its_row(session, change, expected):
    measure(session, change(ROWS))
    assert re.search(expected, refusal(session))


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        (
            "tip_diameter_mm = 0.5",
            "tip_diameter_mm = 0.5, but profile says 0.2 mm there: correct one",
        ),
        ('profile = "../profile.csv"', "profile = '../profile.csv': there is no such file beside"),
    ],
)
def test_what_contradicts_the_profile_is_one_line(session, line, expected):
    if "tip" in line:
        measure(session, ROWS)
    state_of_whisker(session, line)
    assert expected in refusal(session)


def test_a_stated_tip_that_agrees_is_taken(session):
    measure(session, ROWS)
    state_of_whisker(session, "tip_diameter_mm = 0.203")
    assert load_session(session).whisker.tip_diameter_mm == pytest.approx(0.2, abs=2e-6)


def simulated(folder, widths: str):
    """A session of signals whose whisker has these widths."""
    text = f"[whisker]\nwidths = {widths}\n[[trials]]\nd_x_mm = 50.0\n"
    return simulate(folder / "s", protocol=protocol_file(folder, text), signals_only=True)


def test_a_simulated_whisker_states_its_diameters(tmp_path):
    """Written with six decimals of a mm."""
    session = simulated(tmp_path, "[1.0, -0.35, -0.9, 0.4, 0.05]")
    whisker = load_session(session).whisker
    assert whisker.profile == "profile.csv"
    assert whisker.widths == pytest.approx((1.0, -0.35, -0.9, 0.4, 0.05), abs=1e-4)


@pytest.mark.parametrize("widths", ["[0.9, -0.5]", "[1.0, -4.0, 3.5]", "[1.0, 0.5]"])
def test_a_simulated_whisker_has_diameters(tmp_path, widths):
    with pytest.raises(
        BadInput, match=r"protocol.toml: a whisker's (widths are|tip_diameter_mm is)"
    ):
        simulated(tmp_path, widths)
