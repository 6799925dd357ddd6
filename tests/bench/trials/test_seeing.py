"""Settings of seeing: presets, files, and that what they say reaches the pictures."""

from dataclasses import replace

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.trials.seeing import PRESETS, as_toml, by_preset, from_file
from bench.trials.seen import _refine
from vision.truth.records import TrialTruth, WhiskTruth
from vision.truth.value import Value


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_written_is_read_again(name, tmp_path):
    asked = replace(by_preset(name), cameras=("high", "low"))
    again = from_file(written(tmp_path, as_toml(asked)))
    assert (again.vision, again.cameras) == (asked.vision, asked.cameras)


def test_what_a_file_leaves_out_goes_by_its_preset(tmp_path):
    found = from_file(written(tmp_path, '[seeing]\npreset = "draft"\nwire_piece_px = 20\n'))
    assert found.vision == replace(PRESETS["draft"], wire_piece_px=20)
    assert found.name == "mine.toml"
    assert from_file(written(tmp_path, "")).vision == PRESETS["standard"]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "[seeing]\nround = 2\n",
            r"mine.toml: \[seeing\] round is not a key of this file; did you mean 'rounds'\?",
        ),
        ("[seeing]\nrounds = -1\n", r"rounds is -1; from 0 to 5 is allowed"),
        ("[seeing]\nevery_frame = 1.5\n", r"expected .*whole number.*, found a number"),
        ('[seeing]\npreset = "best"\n', r"--preset best: there are draft, standard"),
    ],
)
def test_a_wrong_file_is_named(text, line, tmp_path):
    with pytest.raises(BadInput, match=line):
        from_file(written(tmp_path, text))


def test_other_settings_are_another_result():
    seen = [Settings(seeing=by_preset(name)).seen() for name in PRESETS]
    assert len({str(one) for one in seen}) == len(PRESETS)
    assert Settings(trials="a*", figures=False).estimated() == Settings().estimated()


def test_trials_are_taken_by_pattern():
    assert [Settings(trials="b3*").takes(name) for name in ("b30_3", "b60_4")] == [True, False]


def test_a_whisk_climbs_until_it_is_known_well_enough():
    """Sigmas of 0.03, 0.09 and none, asked for 0.05: two climb, of which the last comes to nothing and stays."""

    def whisk(number, d_x_mm, sigma_mm):
        return WhiskTruth(number, None, d_x_mm=Value(d_x_mm, sigma_mm))

    asked = []

    def observe(whisks, settings):
        asked.extend(whisks)
        return TrialTruth(np.zeros(3), np.ones(3), (whisk(0, 50.1, 0.04), whisk(1, np.nan, np.nan)))

    first = [
        ("draft", whisk(0, 50.0, 0.03)),
        ("draft", whisk(1, 50.0, 0.09)),
        ("draft", whisk(2, np.nan, np.nan)),
    ]
    places = [slice(0, 9), slice(10, 19), slice(20, 29)]
    looked = _refine(observe, places, first, by_preset("standard"), 0.05)
    assert asked == places[1:]
    found = [(name, one.whisk, one.d_x_mm.value) for name, one in looked[:2]]
    assert found == [("draft", 0, 50.0), ("standard", 1, 50.1)]
    assert looked[2] == first[2]


def test_an_accuracy_is_a_length():
    with pytest.raises(BadInput, match="--accuracy-mm 0: must be above 0"):
        Settings(accuracy_mm=0.0)
