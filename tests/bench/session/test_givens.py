"""Nothing that a session states is exact unless it is said to be."""

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.gauges.gauges_file import read_gauges
from bench.session.array_view import load_views
from bench.session.given_lines import assumed_line, given_lines, givens_of
from bench.session.session import load_session

EXACT = "format = 1\nexact = true\n"


@pytest.fixture
def unsaid(small_copy):
    """The small session without a word on how well anything is known."""
    edit(small_copy, EXACT, "format = 1\n")
    return small_copy


def edit(session, old: str, new: str) -> None:
    file = session / "session.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def test_a_board_s_pose_of_four_rows_is_that_of_three(small_copy):
    three = load_session(small_copy).T_rig_board
    edit(small_copy, "-44.3509729]]", "-44.3509729], [0, 0, 0, 1]]")
    np.testing.assert_array_equal(load_session(small_copy).T_rig_board, three)


def test_what_nobody_said_is_what_a_careful_lab_has(unsaid):
    session = load_session(unsaid)
    whisker = session.whisker
    assert (whisker.length_sigma_mm, whisker.diameter_sigma_mm) == (0.5, 0.02)
    assert whisker.youngs_modulus_sigma_GPa == pytest.approx(0.05 * whisker.youngs_modulus_GPa)
    assert whisker.flexural_rigidity_sigma_Nmm2 == 0.0  # not given, so there is nothing to know
    assert whisker.C_sigma_Nmm2 / whisker.C_Nmm2 == pytest.approx(np.hypot(0.05, 4 * 0.02))
    assert session.bar_diameter_sigma_mm == 0.02
    assert session.trial("b30_3").bar_diameter_sigma_mm == 0.02
    assert session.board.square_sigma_mm == pytest.approx(1e-3 * session.board.square_mm)
    assert session.board.stretch_sigma == 1e-3
    assert session.T_rig_board_sigma_mm == 0.2
    assert session.T_rig_board_sigma_rad == pytest.approx(np.radians(0.2))
    assert {given.source for given in givens_of(session)} == {"assumed"}


def test_a_thin_wire_is_not_measured_by_a_caliper(unsaid):
    """± 0.02 mm of a wire of 0.1 mm would be a fifth of it."""
    edit(unsaid, "diameter_mm = 1.0", "diameter_mm = 0.1")
    assert load_session(unsaid).whisker.diameter_sigma_mm == pytest.approx(0.002)


def test_a_turn_of_the_follicle_is_known_to_a_degree_in_ninety(unsaid):
    session = load_session(unsaid)
    assert session.trial("gauge_roll90").follicle_roll_sigma_deg == pytest.approx(1.0)
    assert session.trial("gauge_roll0").follicle_roll_sigma_deg == 0.0


def test_a_session_may_be_exact(small_session):
    session = load_session(small_session)
    assert session.whisker.C_sigma_Nmm2 == session.T_rig_board_sigma_mm == 0.0
    assert session.board.square_sigma_mm == session.board.stretch_sigma == 0.0
    assert session.bar_diameter_sigma_mm == 0.0
    assert {given.source for given in givens_of(session)} == {"exact"}
    (line,) = given_lines(session)
    assert line.startswith("  exact, as said: [whisker] length_mm, ")
    assert assumed_line([session]) == ""


def test_a_table_and_a_key_go_before_the_session(small_copy):
    edit(small_copy, "[bar]\n", "[bar]\nexact = false\n")
    edit(small_copy, "[board]\n", "[board]\nsquare_sigma_mm = 0.01\n")
    session = load_session(small_copy)
    assert (session.bar_diameter_sigma_mm, session.board.square_sigma_mm) == (0.02, 0.01)
    assert session.T_rig_board_sigma_mm == 0.0
    marks = [line for line in given_lines(session) if "diameter_mm" in line]
    assert marks[0] == "* [bar] diameter_mm ± 0.02 mm, assumed: a caliper, or as drawn"
    assert "  [board] square_mm ± 0.01 mm, stated" in list(given_lines(session))


def test_a_sigma_of_0_is_exact(unsaid):
    edit(unsaid, "[rig]\n", "[rig]\nT_rig_board_sigma_mm = 0\n")
    session = load_session(unsaid)
    assert session.T_rig_board_sigma_mm == 0.0 and session.T_rig_board_sigma_rad > 0.0
    sources = {(given.unit, given.source) for given in session.givens if "T_rig" in given.key}
    assert sources == {("mm", "exact"), ("deg", "assumed")}


def test_a_trial_says_what_is_exact_of_its_own(unsaid):
    (unsaid / "trials" / "b30_3" / "trial.toml").write_text("bar_diameter_mm = 6.2\nexact = true\n")
    (unsaid / "trials" / "b60_4" / "trial.toml").write_text("bar_diameter_mm = 6.2\n")
    session = load_session(unsaid)
    assert session.trial("b30_3").bar_diameter_sigma_mm == 0.0
    assert session.trial("b60_4").bar_diameter_sigma_mm == 0.02


def test_a_matrix_is_known_to_a_share_of_each_row(unsaid):
    with (unsaid / "session.toml").open("a") as file:
        file.write(
            "\n[gauges]\noffset_V = [0, 0]\nmatrix_Nmm_per_V = [[10.0, 1.0], [0.0, -20.0]]\n"
        )
    sigma = load_session(unsaid).gauges.matrix_sigma_Nmm_per_V
    np.testing.assert_allclose(sigma, [[0.1, 0.1], [0.2, 0.2]])


EYE = [[0.01 * (row == column) for column in range(4)] for row in range(4)]
NEGATIVE = [[-value for value in row] for row in EYE]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("C_Nmm2 = 0", r"gauges.toml: C_Nmm2 is 0; from 0.0003 to 3e\+08 is allowed"),
        ("C_Nmm2 = 1e-320", r"gauges.toml: C_Nmm2 is .*is allowed"),
        (f"covariance = {NEGATIVE}", r"gauges.toml: covariance is none: symmetric"),
        (f"covariance = {[[0.01, 0.005, 0, 0], *EYE[1:]]}", r"gauges.toml: covariance is none"),
        (
            "[without.b60_4]\nmatrix_Nmm_per_V = [[nan, 0], [0, 1]]",
            r"gauges.toml: \[without.b60_4\] matrix_Nmm_per_V is not of numbers from -1e\+07",
        ),
    ],
)
def test_gauges_that_cannot_be_are_refused(tmp_path, line, expected):
    file = tmp_path / "gauges.toml"
    file.write_text(f"offset_V = [0, 0]\nmatrix_Nmm_per_V = [[10.0, 1.0], [0.0, -20.0]]\n{line}\n")
    with pytest.raises(BadInput, match=expected):
        read_gauges(file, 8835.7)


def test_a_gauges_file_without_sigmas_is_known_no_better(tmp_path):
    file = tmp_path / "gauges.toml"
    table = "offset_V = [0, 0]\nmatrix_Nmm_per_V = [[10.0, 1.0], [0.0, -20.0]]\n"
    file.write_text(table)
    np.testing.assert_allclose(read_gauges(file, 1.0).all.sigma, [[0.1, 0.1], [0.2, 0.2]])
    file.write_text(f"exact = true\n{table}")
    assert not read_gauges(file, 1.0).all.sigma.any()


def test_the_gain_of_moments_counts_where_moments_are_recorded(unsaid):
    lines = "\n".join(given_lines(load_session(unsaid)))
    assert "moments" not in lines
    signals = unsaid / "trials" / "b30_3" / "signals.csv"
    signals.write_text(signals.read_text().replace("y_V,z_V", "m_y_Nmm,m_z_Nmm", 1))
    session = load_session(unsaid)
    assert session.trial("b30_3").moment_gain_sigma == 0.01
    found = list(given_lines(session))
    assert "* [trial] moments in N·mm ± 1 %, assumed: a calibrated cell" in found


def test_a_whisker_of_an_array_is_placed_by_hand(tmp_path):
    (tmp_path / "session.toml").write_text(
        'format = 1\n[[whiskers]]\nname = "a"\nbase_mm = [0.0, 0.0, 0.0]\nlength_mm = 100.0\n'
        "diameter_mm = 1.0\nyoungs_modulus_GPa = 60.0\n"
    )
    (view,) = load_views(tmp_path)
    assert view.base.sigma_mm == 0.2 and view.base.sigma_rad == pytest.approx(np.radians(0.2))
    assert "[[whiskers]] a base_mm ± 0.2 mm" in assumed_line([view])


def test_exact_is_true_or_false(small_copy):
    edit(small_copy, "[bar]\n", "[bar]\nexact = 1\n")
    with pytest.raises(
        BadInput, match=r"\[bar\] exact: expected true or false, found a whole number"
    ):
        load_session(small_copy)
