"""Ask and tell: search methods for experiments that are done elsewhere."""

import math

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, bowl, fake_problem
from tisim import InputError, optimize
from tisim.optimize import AskTell, Choice, DesignConstraint, Gene, Genome, Objective, ResultConstraint
from tisim.optimize.ask_tell import SAME
from tisim.optimize.methods.base import every
from tisim.optimize.search import search
from tisim.optimize.settings import Settings

GENES = (Gene("x", "m", -1.0, 1.0), Gene("y", "m", 1e-3, 10.0, "log"))
METHODS = sorted(every())


def worth(design):
    return (design["x"] - 0.3) ** 2 + math.log10(design["y"]) ** 2


def going_on(campaign, generations, of=worth):
    for _ in range(generations):
        designs = campaign.ask()
        campaign.tell(designs, [of(design) for design in designs])
    return campaign


@pytest.mark.parametrize("method", METHODS)
def test_ask_gives_the_designs_of_a_search(method):
    """Without noise, a search with the same method, seed and options has the same designs."""
    problem = fake_problem(3)

    def quiet(design, seed=0):
        return bowl(design, 0, noise=0.0)

    evaluator = FakeEvaluator(quiet)
    once = {"min_starts": 1, "select": 0, "confirm": 0, "common_starts": True}
    outcome = search(
        problem, evaluator, FakeCache(), Settings(seed=3, method=method, generations=3, ensemble=once)
    )
    campaign = going_on(AskTell(problem, method=method, seed=3), 4, quiet)
    assert [*campaign.outcome.estimates] == [*outcome.estimates]
    assert campaign.best.genes == outcome.designs[0].genes
    values = [one.values["fitness"] for one in outcome.designs]
    assert [one.values["fitness"] for one in campaign.designs] == pytest.approx(values, rel=1e-12)


@pytest.mark.parametrize(
    "method",
    [
        name if name in ("genetic", "zohdi") else pytest.param(name, marks=pytest.mark.slow)
        for name in METHODS
    ],
)
def test_a_campaign_continues_from_its_file(tmp_path, method):
    """A new object after every answer continues, in another order, with designs that were not asked for."""

    def step(campaign, number):
        asked = campaign.ask()
        assert asked == campaign.ask()
        picked = asked[number % len(asked)]
        campaign.tell(picked, worth(picked))
        if number % 5 == 2:
            own = {"x": 0.02 * number - 1, "y": 0.5}
            campaign.tell(own, worth(own), 0.01)

    few = {"first": 6, "population": 4} if method in ("genetic", "gaussian-process") else {"population": 6}
    settings = {"method": method, "seed": 2, "options": few}
    whole = AskTell(GENES, **settings)
    for number in range(20):
        step(whole, number)
        step(AskTell(GENES, **settings, file=tmp_path / "c.csv"), number)
    again = AskTell(GENES, **settings, file=tmp_path / "c.csv")
    assert again.ask() == whole.ask()
    assert again.designs == whole.designs
    assert len(again.outcome.estimates) == len(whole.outcome.estimates) == 20 + 4


def test_the_best_is_found_and_given_in_units():
    campaign = going_on(AskTell(GENES, {"gain": "largest"}, seed=1), 5, lambda design: 3 - worth(design))
    assert campaign.best.values["gain"] > 2.999
    assert abs(campaign.best.genes["x"] - 0.3) < 0.03
    assert campaign.best == campaign.designs[0]
    assert campaign.best.intervals == {"gain": None}
    assert len(optimize.sensitivity(campaign.outcome)) == 1


@pytest.mark.parametrize("method", [name for name in METHODS if every()[name].several])
def test_several_objectives_give_a_front(method):
    campaign = AskTell((Gene("x", "", -2, 3),), {"near": "smallest", "far": "largest"}, method=method)
    for number in range(4):
        designs = campaign.ask()
        values = [{"far": -((d["x"] - 1) ** 2), "near": d["x"] ** 2} for d in designs]
        campaign.tell(designs, values if number % 2 else [(v["near"], v["far"]) for v in values])
    front = campaign.designs
    assert len(front) > 3
    assert all(-0.1 < one.genes["x"] < 1.1 for one in front)
    assert campaign.best in front
    with pytest.raises(InputError, match=r"method must be for several objectives: .*; received 'zohdi'"):
        AskTell(GENES, ["a", "b"], method="zohdi")


def test_noise_is_given_or_estimated_from_repeats():
    campaign = AskTell(GENES, method="gaussian-process")
    assert campaign.best is None
    design, other = {"x": 0.1, "y": 1.0}, {"x": 0.2, "y": 1.0}
    campaign.tell([design, design, other], [1.0, 2.0, 5.0])
    campaign.tell(design, 6.0)
    (estimate,) = campaign.outcome.estimates[tuple(point_of(design))]
    assert (estimate.mean, estimate.starts) == (3.0, 3)
    assert estimate.std == pytest.approx(np.std([1, 2, 6], ddof=1))
    told = AskTell(GENES, method="gaussian-process")
    told.tell([design, other], [1.0, 5.0], [0.5, 0.1])
    told.tell([design], [2.0], [0.25])
    (estimate,) = told.outcome.estimates[tuple(point_of(design))]
    assert estimate.mean == pytest.approx((1 / 0.25 + 2 / 0.0625) / (1 / 0.25 + 1 / 0.0625))
    assert estimate.standard_error == pytest.approx(20**-0.5)
    with pytest.raises(
        InputError, match="standard error must be given for all values of a design or for none"
    ):
        told.tell([other, design], [1.0, 1.0])
    assert told.outcome.estimates[tuple(point_of(other))][0].mean == 5.0, "nothing of it counts"


def point_of(design):
    return Genome(GENES).encode(design)


def test_lucky_values_do_not_mislead(rng):
    """The best design has the best posterior mean, not the luckiest value."""
    campaign = AskTell(GENES, method="gaussian-process")
    designs = [{"x": float(x), "y": 1.0} for x in np.linspace(-1, 1, 41)]
    values = [worth(design) for design in designs]
    values[-1] = -0.5
    errors = [0.02] * 40 + [2.0]
    campaign.tell(designs, values, errors)
    assert abs(campaign.best.genes["x"] - 0.3) < 0.15


@pytest.mark.parametrize("method", METHODS)
def test_failed_experiments_are_accepted(method):
    campaign = AskTell(GENES, method=method, seed=1)
    for _ in range(3):
        designs = campaign.ask()
        campaign.tell(designs, [math.nan if design["x"] > 0.6 else worth(design) for design in designs])
    failures = campaign.outcome.failures
    assert failures
    assert all(Genome(GENES).decode(point)["x"] > 0.6 for point in failures)
    assert campaign.best.genes["x"] <= 0.6
    all_failed = AskTell(GENES, method=method, seed=1)
    first = all_failed.ask()
    all_failed.tell(first, [None] * len(first))
    assert all_failed.best is None
    assert all_failed.designs == []
    assert all_failed.ask() != first


def test_designs_not_asked_for_are_learnt():
    told = [{"x": float(x), "y": 1.0} for x in np.linspace(-1, 1, 12)]
    campaign = AskTell(GENES, method="gaussian-process", seed=1)
    campaign.tell(told, [worth(design) for design in told])
    assert len(campaign.ask()) == 8, "no random designs first"
    first = AskTell(GENES, method="gaussian-process", seed=1)
    pending = first.ask()
    first.tell(told, [worth(design) for design in told])
    assert first.ask() == pending
    assert first.best.genes["x"] == pytest.approx(0.3, abs=0.1)


def test_a_design_rounded_by_a_spreadsheet_is_recognised():
    campaign = AskTell(GENES, seed=1)
    asked = campaign.ask()
    rounded = {name: float(f"{value:.12g}") for name, value in asked[0].items()}
    assert rounded != asked[0]
    campaign.tell(rounded, 1.0)
    assert campaign.ask() == asked[1:]
    campaign.tell({**asked[1], "x": asked[1]["x"] + 10 * SAME}, 1.0)
    assert campaign.ask() == asked[1:]


def test_starting_designs_are_asked_for_first(tmp_path):
    ours = [{"x": 0.25, "y": 1.0}, {"x": 0.5, "y": 10.0}]
    for method in METHODS:
        campaign = AskTell(GENES, method=method, starting_designs=ours, file=tmp_path / f"{method}.csv")
        assert campaign.ask() == ours
        campaign.tell(ours[1], worth(ours[1]))
        again = AskTell(GENES, method=method, starting_designs=ours, file=tmp_path / f"{method}.csv")
        assert again.ask() == ours[:1]
        again.tell(ours[0], worth(ours[0]))
        assert not {tuple(d.items()) for d in again.ask()} & {tuple(d.items()) for d in ours}


def test_a_method_without_new_designs_asks_for_none():
    campaign = AskTell([Choice("wall", ("smooth", "rough", "oily"))], method="random")
    designs = campaign.ask()
    assert sorted(design["wall"] for design in designs) == ["oily", "rough", "smooth"]
    campaign.tell(designs, [1.0, 2.0, 3.0])
    assert campaign.ask() == []


def test_constraints_of_a_problem_hold():
    place = DesignConstraint("place", lambda design: design["x0"], "m", at_most=0.8)
    load = ResultConstraint("load", len, "N", at_least=0.5)
    problem = fake_problem(2, constraints=[place, load])
    campaign = AskTell(problem, seed=1, method="nsga2")
    for _ in range(4):
        designs = campaign.ask()
        assert all(design["x0"] <= 0.8 for design in designs)
        campaign.tell(designs, [{"fitness": bowl(d, 0), "load": d["x1"]} for d in designs])
    assert campaign.best.genes["x1"] >= 0.5
    assert campaign.best.values["fitness"] < 0.7
    with pytest.raises(InputError, match="values of a design must be of fitness, load; received"):
        campaign.tell(campaign.ask()[0], 1.0)


def test_impossible_values_are_refused(tmp_path):
    campaign = AskTell(GENES)
    (first, *_) = campaign.ask()
    for designs, values, errors, message in (
        ({"x": 0.1}, 1.0, None, "columns must be of all genes, y .m. among them"),
        ({"x": 2.0, "y": 1.0}, 1.0, None, "gene x must be a number within -1..1 m; received 2"),
        ([first], [1.0, 2.0], None, "values must be one for each of 1 designs; received"),
        ([first], [1.0], [0.1, 0.1], "standard_errors must be one for each of 1 designs; received"),
        (first, 1.0, -0.1, "value std. error must be 0 or more, or empty; received -0.1"),
        (first, "good", None, "values of a design must be of value; received 'good'"),
        (first, {"worth": 1.0}, None, "values of a design must be of value; received"),
        (first, None, 0.1, "standard_errors must be left out if the designs contain them; received 0.1"),
        ([3], [1.0], None, "design must be a dictionary by the names of genes; received 3"),
        ({**first, "z": 1.0}, 1.0, None, "column z must be a gene"),
        ([], [], None, "told design must be one design or more"),
    ):
        with pytest.raises(InputError, match=message):
            campaign.tell(designs, values, errors)
    assert campaign.outcome.estimates == {}
    with pytest.raises(InputError, match="objective a must be 'smallest' or 'largest'; received 'big'"):
        AskTell(GENES, {"a": "big"})
    with pytest.raises(InputError, match=r"search.options.populaton must be a known key"):
        AskTell(GENES, options={"populaton": 3})
    assert AskTell(GENES, [Objective("R", len, "m", maximise=True)]).problem.objectives[0].maximise


def test_files_of_others_are_refused(tmp_path):
    file = tmp_path / "c.csv"
    going_on(AskTell(GENES, seed=1, file=file), 2)
    content = file.read_bytes()
    for settings in ({"seed": 2}, {"method": "random"}, {"options": {"first": 4}}):
        with pytest.raises(
            InputError, match=r"c.csv, line \d+: campaign file must be of the same genes, method"
        ):
            AskTell(GENES, **{"seed": 1, **settings}, file=file)
    with pytest.raises(InputError, match=r"column x \(m\) must be a gene"):
        AskTell([Gene("x", "mm", -1, 1), GENES[1]], seed=1, file=file)
    (tmp_path / "d.csv").write_text("x,y,value\n0.1,1,1\n")
    with pytest.raises(InputError, match="campaign file must be one of an AskTell; received"):
        AskTell(GENES, file=tmp_path / "d.csv")
    lines = content.decode().splitlines(keepends=True)
    file.write_text("".join([*lines[:3], *lines[-3:]]))
    with pytest.raises(InputError, match="received one without some designs before"):
        AskTell(GENES, seed=1, file=file)
    file.write_bytes(content)
    one, other = (AskTell(GENES, seed=1, file=file) for _ in range(2))
    designs = one.ask()
    one.tell(designs[0], 1.0)
    with pytest.raises(
        InputError, match="campaign file must be as this campaign has left it; make a new AskTell"
    ):
        other.tell(designs[1], 1.0)
    assert len(other.outcome.estimates) + 1 == len(one.outcome.estimates)


def test_files_of_designs_are_read(tmp_path):
    """A campaign reads the file of another one with another method, and a new object continues from there."""
    file = tmp_path / "c.csv"
    first = going_on(AskTell(GENES, seed=1, file=file), 3)
    second = AskTell(GENES, method="gaussian-process", file=tmp_path / "d.csv")
    second.tell(file)
    assert np.allclose([*second.outcome.estimates], [*first.outcome.estimates], rtol=0, atol=1e-12)
    assert second.best.values == first.best.values
    assert len(second.ask()) == 8
    third = AskTell(GENES, method="gaussian-process", file=tmp_path / "d.csv")
    assert third.ask() == second.ask()
    problem = optimize.Problem.of_function(worth, GENES)
    assert optimize.run(problem, experiments=file, generations=0).logbook[0]["designs"] == 8
