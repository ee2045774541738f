"""tisim optimize granular_bench --variant calibrate --measured FILE.csv, for a small silo and few designs."""

import csv

import pytest

from tisim.cases.case import Size
from tisim.cases.granular_bench import scene as draw_down

SMALL = {"number": 250, "silo": 4.0, "outlet": 5.0, "disc": 5.0, "drop": 3.0, "duration": 0.6}
SEARCH = [
    "optimize", "granular_bench", "--variant", "calibrate", "--measured", "mine.csv", "--out", "found",
    "--method", "zohdi", "--generations", "1", "--population", "4", "--set", "search.options.parents=2",
]  # fmt: skip


def table(path):
    """Rows of a CSV file by their first cell."""
    return {name: value for name, value, *_ in csv.reader(path.read_text().splitlines())}


@pytest.mark.slow
def test_calibration_to_a_file_of_measurements(tisim, tmp_path, monkeypatch):
    """The misfit of the best design follows from its run, and the values and uncertainties in the file. A
    file with other values does not continue this search."""
    one_start = {"min_starts": 1, "block": 1, "max_starts": 1, "select": 0, "confirm": 0}
    settings = {**draw_down.SEARCH_SETTINGS, "ensemble": one_start}
    monkeypatch.setitem(draw_down.SIZES, "default", Size("a small draw-down test", SMALL, settings))
    mine = tmp_path / "mine.csv"
    mine.write_text(
        "quantity,value,uncertainty\ndischarge_rate,0.0815,0.0125\nangle_of_repose,19.25,2.5\n"
        "rebound_ratio,0.3,0.05\n"
    )
    code, out, err = tisim(*SEARCH)
    assert code == 0, err
    for text in ("0.0815 ± 0.0125 kg/s", "19.25 ± 2.5 degrees", "rebound_ratio 0.3 ± 0.05"):
        assert text in " ".join((out + err).split())
    run = table(tmp_path / "found/best_run.csv")
    assert float(run["discharge_rate as measured, kg/s"]) == 0.0815
    assert float(run["angle_of_repose as measured, degrees"]) == 19.25
    off = [
        (float(run["discharge_rate, kg/s"]) - 0.0815) / 0.0125,
        (float(run["angle_of_repose, degrees"]) - 19.25) / 2.5,
        (float(run["rebound_ratio"]) - 0.3) / 0.05,
    ]
    heading, best, *_ = csv.reader((tmp_path / "found/best.csv").read_text().splitlines())
    best = dict(zip(heading, best, strict=True))
    misfit = sum(one**2 for one in off) / len(off)
    assert float(best["misfit"]) == pytest.approx(misfit, rel=1e-3)
    # The grain that bounces on the plate determines the restitution.
    assert float(run["rebound_ratio"]) ** 0.5 == pytest.approx(float(best["restitution"]), abs=0.01)
    met = (tmp_path / "found/met.csv").read_text().splitlines()
    assert met[0] == "friction,rolling_friction,restitution,misfit"
    assert (len(met) > 1) == (misfit <= 1)
    assert "designs have misfit of at most 1" in " ".join(out.split())
    # A quadratic form of three genes has ten coefficients; a search of so few designs does not determine
    # them.
    assert "more are needed" in " ".join(out.split())
    assert (tmp_path / "found/calibration.csv").read_text().startswith("gene,unit,estimate,95 % low")
    for name, low, high in (("friction", 0.05, 1), ("rolling_friction", 0, 0.4), ("restitution", 0.2, 0.9)):
        assert low <= float(best[name]) <= high
    # The designs found for these measurements are not reported for others.
    mine.write_text("quantity,value,uncertainty\ndischarge_rate,0.05,0.0125\n")
    code, _, err = tisim(*SEARCH)
    assert code == 2
    assert "output folder must be free of a search of another problem" in " ".join(err.split())
