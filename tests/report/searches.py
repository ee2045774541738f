"""Searches of plain functions, whose pages are tested: hostile names, genes of all kinds, failures."""

import numpy as np

from tisim import InputError
from tisim.optimize import Choice, DesignConstraint, Gene, Objective, Problem, ResultConstraint
from tisim.optimize.beginning import Beginning
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.problem.given_genes import FixedGene
from tisim.optimize.report.search_data import RunOfDesign, SearchData
from tisim.optimize.search import search
from tisim.optimize.search_folder import SEARCH_FILE, results_of
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.tables import FRESH_STARTS, HIGH, LOW, error_of

HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='hacked=1'>&amp;\u2028${title}"
HOSTILE_CHOICE, HOSTILE_NAME = "</script><script>hacked=1</script>", "<img src=x onerror=hacked=1>"
GENES = (
    Gene("speed", "m/s", 1.0, 9.0),
    Gene("ratio", "", 1e-3, 1.0, "log"),
    Gene("grains", "", 2, 20, integer=True),
    Choice("kind", ("steel", HOSTILE_CHOICE)),
    FixedGene(HOSTILE_NAME, "K", 300.0),
)


def outcome_of(design, seed):
    """Refused beyond a speed; noisy."""
    if design["speed"] > 8:
        raise InputError(f"{HOSTILE} must be slow; received {design['speed']}")
    noise = np.random.default_rng(seed).normal()
    gain = design["speed"] * design["ratio"] + (design["kind"] == "steel") + 0.1 * noise
    return {"gain": gain, "mass": design["grains"] * (1 + 0.01 * noise), "heat": 300 + 10 * design["speed"]}


def of(name):
    """The function of an objective."""
    return lambda result: result.value[name]


def problem(*names, **fields):
    """A problem with some of the objectives."""
    gain = Objective("gain", of("gain"), "1/s", maximise=True)
    known = {"gain": gain, "mass": Objective("mass", of("mass"), "kg")}
    return Problem.of_function(
        outcome_of, GENES, [known[name] for name in names], name="demo", title=HOSTILE,
        constraints=[
            ResultConstraint("heat", of("heat"), "K", at_most=375.0),
            DesignConstraint("load", lambda design: design["speed"] * design["grains"], at_most=170.0),
        ],
        **fields,
    )  # fmt: skip


def searched(folder, *names, start_from=None, **settings):
    """The outcome of a short search in a folder, without its pictures."""
    chosen = {"generations": 2, "options": {"population": 8}, "ensemble": {"confirm": 4, "select": 2}}
    asked = problem(*names)
    beginning = Beginning.of(asked, None if start_from is None else [dict(start_from)], None, False)
    with Cache(folder / SEARCH_FILE) as cache:
        outcome = search(asked, FunctionEvaluator(), cache, Settings(**chosen | settings), beginning)
    with results_of(folder, outcome.name):
        return outcome


def made_up(count, rng, objectives=("loss", "mass")):
    """A search of many designs that was never run."""
    genes = {f"x{k}": rng.random(count) for k in range(6)}
    kinds = [("steel", "gold", "lead")[k] for k in rng.integers(0, 3, count)]
    values, rank = {}, np.zeros(count, int)
    rank[rng.choice(count, 20, replace=False)] = np.arange(1, 21)
    for m, name in enumerate(objectives):
        mean = (genes["x0"] - 0.3 * (m + 1)) ** 2 + genes[f"x{m + 1}"] + 0.02 * rng.normal(size=count)
        fresh = np.where(rank > 0, mean + 0.01, np.nan)
        values |= {
            name: mean, error_of(name): np.full(count, 0.02), f"{name}{FRESH_STARTS}": fresh,
            f"{name} {LOW}{FRESH_STARTS}": fresh - 0.02, f"{name} {HIGH}{FRESH_STARTS}": fresh + 0.02,
        }  # fmt: skip
    curves = [f"best {name} (J)" for name in objectives] if len(objectives) > 1 else ["best", "mean", "std"]
    run = [RunOfDesign(s, s > 1, 7 + s, dict.fromkeys(objectives, 0.5), "", 0.25) for s in range(3)]
    generation = np.sort(rng.integers(0, 20, count))
    return SearchData(
        name="demo-nsga2-0-abc", problem="demo", title="demo", stopped="generations",
        settings={"seed": 0, "method": "nsga2", "hall_of_fame": 6}, identity={"evaluator": {"device": "cpu"}},
        versions={"tisim": "0.1.0"}, command=("optimize", "demo"),
        genes=[
            *({"name": name, "unit": "m", "low": 0.0, "high": 1.0, "scale": "linear"} for name in genes),
            {"name": "kind", "choices": '["steel", "gold", "lead"]'},
        ],
        objectives=[
            {"name": name, "unit": "J", "direction": "smallest", "statistic": "mean"} for name in objectives
        ],
        constraints=[],
        logbook={
            "gen": list(range(20)), "starts": [100 - g for g in range(20)],
            **dict.fromkeys(curves, (1.0 / np.arange(1, 21)).tolist()),
        },
        facts={
            "gen": generation.tolist(), "rank": rank.tolist(), "best": (rank == 1).astype(int).tolist(),
            "starts": [2] * count, f"starts{FRESH_STARTS}": np.where(rank > 0, 16, 0).tolist(),
            "converged": [0] * count, "feasible": ["yes"] * count, "failed": [""] * count,
        },
        design_genes={name: column.tolist() for name, column in genes.items()} | {"kind": kinds},
        values={name: column.tolist() for name, column in values.items()},
        runs=[run] * count,
    )  # fmt: skip
