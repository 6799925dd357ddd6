"""Settings of seeing: presets, files, and that what they say reaches the pictures."""

from dataclasses import replace

import pytest

from bench.base.errors import BadInput
from bench.base.settings import Settings
from bench.trials.seeing import PRESETS, as_toml, by_preset, from_file


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
        ("[seeing]\nround = 2\n", r"mine.toml: \[seeing\] round is not a key of this file; did you mean 'rounds'\?"),
        ("[seeing]\nrounds = -1\n", r"rounds is -1; from 0 to 5 is allowed"),
        ("[seeing]\nevery_frame = 1.5\n", r"expected .*whole number.*, found a number"),
        ('[seeing]\npreset = "best"\n', r"--preset best: there are draft, standard, fine"),
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
