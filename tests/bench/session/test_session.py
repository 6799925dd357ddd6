"""What a session folder says, read into objects."""

import shutil

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.input_problems import InputProblems
from bench.session.manifest import TrialKeys, WhiskerKeys
from bench.session.session import load_session
from bench.session.strict_toml import key_names
from bench.session.trial import Trial
from bench.session.whisker import Whisker
from vision.geometry.reasons import as_reason


def add(file, text: str) -> None:
    file.write_text(file.read_text() + text)


def replace(file, old: str, new: str) -> None:
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))


def test_cameras_are_the_folders_that_hold_pictures(small_session, steel_signals):
    assert load_session(small_session).camera_names == ("high", "low")
    assert load_session(steel_signals).camera_names == ()


def test_manifests_of_the_sample_session(steel_signals):
    session = load_session(steel_signals)
    assert [trial.name for trial in session.trials] == [
        "b00_2",
        "b30_3",
        "b60_4",
        "gauge_roll0",
        "gauge_roll90",
    ]
    assert [trial.purpose for trial in session.trials] == ["measure"] * 3 + ["gauge"] * 2
    assert session.trial("gauge_roll90").follicle_roll_deg == 90.0
    assert session.trial("b60_4").beta_deg == 60.0
    assert (session.bar_diameter_mm, session.trial("b60_4").bar_diameter_mm) == (6.0, 6.0)
    assert session.board.squares == (8, 6)
    assert session.T_rig_board.shape == (3, 4)
    assert (session.cameras_toml, session.gauges_toml, session.gauges) == (None, None, None)


def test_rigidity_of_the_nitinol_wire(steel_signals):
    # E I = 60 GPa · π (1 mm)⁴ / 64 = 2945.2 N·mm², as the session format has it to 0.05 N·mm²
    assert load_session(steel_signals).whisker.C_Nmm2 == pytest.approx(3 * 2945.2, abs=3 * 0.05)


def test_natural_order_of_trials(small_copy):
    for name in ("b30_3", "b60_4"):
        (small_copy / "trials" / name).rename(
            small_copy / "trials" / f"w{10 if name == 'b30_3' else 9}"
        )
    names = [trial.name for trial in load_session(small_copy).trials]
    assert names == ["gauge_roll0", "gauge_roll90", "w9", "w10"]


def test_trials_come_in_the_order_of_the_sessions_surfaces(small_copy):
    for name, surface in (("b30_3", "sandpaper"), ("b60_4", "steel")):
        manifest = small_copy / "trials" / name / "trial.toml"
        replace(manifest, 'surface = "steel"', f'surface = "{surface}"')
    replace(
        small_copy / "session.toml",
        "format = 1",
        'format = 1\nsurfaces = ["steel", "sandpaper", "glas"]',
    )
    problems = InputProblems(stop_at_first=False)
    names = [t.name for t in load_session(small_copy, problems).trials if t.purpose == "measure"]
    assert names == ["b60_4", "b30_3"]
    (unused,) = (note for note in problems.warnings if "surface_unused" in as_reason(note).codes)
    assert "'glas'" in unused


def test_defaults_of_the_session_yield_to_the_trial(small_copy):
    add(
        small_copy / "session.toml",
        '\n[trial]\nsurface = "glass"\nd_x_mm = 50.0\nd_x_sigma_mm = 0.5\nbar_diameter_mm = 6.4\n'
        "bar_diameter_sigma_mm = 0.02\n",
    )
    add(small_copy / "trials" / "b30_3" / "trial.toml", "\nbar_diameter_mm = 7.0\n")
    session = load_session(small_copy)
    own, default = session.trial("b30_3"), session.trial("b60_4")
    assert (own.surface, own.d_x_mm, own.d_x_sigma_mm) == ("steel", 50.0, 0.5)
    assert (own.bar_diameter_mm, own.bar_diameter_sigma_mm) == (7.0, 0.0)
    assert (default.bar_diameter_mm, default.bar_diameter_sigma_mm) == (6.4, 0.02)


def test_a_trial_without_manifest_takes_the_defaults(small_copy):
    (small_copy / "trials" / "b30_3" / "trial.toml").unlink()
    trial = load_session(small_copy).trial("b30_3")
    assert (trial.surface, trial.purpose, trial.speed_deg_s, trial.beta_deg) == (
        "",
        "measure",
        None,
        None,
    )


def sigma_keys() -> list[str]:
    return [
        "speed_sigma_deg_s = 0.1",
        "beta_sigma_deg = 0.5",
        "d_x_sigma_mm = 0.3",
        "bar_diameter_sigma_mm = 0.01",
        "follicle_roll_sigma_deg = 0.2",
        "force_sigma_N = 0.001",
        "at_sigma_mm = 0.1",
        "frame_rate_sigma_Hz = 0.01",
        "first_frame_sigma_s = 0.001",
    ]


@pytest.mark.parametrize("key", sigma_keys())
def test_any_measured_key_of_a_trial_takes_a_sigma(small_copy, key):
    add(small_copy / "trials" / "b30_3" / "trial.toml", f"\n{key}\n")
    assert isinstance(load_session(small_copy).trial("b30_3"), Trial)


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ("[whisker]", "length_sigma_mm = 0.1"),
        ("[whisker]", "diameter_sigma_mm = 0.01"),
        ("[whisker]", "youngs_modulus_sigma_GPa = 2.0"),
        ("[bar]", "diameter_sigma_mm = 0.01"),
        ("[board]", "square_sigma_mm = 0.01"),
        ("[board]", "marker_sigma_mm = 0.01"),
        ("[rig]", "T_rig_board_sigma_mm = 0.1"),
        ("[rig]", "T_rig_board_sigma_deg = 0.1"),
    ],
)
def test_any_measured_key_of_a_session_takes_a_sigma(small_copy, table, key):
    replace(small_copy / "session.toml", table, f"{table}\n{key}")
    load_session(small_copy)


def test_sigmas_arrive_in_the_units_of_the_code(small_copy):
    replace(small_copy / "session.toml", "[rig]", "[rig]\nT_rig_board_sigma_deg = 0.1")
    replace(small_copy / "session.toml", "[whisker]", "[whisker]\nyoungs_modulus_sigma_GPa = 3.0")
    session = load_session(small_copy)
    assert session.T_rig_board_sigma_rad == pytest.approx(np.radians(0.1))
    assert session.whisker.C_sigma_Nmm2 == pytest.approx(0.05 * session.whisker.C_Nmm2)


def test_uncertain_diameter_counts_fourfold():
    whisker = Whisker(
        shape="cylinder",
        length_mm=100.0,
        diameter_mm=1.0,
        youngs_modulus_GPa=60.0,
        diameter_sigma_mm=0.01,
    )
    assert whisker.C_sigma_Nmm2 == pytest.approx(0.04 * whisker.C_Nmm2)


def test_gauges_of_the_session(small_copy):
    text = "\n[gauges]\noffset_V = [0.1, -0.2]\nmatrix_Nmm_per_V = [[10.0, 0.1], [0.2, 11.0]]\n"
    add(small_copy / "session.toml", text + "offset_sigma_V = [0.01, 0.01]\n")
    gauges = load_session(small_copy).gauges
    np.testing.assert_array_equal(gauges.matrix_Nmm_per_V, [[10.0, 0.1], [0.2, 11.0]])
    np.testing.assert_array_equal(gauges.offset_sigma_V, [0.01, 0.01])
    np.testing.assert_array_equal(gauges.matrix_sigma_Nmm_per_V, np.zeros((2, 2)))


def test_written_rotation_is_made_exact(small_session):
    rotation = load_session(small_session).T_rig_board[:, :3]
    np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-14)


def test_a_session_of_board_views_alone(small_copy):
    shutil.rmtree(small_copy / "trials")
    session = load_session(small_copy)
    assert (session.trials, session.camera_names) == ((), ("high", "low"))


def test_a_trial_that_is_not_there(small_session):
    with pytest.raises(BadInput, match=r"no trial 'b99'; there are b30_3, b60_4"):
        load_session(small_session).trial("b99")


def test_real_board_videos_make_a_session(real, tmp_path):
    """The webcam recordings of `real/calibration/single`, wrapped as a session of boards alone."""
    (tmp_path / "boards").mkdir()
    for camera in ("cam_0", "cam_2"):
        shutil.copyfile(
            real / "calibration" / "single" / f"{camera}.mp4", tmp_path / "boards" / f"{camera}.mp4"
        )
    (tmp_path / "session.toml").write_text(
        "format = 1\n[board]\nsquares = [4, 5]\nsquare_mm = 54.0\nmarker_mm = 40.5\n"
        'dictionary = "DICT_4X4_50"\ninverted = true\n'
    )
    session = load_session(tmp_path)
    assert {name: path.name for name, path in session.board_sources.items()} == {
        "cam_0": "cam_0.mp4",
        "cam_2": "cam_2.mp4",
    }
    assert session.board.inverted


@pytest.mark.parametrize(("kind", "keys"), [(Trial, TrialKeys), (Whisker, WhiskerKeys)])
def test_what_a_table_states_is_declared_by_its_keys_alone(kind, keys):
    assert issubclass(kind, keys)
    assert not set(key_names(keys)) & set(kind.__annotations__)
