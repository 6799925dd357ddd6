"""What whisks tell together, on the page: a table where there are rows, nothing where there are none."""

import pytest

from bench.analyses.friction_tables import SURFACES
from bench.analyses.soft import COMPLIANCE
from bench.analyses.table_i_sensors import SENSORS
from bench.analyses.tilted import TILTS
from bench.base.errors import BadInput
from bench.report.page.write import page_tables

SURFACE = {"surface": "paint", "speed_deg_s": 10.0, "whisks": 3}
TILT = {
    "beta_from_deg": 0.0,
    "beta_to_deg": 60.0,
    "d_x_mm": 54.987,
    "d_x_sigma_mm": 0.564,
    "d_x_low_mm": 53.88,
}
TILT |= {"d_x_high_mm": 56.09, "alpha_deg": 14.06, "alpha_sigma_deg": 1.3}
SOFT = {
    "whisks_near": 2,
    "whisks_far": 4,
    "near_nominal_mm": 50.0,
    "far_nominal_mm": 70.0,
    "d_x_mm": 49.0,
}
SOFT |= {"d_x_sigma_mm": 0.29, "give_mm_N": 0.134, "give_sigma_mm_N": 0.061}
SENSOR = {"beta_from_deg": 7.5, "beta_to_deg": 22.5, "alpha_deg": 16.7, "whisks": 3, "none": 0}


def write(out, table, *rows):
    table.write(out, [SURFACE | row for row in rows])


def test_a_folder_that_has_no_rows_has_no_tables(tmp_path):
    assert page_tables(tmp_path) == []
    write(tmp_path, TILTS)
    write(tmp_path, SENSORS)
    write(tmp_path, SURFACES, {})  # a surface of which no way tells α
    assert page_tables(tmp_path) == []


def test_friction_has_a_column_for_each_way_that_says_something(tmp_path):
    known = {"alpha_seen_deg": 16.71, "alpha_seen_sigma_deg": 0.12}
    write(
        tmp_path,
        SURFACES,
        known,
        {"surface": "felt", "speed_deg_s": None},
    )
    (told,) = page_tables(tmp_path)
    assert told.head == ("surface", "whisks", "seen [°]")
    assert told.rows == (("paint, 10°/s", "3", "16.71 ± 0.12"), ("felt", "3", "–"))


def test_slopes_together_stand_with_sigma_and_interval(tmp_path):
    write(tmp_path, TILTS, TILT)
    (told,) = page_tables(tmp_path)
    values = ("3", "0 to 60", "54.99 ± 0.56", "53.88 to 56.09", "14.1 ± 1.3", "–", "–")
    assert told.rows == (("paint, 10°/s", *values),) and len(told.head) == len(told.rows[0])


def test_an_object_is_soft_stiffer_than_or_not_told(tmp_path):
    ends = [
        {"stiffness_low_N_mm": 4.0, "stiffness_high_N_mm": 71.0},
        {"stiffness_low_N_mm": 4.0},
        {},
    ]
    write(tmp_path, COMPLIANCE, *(SOFT | end for end in ends))
    (told,) = page_tables(tmp_path)
    assert [row[5] for row in told.rows] == ["4 to 71", "more than 4", "–"]
    assert told.rows[0][1:5] == ("2 + 4", "50 to 70", "49.00 ± 0.29", "0.134 ± 0.061")


def test_sensors_stand_side_by_side_by_surface_and_slope(tmp_path):
    known = SENSOR | {"error_rms_percent": 4.04, "error_sigma_percent": 2.3}
    rows = [
        {"estimator": "with_friction"} | known,
        {"estimator": "touch_alone"} | SENSOR | {"whisks": 0, "none": 3},
    ]
    steeper = {"beta_from_deg": 22.5, "beta_to_deg": 37.5, "whisks": 2, "none": 1}
    rows += [{"estimator": "with_friction"} | known | steeper]
    write(tmp_path, SENSORS, *rows)
    (told,) = page_tables(tmp_path)
    assert told.head[3:] == ("whisks", "(10) with friction [%]", "touch alone [%]")
    assert told.rows[0] == ("paint", "7.5 to 22.5", "16.7", "3", "4.0 ± 2.3", "–")
    assert told.rows[1] == ("paint", "22.5 to 37.5", "16.7", "3", "4.0 ± 2.3 (2 whisks)", "–")


def test_a_damaged_table_is_one_line(tmp_path):
    (tmp_path / "tilts.csv").write_text("surface,whisks\npaint,three\n")
    with pytest.raises(BadInput, match=r"tilts\.csv"):
        page_tables(tmp_path)
