"""How often the bar's lines are looked at: once roughly and once finely, whatever the preset."""

from types import SimpleNamespace

import pytest

from vision.geometry.vision_settings import VisionSettings
from vision.truth import strategies


@pytest.mark.parametrize("rounds", [0, 1, 2, 3])
def test_the_last_look_is_a_fine_one_and_the_only_one(rounds, monkeypatch):
    looks = []

    def measured(*given):
        looks.append("finely" if given[-1] else "roughly")
        return {"high": SimpleNamespace(points=looks[-1], is_bar=True)}

    monkeypatch.setattr(strategies, "measure_bars", measured)
    bar = strategies.BarMiddles((), 3.0, VisionSettings(rounds=rounds))
    for _ in range(rounds):
        bar.points(None, {}, last=False)
    assert bar.points(None, {}, last=True) == {"high": {0: "finely"}}
    assert looks == ["roughly", "finely"]
