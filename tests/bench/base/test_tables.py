"""Tables as other programs open them: plain bytes, numbers as such, missing as nothing."""

import math

import numpy as np

from bench.base.tables import TRIAL, WHISK, Column, Table, status

TABLE = Table("t", "", (TRIAL, WHISK, Column("d_x_mm", "distance"), status("sentence")))
ROWS = [
    {
        "trial": "Prüfung",
        "whisk": 0,
        "d_x_mm": 60.25,
        "status": "χ² 79, β = 30° ± 0.2°; α − φ ≥ 0 …",
    },
    {"trial": "b", "whisk": 1, "d_x_mm": math.nan, "status": ""},
]


def test_bytes_of_a_table(tmp_path):
    TABLE.write(tmp_path, ROWS)
    assert (tmp_path / "t.csv").read_bytes().decode("utf-8") == (
        "trial,whisk,d_x_mm,status\n"
        'Prüfung,0,60.25,"chi2 79, beta = 30 deg +- 0.2 deg; alpha - phi >= 0 ..."\n'
        "b,1,,\n"
    )


def test_a_table_is_read_back_with_its_types(tmp_path):
    TABLE.write(tmp_path, ROWS)
    table = TABLE.read(tmp_path)
    assert [table.dtype[name].kind for name in table.dtype.names] == ["U", "i", "f", "U"]
    assert table["trial"].tolist() == ["Prüfung", "b"]
    np.testing.assert_array_equal(table["d_x_mm"], [60.25, math.nan])


def test_what_a_run_says_is_ascii(exact_run):
    """Names are the user's; all else that stands in its tables is plain."""
    for path in exact_run.rglob("*.csv"):
        path.read_bytes().decode("ascii")
