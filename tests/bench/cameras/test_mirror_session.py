"""The worked examples of one camera and a mirror, and of a plain checkerboard, from their pictures."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.cameras.board_views import read_board_views
from bench.cameras.calibrate_session import calibrate_from
from bench.session.session import load_session

BRING = Path(__file__).resolve().parents[3] / "fixtures" / "bring"
EXAMPLE = BRING / "mirror"
RIG_POINTS = np.array([[x, 0.0, z] for x in (20.0, 50.0, 80.0) for z in (-15.0, 0.0, 15.0)])


@pytest.mark.parametrize("example", ["mirror", "boards"])
def test_both_views_are_placed_as_the_rig_has_them(example):
    session = load_session(BRING / example)
    made = calibrate_from(session, read_board_views(session)).cameras
    truth = json.loads((BRING / example / "truth.json").read_text())["cameras"]
    assert set(made.names) == set(truth) and len(made) == 2
    for camera in made:
        true = truth[camera.name]
        assert camera.size_px == (true["width"], true["height"])
        T = np.column_stack([true["R"], true["t"]])
        exact = type(camera)(camera.name, camera.size_px, true["K"], true["dist"], T)
        px, _, J = camera.project_with_jacobians(RIG_POINTS)
        own = made.parameters_of(camera.name)
        sigma = np.sqrt(np.einsum("nij,jk,nik->ni", J, made.covariance[own, own], J))
        # 36 numbers, of which a dozen are independent: one in 10 000 such sets has one beyond 4.4 sigma.
        assert np.abs((px - exact.project(RIG_POINTS)) / sigma).max() < 4.4
        assert np.median(sigma) < 0.1


@pytest.mark.parametrize(("stated", "meant"), [("true", "false"), ("false", "true")])
def test_mirrored_the_wrong_way_is_named(tmp_path, stated, meant):
    """A mirror that is not stated, and a direct view that is stated as one."""
    shutil.copytree(EXAMPLE, tmp_path / "mirror")
    file = tmp_path / "mirror" / "session.toml"
    text = file.read_text()
    in_mirror = {"crop = [0, 0, 362, 278]": stated, "crop = [0, 278, 362, 300]": "true"}
    parts = in_mirror if stated == "false" else dict(reversed(in_mirror.items()))
    cameras = ""
    for number, (crop, mirrored) in enumerate(parts.items()):
        name = f"part{number}"
        cameras += f'[[cameras]]\nname = "{name}"\nof = "high"\n{crop}\nmirrored = {mirrored}\n'
    first, last = text.index("[[cameras]]"), text.index("[trial]")
    file.write_text(text[:first] + cameras + text[last:])
    with pytest.raises(BadInput) as refused:
        read_board_views(load_session(tmp_path / "mirror"))
    assert f"set mirrored = {meant} under [[cameras]]" in str(refused.value)
    assert "camera part0" in str(refused.value) and "\n" not in str(refused.value)
