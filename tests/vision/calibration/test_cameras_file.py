"""cameras.toml and cameras.npz: what is written is what is read, and what is spoilt is refused."""

import numpy as np
import pytest

from bench.cameras.cameras_toml import write_cameras
from vision.calibration.cameras_file import read_cameras
from vision.geometry.camera import Camera, Cameras
from vision.geometry.refusals import Refused


@pytest.fixture
def cameras():
    root = np.random.default_rng(3).standard_normal((30, 30))
    return Cameras(
        tuple(
            Camera(
                name,
                (1280, 720),
                [[2010.0 + i, 0, 644.5], [0, 2012.4, 359.5], [0, 0, 1]],
                [-0.11, 0.14, 6e-4, -4e-4, 1 / 3],
                np.column_stack([np.eye(3), [1 / 3, 4.5, 375.9]]),
                0.05,
            )
            for i, name in enumerate(["high", "low"])
        ),
        root @ root.T,
    )


def test_read_is_what_was_written(tmp_path, cameras):
    write_cameras(tmp_path / "cameras.toml", cameras)
    back = read_cameras(tmp_path / "cameras.toml")
    assert back.names == cameras.names
    np.testing.assert_array_equal(back.covariance, cameras.covariance)
    for a, b in zip(back, cameras):
        np.testing.assert_array_equal(a.matrix, b.matrix)
        np.testing.assert_array_equal(a.distortion, b.distortion)
        np.testing.assert_allclose(a.T_camera_rig, b.T_camera_rig, atol=1e-15)
        assert (a.size_px, a.rms_px) == (b.size_px, b.rms_px)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cameras.npz", "cameras.toml"]


def test_without_covariance_cameras_are_taken_as_exact(tmp_path, cameras):
    path = tmp_path / "cameras.toml"
    write_cameras(path, cameras)
    path.write_text(
        "\n".join(line for line in path.read_text().splitlines() if "covariance" not in line)
    )
    assert not read_cameras(path).covariance.any()


@pytest.mark.parametrize(
    "spoil, words",
    [
        (lambda f: (f / "cameras.npz").unlink(), "no such file"),
        (lambda f: (f / "cameras.npz").write_bytes(b"other"), "copy both"),
        (lambda f: _replace(f, "rms_px", "rms"), "rms_px missing"),
        (lambda f: _replace(f, "2010.0", '"wide"'), "cameras.high"),
        (lambda f: _replace(f, "2010.0", "1" + 400 * "0"), "cameras.high: int too large"),
        (lambda f: _replace(f, "[cameras", "[["), "is not TOML"),
        (lambda f: _replace(f, "1280", "inf"), "size_px = .*, must be two counts above 0"),
        (lambda f: _replace(f, "1280", "1280.5"), "size_px = .*, must be two counts above 0"),
        (lambda f: _replace(f, "cameras.", "lens."), "no .cameras"),
    ],
)
def test_spoilt_files_are_refused(tmp_path, cameras, spoil, words):
    write_cameras(tmp_path / "cameras.toml", cameras)
    spoil(tmp_path)
    with pytest.raises(Refused, match=words):
        read_cameras(tmp_path / "cameras.toml")


def _replace(folder, old, new):
    path = folder / "cameras.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
