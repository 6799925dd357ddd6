"""`figures 8`: evaluated runs are read back and pooled; what cannot be pooled is refused in one line."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from bench.base.errors import BadInput
from bench.base.results import plain, write_result
from bench.commands import cli
from bench.records.plain import from_plain
from bench.records.trial_result import TrialResult
from bench.report.pooled import pooled
from bench.report.whisk_rows import write_tables
from estimator import slip

EI = 2945.2
WHISKER = {"shape": "cylinder", "length_mm": 100.0, "diameter_mm": 1.0, "EI_Nmm2": EI}
THETA_DEG = 3.0


def whisk(beta_deg, alpha_deg, d_x_mm, number) -> dict:
    """What was felt of one whisk, as (13), (14) have it."""
    theta, beta, alpha = np.radians([THETA_DEG, beta_deg, alpha_deg])
    m_y, m_z = slip.moments(d_x_mm, theta, beta, alpha, 3.0 * EI)
    moments = {"m_y_Nmm": m_y, "m_z_Nmm": m_z, "m_y_sigma_Nmm": 0.02, "m_z_sigma_Nmm": 0.02}
    angle = {"phi_felt_rad": float(np.arctan2(m_y, m_z)), "phi_felt_sigma_rad": 0.002}
    return {"whisk": number, "status": "", "estimates": [], "one_factor": [], **moments, **angle}


@pytest.fixture
def run(tmp_path):
    """A function that writes an evaluated run without pictures, a trial a slope, as `evaluate` leaves it."""

    def write(
        name, *, alphas=(10.0,), d_x_mm=60.0, slopes=(0, 30, 60), whisker=None, theta_deg=THETA_DEG
    ) -> Path:
        out, results = tmp_path / name, []
        for beta in slopes:
            trial = {
                "name": f"b{beta}",
                "purpose": "measure",
                "surface": "steel",
                "speed_deg_s": 10.0,
            }
            trial |= {"d_x_nominal_mm": d_x_mm, "beta_nominal_deg": float(beta)}
            trial["beta_nominal_sigma_rad"] = np.radians(3.0)
            codes = [["no_pictures", "no pictures"]]
            seen = {"status": "no pictures", "status_codes": codes}
            result = {
                "hash": f"{name}{beta}",
                "trial": trial,
                "whisker": whisker or WHISKER,
                "theta_deg": theta_deg,
                "seen": {"whisks": [{"truth": {"whisk": k}} | seen for k in range(len(alphas))]},
                "felt": {
                    "whisks": [whisk(beta, alpha, d_x_mm, k) for k, alpha in enumerate(alphas)]
                },
            }
            write_result(out / "trials" / f"b{beta}.json", result)
            results.append(result)
        write_tables(out, [from_plain(TrialResult, plain(result)) for result in results])
        return out

    return write


def test_two_days_are_fitted_as_one(run):
    """α of days at 9° and 11° lies between them, near the middle, over the whisks of both."""
    (surface,) = pooled([run("monday", alphas=(9.0, 9.0)), run("tuesday", alphas=(11.0, 11.0))])
    assert [p.whisks for p in surface.points()] == [4, 4, 4]
    assert np.degrees(surface.alpha_rad) == pytest.approx(10.0, abs=0.05)


def test_days_at_distances_that_a_ruler_leaves_are_scaled_to_one(run):
    """|m| goes as 1/d_x: whisks at 58 and 62 mm make points without scatter, and the fit is exact."""
    (surface,) = pooled([run("monday", d_x_mm=58.0), run("tuesday", d_x_mm=62.0)])
    assert np.degrees(surface.alpha_rad) == pytest.approx(10.0, abs=1e-6)
    assert max(p.m_sd_Nmm for p in surface.points()) == pytest.approx(0.0, abs=1e-9)


def test_figure_table_and_friction_angle_are_written(run, tmp_path, capsys):
    outs = [str(run(name, alphas=(10.0, 10.0))) for name in ("monday", "tuesday")]
    assert cli.main(["figures", "8", *outs, "--out", str(tmp_path / "figures")]) == 0
    assert "steel, 10°/s: α = 10.00" in capsys.readouterr().out
    assert sorted(p.name for p in (tmp_path / "figures").iterdir()) == [
        f"figure_8.{s}" for s in ("csv", "png", "svg")
    ]
    with (tmp_path / "figures" / "figure_8.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert [(float(r["beta_deg"]), r["whisks"]) for r in table] == [
        (0.0, "4"),
        (30.0, "4"),
        (60.0, "4"),
    ]
    for row in table:  # points made by (13), (14) lie on the fitted curve
        assert float(row["m_EI_per_metre"]) == pytest.approx(
            float(row["m_fit_EI_per_metre"]), rel=1e-6
        )
        assert float(row["phi_deg"]) == pytest.approx(float(row["phi_fit_deg"]), abs=1e-5)
    # at β = 0 the small-angle moment is 3 θ/d_x EI, whatever α
    assert float(table[0]["m_EI_per_metre"]) == pytest.approx(
        3 * np.radians(THETA_DEG) / 0.060, rel=1e-6
    )


def test_the_same_runs_give_the_same_bytes(run, tmp_path):
    out = str(run("monday"))
    for name in ("a", "b"):
        cli.main(["figures", "8", out, "--out", str(tmp_path / name)])
    for file in (tmp_path / "a").iterdir():
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


@pytest.mark.parametrize(
    "other, complaint",
    [
        (
            {"whisker": WHISKER | {"EI_Nmm2": 3100.0}},
            "another whisker: EI_Nmm2 is 3100, in .* 2945.2",
        ),
        ({"whisker": WHISKER | {"shape": "cone"}}, "another whisker: shape is cone"),
        ({"d_x_mm": 70.0}, "steel, 10°/s: d_x is 70.0 mm, in .* 60.0 mm"),
        ({"theta_deg": 5.0}, "evaluated at θ = 5°, .* at 3°"),
    ],
)
def test_runs_that_are_not_alike_are_refused(run, tmp_path, capsys, other, complaint):
    outs = [str(run("monday")), str(run("tuesday", **other))]
    assert cli.main(["figures", "8", *outs, "--out", str(tmp_path / "figures")]) == 2
    with pytest.raises(BadInput, match=complaint):
        pooled([Path(out) for out in outs])
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "figures").exists()


def test_one_run_is_not_counted_twice(run):
    out = run("monday")
    with pytest.raises(BadInput, match="give each run once"):
        pooled([out, out])


def test_what_is_no_evaluated_run_is_refused(run, tmp_path, small_session):
    for folder in (tmp_path / "nowhere", small_session):
        with pytest.raises(BadInput, match="is no evaluated run"):
            pooled([folder])
    garbled, damaged, old = run("garbled"), run("damaged"), run("old")
    (garbled / "whisks.csv").write_bytes(b"trial,whisk\n\xff\xfe")
    with pytest.raises(BadInput, match=r"whisks.csv: is damaged"):
        pooled([garbled])
    (damaged / "trials" / "b30.json").write_text("{")
    with pytest.raises(
        BadInput, match=r"b30.json is not there or damaged; evaluate the session again"
    ):
        pooled([damaged])
    result = json.loads((old / "trials" / "b60.json").read_text())
    del result["whisker"]
    write_result(old / "trials" / "b60.json", result)
    with pytest.raises(BadInput, match=r"b60.json is of an older version"):
        pooled([old])


def test_results_of_a_later_run_that_was_stopped_are_not_mixed_with_these(run):
    out = run("monday")
    (out / "run.json").write_text(
        json.dumps({"results": {"b0": "monday0", "b30": "monday30", "b60": "before60"}})
    )
    with pytest.raises(
        BadInput, match=r"trials/b60.json is of a later run, which was not finished; evaluate"
    ):
        pooled([out])


def test_results_that_the_tables_do_not_name_are_left_out(run):
    """A trial that was taken out of the session leaves its result behind."""
    out = run("monday")
    write_result(out / "trials" / "b75.json", {"hash": "left over"})
    assert len(pooled([out])[0].felt) == 3


def test_no_whisk_with_slope_and_distance_is_refused(run):
    with pytest.raises(BadInput, match="no whisk has moments with a slope and a distance"):
        pooled([without_distances(run("monday"))])


def without_distances(out: Path) -> Path:
    """The run with its nominal distances taken away."""
    for path in (out / "trials").iterdir():
        result = json.loads(path.read_text())
        result["trial"]["d_x_nominal_mm"] = None
        write_result(path, result)
    return out
