"""Figures 5 and 6: the data beside the picture, with the points that the paper's text reads off them."""

import csv

import numpy as np
import pytest

from bench.theory.slope_limits import PRINTED_POINTS, figure_5, figure_6, write_figure


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("figures")
    return {number: write_figure(number, folder) for number in (5, 6)}


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("number", [5, 6])
def test_three_files_are_written_and_nothing_else(written, number):
    paths = written[number]
    assert [path.name for path in paths] == [f"figure_{number}.{s}" for s in ("png", "svg", "csv")]
    assert all(path.stat().st_size > 5000 for path in paths)
    assert paths[0].read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert not list(paths[0].parent.glob(".*"))


def test_the_same_figure_gives_the_same_bytes(written, tmp_path):
    again = write_figure(5, tmp_path)
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in written[5]]


def test_csv_of_figure_5_holds_the_printed_point_at_60_degrees(written):
    """Section IV-A: α_est = 10°, accurate to 5 % for 8.2° … 11.7° and β ≤ 60°. The reading is good to 0.1° of α, hence
    1° of β."""
    alpha, beta = np.array(
        [
            (float(row["alpha_deg"]), float(row["beta_thresh_deg"] or "nan"))
            for row in rows(written[5][2])
            if (row["panel"], row["error_percent"], row["equation"]) == ("b", "5.0", "(10)")
        ]
    ).T
    assert np.interp(8.2, alpha, beta) == pytest.approx(60, abs=1)


def test_threshold_that_is_never_reached_is_an_empty_cell(written):
    """With α = α_est (10) is exact on a flat surface, whatever its slope."""
    right = [
        r
        for r in rows(written[5][2])
        if r["equation"] == "(10)" and r["alpha_est_deg"] == r["alpha_deg"] + ".0"
    ]
    assert len(right) == 9
    assert all(row["beta_thresh_deg"] == "" for row in right)


@pytest.mark.parametrize("number, curves", [(5, figure_5), (6, figure_6)])
def test_curves_pass_through_the_printed_points(number, curves):
    """The text gives whole degrees of β and reads α off the plot to 0.2°; the curves fall by up to 13° a degree."""
    drawn = list(curves())
    for panel, points in PRINTED_POINTS[number].items():
        for x, beta in points:
            near = [
                abs(np.interp(x, c.x, c.beta_thresh_deg) - beta)
                for c in drawn
                if c.panel == panel
                and c.form != "exact"
                and np.isfinite(np.interp(x, c.x, c.beta_thresh_deg))
            ]
            assert min(near) <= 0.2 * 13, (panel, x, beta)


def test_flatter_surfaces_and_smaller_angles_allow_steeper_slopes():
    """Section IV-B: β_thresh always increases with r_n and with the error allowed, and falls with θ."""
    curves = {(c.form, *c.parameters.values()): c.beta_thresh_deg for c in figure_6()}
    for beta in curves.values():
        assert (np.diff(beta) > 0).all()
    for form in ("printed", "exact"):
        assert (curves[form, form, 5.0, 1.0, 0.0] > curves[form, form, 5.0, 3.0, 0.0]).all()
        assert (curves[form, form, 10.0, 3.0, 0.0] > curves[form, form, 5.0, 3.0, 0.0]).all()


def test_another_number_is_refused(tmp_path):
    with pytest.raises(ValueError, match="figures from the equations are 5 and 6"):
        write_figure(7, tmp_path)
    assert not list(tmp_path.iterdir())
