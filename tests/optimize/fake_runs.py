"""Stand-ins for scenes and their evaluation, which cost nothing and count every call."""

import hashlib
import json
import math
import time
from types import SimpleNamespace

import numpy as np

from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.record import Record, evaluation_key


class FakeScene:
    def __init__(self, design, seed):
        self.design, self.seed = dict(design), seed

    def digest(self):
        return hashlib.sha256(json.dumps([self.design, self.seed], sort_keys=True).encode()).hexdigest()

    def to_toml(self):
        return f"seed = {self.seed}\n"


def bowl(design, seed, noise=0.01):
    """A bowl with its minimum 0.5 at x = 0.3 in the unit cube, and reproducible noise."""
    x = np.array(list(design.values()))
    return float(np.sum((x - 0.3) ** 2) + 0.5 + noise * np.random.default_rng(seed).normal())


class FakeEvaluator:
    """function(design, seed) -> fitness, or a string that gives the reason of a failed run.

    Results come in reverse order, to detect code that relies on the order.
    interrupt_after : number of evaluations before a KeyboardInterrupt.
    leaves_state : whether runs have a final state, as scenes do and functions do not.
    """

    def __init__(self, function=bowl, interrupt_after=math.inf, delay=0.0, leaves_state=True):
        self.settings = {"precision": "f64", "device": "cpu"}
        self.function, self.interrupt_after, self.delay = function, interrupt_after, delay
        self.calls, self.digests, self.leaves_state = [], [], leaves_state

    def evaluate(self, scenes, progress):
        self.calls.append(list(scenes))
        for index in reversed(range(len(scenes))):
            if len(self.digests) >= self.interrupt_after:
                raise KeyboardInterrupt
            time.sleep(self.delay)
            scene = scenes[index]
            self.digests.append(scene.digest())
            value = self.function(scene.design, scene.seed)
            failed = isinstance(value, str)
            status = SimpleNamespace(ok=not failed, reason=value if failed else "")
            state = {"value": np.array([value])} if self.leaves_state and not failed else {}
            work = {"steps": np.int64(7)}
            yield index, SimpleNamespace(status=status, wall_s=0.25, work=work, value=value, state=state)

    def close(self):
        pass


def fake_problem(genes=4, **changes):
    genome = Genome(tuple(Gene(f"x{i}", "m", 0.0, 1.0) for i in range(genes)))
    return Problem(
        **{"name": "bowl", "genome": genome, "scene": FakeScene, "objective": lambda r: r.value, **changes}
    )


def fake_record(number, fitness=None, ok=True, pad=""):
    return Record(
        key=evaluation_key(f"scene {number}", {"precision": "f64"}, "bowl", 1),
        problem="bowl",
        values={"fitness": number / 7 if fitness is None else fitness},
        ok=ok,
        reason="" if ok else "went wrong",
        seed=number,
        design={"x": number / 3, "y": 1.0},
        work={"steps": number, "pad": pad},
        wall_s=0.5,
        created=1e9 + number,
        start=number % 4,
    )


class FakeCache:
    """Evaluations in memory only, for dozens of searches."""

    def __init__(self):
        self.records_by_key = {}

    def refresh(self):
        pass

    def get(self, key):
        return self.records_by_key.get(key)

    def put(self, record):
        return self.records_by_key.setdefault(record.key, record)

    def put_table(self, name, columns, attrs=None, about=None):
        pass

    def fold(self):
        pass

    def attributes(self):
        return {}


def individual_of(point, *costs, std=0.0, starts=1):
    """An individual with known costs; std : standard deviation over its starts."""
    individual = Individual(point, len(costs))
    individual.know(tuple(FitnessEstimate(float(c), std, float(c), float(c), starts, True) for c in costs))
    return individual
