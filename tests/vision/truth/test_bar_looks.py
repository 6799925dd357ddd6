"""How often the bar's lines are measured: once coarsely and once finely, whatever the preset."""

from types import SimpleNamespace

import pytest

from vision.truth import readers
from vision.truth.whisk_place import WhiskPlace


@pytest.mark.parametrize("rounds", [0, 1, 2, 3])
def test_the_last_measurement_is_a_fine_one_and_the_only_one(rounds, monkeypatch):
    measured = []

    def measure_bars(*given):
        measured.append("finely" if given[-1] else "coarsely")
        return {"high": SimpleNamespace(points=measured[-1], is_bar=True)}

    monkeypatch.setattr(readers, "measure_bars", measure_bars)
    reader = readers.BarMiddles(())
    place = WhiskPlace(None, {}, 0.0)
    for _ in range(rounds):
        reader.read(place, last=False)
    assert reader.read(place, last=True) == {"high": [readers.ReadLine("finely", 0)]}
    assert measured == ["coarsely", "finely"]
