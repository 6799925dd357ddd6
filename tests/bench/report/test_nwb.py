"""A run as NWB: valid, and what is read back is what the tables say."""

import sys
import warnings

import numpy as np
import pytest

from bench import api
from bench.base.errors import BadInput
from bench.commands import cli
from bench.report.nwb import check_nwb, write_nwb
from bench.report.record import SESSION
from bench.session.session import load_session
from bench.session.signals import read_signals


def test_a_run_is_read_back(exact_run, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    session, path = load_session((exact_run / SESSION).read_text().strip()), tmp_path / "run.nwb"
    write_nwb(path, exact_run, session.path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = pynwb.validate(path=str(path))
    assert not (found[0] if isinstance(found, tuple) else found)
    run, signals = api.read(exact_run), read_signals(session.trial("b60_4"))
    with pynwb.NWBHDF5IO(str(path), "r") as io:
        file = io.read()
        motor, gauges = file.acquisition["b60_4_motor"], file.acquisition["b60_4_gauges"]
        np.testing.assert_allclose(np.radians(motor.data[:]), signals.motor_rad, rtol=1e-12)
        np.testing.assert_array_equal(gauges.data[:], np.column_stack([signals.y, signals.z]))
        np.testing.assert_array_equal(gauges.timestamps[:], signals.time_s)
        tables = file.processing["whisker_bench"]
        for name, rows in (
            ("whisks", run.whisks),
            ("estimates", run.estimates),
            ("track_b60_4", run.track("b60_4")),
        ):
            assert tables[name].colnames == rows.dtype.names
            for column in rows.dtype.names:
                np.testing.assert_array_equal(tables[name][column].data[:], rows[column])


def test_what_is_missing_is_told_before_anything_is_evaluated(
    small_session, tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "pynwb", None)
    arguments = [
        "evaluate",
        str(small_session),
        "--out",
        str(tmp_path / "out"),
        "--nwb",
        str(tmp_path / "run.nwb"),
    ]
    assert cli.main(arguments) == 2
    assert "--nwb needs pynwb: pip install 'whisker-bench[nwb]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "said"), [("run.h5", "must end in .nwb"), ("session/run.nwb", "lies in the session")]
)
def test_another_name_or_place_is_refused(tmp_path, name, said):
    with pytest.raises(BadInput, match=said):
        check_nwb(tmp_path / name, tmp_path / "session")
