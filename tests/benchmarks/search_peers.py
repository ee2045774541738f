"""Searches of other libraries: pymoo, Optuna, cma and scikit-learn (python -m pip install ".[bench]").

Each is a function (evaluate, genes, costs, seed), which asks for the costs of points of the unit cube until
Spent is raised. It may return the point that it considers best; otherwise the point of lowest mean is taken.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from scipy.stats import norm, qmc


class Evaluate(Protocol):
    """Mean costs, (n, costs), of points of the unit cube, (n, genes).

    points, values : all so far. variance : variance between starts of the first of these means.
    """

    points: np.ndarray
    values: np.ndarray
    variance: float

    def __call__(self, points: np.ndarray) -> np.ndarray: ...


class Spent(Exception):
    """The budget does not allow another design."""


def pycma(evaluate: Evaluate, genes: int, costs: int, seed: int) -> None:
    """CMA-ES from the middle; after convergence, again from elsewhere with twice the population."""
    import cma

    rng = np.random.default_rng(seed)
    options = {"bounds": [0, 1], "verbose": -9, "verb_log": 0, "tolfun": 1e-14, "tolx": 1e-12}
    start, restart = np.full(genes, 0.5), 1
    while True:
        strategy = cma.CMAEvolutionStrategy(start, 0.3, {**options, "seed": 1000 * seed + restart})
        while not strategy.stop():
            points = strategy.ask()
            strategy.tell(points, [float(value[0]) for value in evaluate(np.array(points))])
        options["popsize"] = 2 * strategy.popsize
        start, restart = rng.random(genes), restart + 1


def optuna(sampler: str) -> Callable[..., None]:
    """A sampler of Optuna, which is asked for one design at a time."""

    def run(evaluate: Evaluate, genes: int, costs: int, seed: int) -> None:
        import optuna

        optuna.logging.set_verbosity(optuna.logging.ERROR)
        kind = {
            "tpe": lambda: optuna.samplers.TPESampler(seed=seed, multivariate=True),
            "nsga2": lambda: optuna.samplers.NSGAIISampler(seed=seed, population_size=40),
        }[sampler]
        study = optuna.create_study(directions=["minimize"] * costs, sampler=kind())
        space = {f"x{i}": optuna.distributions.FloatDistribution(0, 1) for i in range(genes)}
        while True:
            trial = study.ask(space)
            (values,) = evaluate(np.array([[trial.params[name] for name in space]]))
            study.tell(trial, [float(value) for value in values])

    return run


def pymoo(algorithm: str) -> Callable[..., None]:
    """A genetic algorithm of pymoo with populations of 20, or of 36 for three costs."""

    def run(evaluate: Evaluate, genes: int, costs: int, seed: int) -> None:
        from pymoo.algorithms.moo.nsga2 import NSGA2
        from pymoo.algorithms.moo.nsga3 import NSGA3
        from pymoo.algorithms.soo.nonconvex.ga import GA
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize
        from pymoo.util.ref_dirs import get_reference_directions

        class Asked(Problem):
            def __init__(self) -> None:
                super().__init__(n_var=genes, n_obj=costs, xl=0.0, xu=1.0)

            def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **more: Any) -> None:
                out["F"] = evaluate(x)

        size = 20 if costs < 3 else 36
        kinds: dict[str, Callable[[], Any]] = {
            "ga": lambda: GA(pop_size=size),
            "nsga2": lambda: NSGA2(pop_size=size),
            "nsga3": lambda: NSGA3(
                get_reference_directions("das-dennis", costs, n_partitions=size - 1 if costs < 3 else 7),
                pop_size=size,
            ),
        }
        minimize(Asked(), kinds[algorithm](), ("n_gen", 10**6), seed=seed + 1, verbose=False)

    return run


def sklearn_gp(evaluate: Evaluate, genes: int, costs: int, seed: int) -> np.ndarray:
    """Bayesian optimisation: a Gaussian process (Matern 5/2) and expected improvement, in batches of four.

    It returns the design of lowest posterior mean.
    """
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    warnings.simplefilter("ignore")
    rng = np.random.default_rng(seed)
    kernel: Any = ConstantKernel(1.0, (1e-2, 1e2)) * Matern(np.full(genes, 0.5), (0.05, 20.0), nu=2.5)

    def model(points: np.ndarray, values: np.ndarray, fitted: bool = True) -> Any:
        noise = max(evaluate.variance / (evaluate.values[:, 0].std() + 1e-12) ** 2, 1e-6)
        optimizer = "fmin_l_bfgs_b" if fitted else None
        return GaussianProcessRegressor(kernel, alpha=noise, optimizer=optimizer).fit(points, values)

    try:
        evaluate(qmc.Sobol(genes, rng=rng).random(2 * genes))
        while True:
            known, values = evaluate.points, evaluate.values[:, 0]
            values = (values - values.mean()) / (values.std() + 1e-12)
            for turn in range(4):
                process = model(known, values, turn == 0)
                kernel = process.kernel_
                means = process.predict(known)
                changed = rng.random((500, genes)) < max(0.3, 2 / genes)
                step = rng.choice([0.02, 0.05, 0.1, 0.2], (500, 1)) * changed * rng.normal(size=(500, genes))
                near = np.clip(known[np.argmin(means)] + step, 0, 1)
                drawn = np.vstack([rng.random((500, genes)), near])
                mean, deviation = process.predict(drawn, return_std=True)
                z = (means.min() - mean) / np.maximum(deviation, 1e-9)
                pick = np.argmax(deviation * (z * norm.cdf(z) + norm.pdf(z)))
                known, values = np.vstack([known, drawn[pick]]), np.append(values, mean[pick])
            evaluate(known[-4:])
    except Spent:
        values = (evaluate.values[:, 0] - evaluate.values[:, 0].mean()) / (
            evaluate.values[:, 0].std() + 1e-12
        )
        means = model(evaluate.points, values).predict(evaluate.points)
        return evaluate.points[np.argmin(means)]


ONE = {"pycma": pycma, "optuna-tpe": optuna("tpe"), "pymoo-ga": pymoo("ga"), "sklearn-gp": sklearn_gp}
SEVERAL = {
    "pymoo-nsga2": pymoo("nsga2"),
    "pymoo-nsga3": pymoo("nsga3"),
    "optuna-tpe": optuna("tpe"),
    "optuna-nsga2": optuna("nsga2"),
}
"""The peers for one cost, and for several."""
