"""What the README, the how-tos and the list of verbs show, works."""

import re
from pathlib import Path

import numpy as np
import pytest

from bench.commands import cli
from estimator.beam import Beam
from estimator.slip import moments
from estimator.whisk import EstimatorSettings, Whisk

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
HOW_TOS = (ROOT / "docs" / "howto.md").read_text()
VERBS_PAGE = (ROOT / "docs" / "reference-verbs.md").read_text()
D_X_MM, BETA_RAD, C_NMM2, NOISE_NMM = 60.0, np.radians(30.0), 8835.7, 0.02


def frictionless_whisk() -> Whisk:
    """A whisk of a second to 3° after touch, by equations (13) and (14) with α = 0, with white noise."""
    theta = np.linspace(np.radians(-1.0), np.radians(3.5), 2000)
    noise = NOISE_NMM * np.random.default_rng(1).standard_normal((2, len(theta)))
    m_y, m_z = (
        np.where(theta > 0, moments(D_X_MM, np.maximum(theta, 1e-9), BETA_RAD, 0.0, C_NMM2), 0.0)
        + noise
    )
    at_rad = np.radians(3.0)
    at = moments(D_X_MM, at_rad, BETA_RAD, 0.0, C_NMM2)
    return Whisk(
        theta / 0.17,
        theta,
        m_y,
        m_z,
        at_rad,
        *at,
        np.eye(2) * NOISE_NMM**2,
        0.0,
        Beam(C_NMM2, 100.0),
    )


def test_the_estimator_shown_finds_the_distance():
    (code,) = re.findall(r"```python\n(.*?)```", HOW_TOS, flags=re.DOTALL)
    names = {}
    exec(code, names)
    estimate = names["by_slope"](frictionless_whisk(), EstimatorSettings(np.radians(10.0)))
    # 850 samples of noise 0.02 over 2° fix the slope, 128 N·mm/rad, to 0.06: d_x to 0.03 mm; five times that
    assert abs(estimate.d_x_mm - D_X_MM) < 0.15
    assert 0.15 < estimate.sigma_mm < 0.5


VERBS = re.findall(r"^- `([a-z][a-z-]*(?: [a-z]+)?)", VERBS_PAGE, flags=re.MULTILINE)


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_shown_exists(verb):
    with pytest.raises(SystemExit) as done:
        cli.main([*verb.split(), "--help"])
    assert done.value.code == 0


def test_every_verb_is_shown():
    listed = re.findall(r"^    ([a-z][a-z-]*)", cli.make_parser().format_help(), flags=re.MULTILINE)
    assert {verb.split()[0] for verb in VERBS} == set(listed)


def test_every_file_named_is_there():
    for name in ("CITATION.cff", "constraints.txt", "fixtures/small-session"):
        assert name in README
        assert (ROOT / name).exists()
