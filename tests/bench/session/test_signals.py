"""A trial's signals in the units of the code."""

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.session.session import load_session
from bench.session.signals import forward_strokes, read_signals


def read(session, name="b30_3"):
    return read_signals(load_session(session).trial(name))


def test_volts_and_degrees(small_session):
    signals = read(small_session)
    rows = np.loadtxt(small_session / "trials" / "b30_3" / "signals.csv", delimiter=",", skiprows=1)
    assert signals.kind == "V"
    np.testing.assert_array_equal(
        np.column_stack([signals.time_s, signals.y, signals.z]), rows[:, [0, 2, 3]]
    )
    np.testing.assert_allclose(np.degrees(signals.motor_rad), rows[:, 1], rtol=1e-14)
    assert signals.rate_Hz == pytest.approx(2000.0)
    assert (dict(signals.dropped), signals.warnings) == ({}, ())


def test_moments_in_place_of_volts(small_copy):
    file = small_copy / "trials" / "b30_3" / "signals.csv"
    file.write_text(file.read_text().replace("y_V,z_V", "m_y_Nmm,m_z_Nmm"))
    assert read(small_copy).kind == "Nmm"


def with_forces(session, columns="f_x_N,f_y_N,f_z_N", scale=1.0):
    """The trial's signals with three columns more: a thousandth of the row's number, twice and three times that."""
    file = session / "trials" / "b30_3" / "signals.csv"
    header, *rows = file.read_text().splitlines()
    cells = (",".join(f"{scale * k * n / 1000:.6f}" for k in (1, 2, 3)) for n in range(len(rows)))
    file.write_text(
        "\n".join([f"{header},{columns}", *(f"{row},{cell}" for row, cell in zip(rows, cells))])
        + "\n"
    )
    return session


def test_forces_of_a_load_cell(small_copy):
    assert read(small_copy).forces_N is None
    forces = read(with_forces(small_copy)).forces_N
    assert forces[100] == pytest.approx([0.1, 0.2, 0.3])


def test_two_forces_are_no_load_cell(small_copy):
    with pytest.raises(BadInput, match="column f_z_N is missing"):
        read(with_forces(small_copy, "f_x_N,f_y_N,f_q_N"))


def test_forces_in_millinewtons(small_copy):
    with pytest.raises(BadInput, match=r"the largest f_x_N is .*Is it in millinewtons\?"):
        read(with_forces(small_copy, scale=1000.0))


def test_columns_are_found_by_name(small_copy):
    plain = read(small_copy)
    file = small_copy / "trials" / "b30_3" / "signals.csv"
    rows = [line.split(",") for line in file.read_text().splitlines()[1:]]
    swapped = [[row[3], row[0], row[2], "7", row[1]] for row in rows]
    lines = [["z_V", "time_s", "y_V", "temperature_degC", "motor_deg"], *swapped]
    file.write_text("\n".join(",".join(line) for line in lines) + "\n")
    mixed = read(small_copy)
    np.testing.assert_array_equal(mixed.z, plain.z)
    np.testing.assert_array_equal(mixed.motor_rad, plain.motor_rad)


def test_motor_at_other_times(small_session):
    signals = read(small_session)
    at = signals.motor_at(np.array([-1.0, 0.00025, 99.0]))
    assert np.isnan(at[[0, 2]]).all()
    assert np.degrees(at[1]) == pytest.approx(0.7525)


def test_three_whisks_in_one_recording(small_copy):
    """The trial's stroke, three times, with back strokes and pauses between."""
    file = small_copy / "trials" / "b30_3" / "signals.csv"
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    cycle = np.concatenate(
        [rows, np.repeat(rows[-1:], 100, 0), rows[::-2], np.repeat(rows[:1], 100, 0)]
    )
    whole = np.tile(cycle, (3, 1))
    whole[:, 0] = np.arange(len(whole)) * 5e-4
    np.savetxt(
        file, whole, delimiter=",", header="time_s,motor_deg,y_V,z_V", comments="", fmt="%.6f"
    )
    strokes = forward_strokes(read(small_copy))
    assert [stroke.stop - stroke.start for stroke in strokes] == pytest.approx(
        [len(rows)] * 3, abs=4
    )
    assert [stroke.start for stroke in strokes] == pytest.approx(
        [k * len(cycle) for k in range(3)], abs=4
    )


def test_a_weight_trial_may_stand_still(small_copy):
    file = small_copy / "trials" / "b30_3" / "signals.csv"
    rows = np.loadtxt(file, delimiter=",", skiprows=1)
    rows[:, 1] = 0.0
    np.savetxt(file, rows, delimiter=",", header="time_s,motor_deg,y_V,z_V", comments="")
    manifest = file.with_name("trial.toml")
    manifest.write_text('purpose = "weight"\nforce_N = 0.05\nat_mm = 50.0\n')
    signals = read(small_copy)
    assert (signals.warnings, forward_strokes(signals)) == ((), ())
