"""Objective values are reused for the same function bound to the same data, and for no other."""

import enum
import functools
import importlib
import os
import sqlite3
import subprocess
import sys
import threading
from collections import defaultdict
from dataclasses import dataclass, replace
from os import environ
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.optimize.drift_case import problem
from tisim import InputError, optimize
from tisim.optimize.problem.fingerprint import fingerprint

LEVEL = 1.0
TABLE = np.arange(4.0)


def miss(result, target):
    return abs(result - target)


def of_global(result):
    return abs(result - LEVEL)


def through_another(result):
    return of_global(result) + TABLE.sum()


def of_closure(target):
    return lambda result: abs(result - target)


class Target:
    def __init__(self, target):
        self.target = target

    def __call__(self, result):
        return miss(result, self.target)

    def by_method(self, result):
        return abs(result - self.target)


@dataclass
class Weights:
    names: tuple
    weights: dict

    @functools.cached_property
    def total(self):
        return sum(self.weights.values())


@dataclass
class OfFile:
    """Its target is not a dataclass field."""

    name: str

    def __post_init__(self):
        self.target = float(self.name)


def with_base(value):
    """An object of a class whose base class has a value and a method that uses it."""
    base = type("Base", (), {"target": [value], "miss": lambda self, result: abs(result - self.target[0])})
    return type("Objective", (base,), {"__call__": lambda self, result: self.miss(result)})()


def with_default(target):
    def inner(result, wanted=target):
        return result - wanted

    return inner


MAKERS = {
    "partial by name": lambda value: functools.partial(miss, target=value),
    "partial of a partial": lambda value: functools.partial(functools.partial(miss), 0.0, value),
    "closure": of_closure,
    "default": with_default,
    "object": Target,
    "method": lambda value: Target(value).by_method,
    "array": lambda value: of_closure(np.array([1.0, value])),
    "array of f32": lambda value: of_closure(np.array([1.0, value], np.float32)),
    "masked array": lambda value: of_closure(np.ma.array([1.0, 2.0], mask=[False, value > 1])),
    "dictionary": lambda value: of_closure({"a": {"b": [1, (2, value)]}}),
    "set": lambda value: of_closure({1.0, value, "x"}),
    "data class": lambda value: of_closure(Weights(("a",), {"a": value})),
    "data class that computes": lambda value: of_closure(OfFile(str(value))),
    "class with a base": with_base,
    "array of objects": lambda value: of_closure(np.array(value, dtype=object)),
    "namespace": lambda value: of_closure(SimpleNamespace(a=value)),
    "path": lambda value: of_closure(Path(f"target{value}.csv")),
    "cached function": lambda value: functools.lru_cache(of_closure(value)),
}


@pytest.mark.parametrize("name", MAKERS)
def test_the_bound_data_of_a_function_count(name):
    make = MAKERS[name]
    assert fingerprint(make(0.5), name) == fingerprint(make(0.5), name)
    assert fingerprint(make(0.5), name) != fingerprint(make(1.5), name)


def test_globals_of_a_function_and_its_callees_count(monkeypatch):
    before = fingerprint(of_global, "x"), fingerprint(through_another, "x")
    assert before == (fingerprint(of_global, "x"), fingerprint(through_another, "x"))
    with monkeypatch.context() as patch:
        patch.setitem(globals(), "LEVEL", 2.0)
        assert fingerprint(of_global, "x") != before[0]
        assert fingerprint(through_another, "x") != before[1]
    monkeypatch.setitem(globals(), "TABLE", TABLE + 1)
    assert fingerprint(through_another, "x") != before[1]


def test_names_from_user_modules_count(tmp_path, monkeypatch):
    """Its file counts, and a value that was set in it later."""
    monkeypatch.syspath_prepend(tmp_path)
    text = "LEVEL = 1.0\n\n\ndef miss(result):\n    return abs(result - LEVEL)\n"
    (tmp_path / "own_levels.py").write_text(text)
    module = importlib.import_module("own_levels")
    names = {"own_levels": module}
    exec("def of_value(r): return r - own_levels.LEVEL\ndef of_call(r): return own_levels.miss(r)", names)
    for function in names["of_value"], names["of_call"]:
        before = fingerprint(function, "x")
        assert fingerprint(function, "x") == before
        with monkeypatch.context() as patch:
            patch.setattr(module, "LEVEL", 2.0)
            assert fingerprint(function, "x") != before
        (tmp_path / "own_levels.py").write_text(text + "\n")
        assert fingerprint(function, "x") != before
        (tmp_path / "own_levels.py").write_text(text)
    monkeypatch.delitem(sys.modules, "own_levels")


def test_cached_values_of_an_object_do_not_count():
    weights = Weights(("a",), {"a": 1.0})
    before = fingerprint(of_closure(weights), "x")
    assert weights.total == 1.0
    assert fingerprint(of_closure(weights), "x") == before


def test_redefined_code_counts():
    """Code in a notebook has no file."""
    names = {}
    exec("def f(r): return r - 1", names)
    before = fingerprint(names["f"], "x")
    exec("def f(r): return r - 1", names)
    assert fingerprint(names["f"], "x") == before
    exec("def f(r): return r - 2", names)
    assert fingerprint(names["f"], "x") != before


def test_cyclic_objects_are_handled():
    one, other = SimpleNamespace(a=1), SimpleNamespace(a=2)
    one.other, other.other = other, one
    before = fingerprint(of_closure(one), "x")
    assert fingerprint(of_closure(one), "x") == before
    other.a = 3
    assert fingerprint(of_closure(one), "x") != before


def test_incomparable_objects_are_refused():
    lock = threading.Lock()
    with pytest.raises(InputError, match=r"^objective R must use only values that can be compared; "):
        fingerprint(of_closure(lock), "objective R")
    # In the fingerprint of a scene, which has its own digest, an object counts by its class.
    assert fingerprint(of_closure(lock)) == fingerprint(of_closure(threading.Lock()))


def test_an_object_whose_content_is_hidden_is_refused():
    """A class of the user that is derived from one in C has attributes that Python does not show."""
    for kind in (sqlite3.Connection, type("Own", (sqlite3.Connection,), {})):
        with pytest.raises(InputError, match=r"^objective R must use only values that can be compared; "):
            fingerprint(of_closure(kind(":memory:")), "objective R", True)


def test_an_explicit_code_replaces_the_comparison():
    """As the message recommends."""
    made = replace(problem("default", ""), objective=of_closure(threading.Lock()))
    with pytest.raises(InputError, match="Or give Problem"):
        _ = made.objective_identity
    assert replace(made, code="1").objective_identity == replace(made, code="1").objective_identity
    assert replace(made, code="1").identity != replace(made, code="2").identity


def with_attribute(value):
    def of_attribute(result):
        return abs(result - of_attribute.target)

    of_attribute.target = value
    return of_attribute


class Slots:
    __slots__ = ("__hidden", "function")

    def __init__(self, value):
        self.__hidden, self.function = value, of_closure(value)


class Number(float):
    def __repr__(self):
        return "number"


class Record(dict):
    pass


class Scaled:
    """A decorator with a value of its own."""

    def __init__(self, function, scale):
        functools.update_wrapper(self, function)
        self.scale = scale


class Kept:
    """A property that another value was assigned to, or that was computed from an old file."""

    def __init__(self, value):
        self.target = value

    target = functools.cached_property(lambda self: 0.0)


def record_with(value):
    record = Record(a=1)
    record.target = value
    return record


MORE_MAKERS = {
    "attribute of a function": with_attribute,
    "attribute of the function in a closure": lambda value: of_closure(with_attribute(value)),
    "slots": lambda value: of_closure(Slots(value)),
    "number of an own class": lambda value: of_closure(Number(value)),
    "attribute of a dictionary": lambda value: of_closure(record_with(value)),
    "class of a list": lambda value: of_closure(type("Own", (list,), {"target": value})()),
    "default of a dictionary": lambda value: of_closure(defaultdict(lambda: value)),
    "value of an enumeration": lambda value: of_closure(enum.Enum("Kind", {"A": value}).A),
    "decorator": lambda value: of_closure(Scaled(miss, value)),
    "cached property": lambda value: of_closure(Kept(value)),
    "mutable default": lambda value: with_default([value]),
}


@pytest.mark.parametrize("name", MORE_MAKERS)
def test_less_usual_places_of_data_count(name):
    make = MORE_MAKERS[name]
    first, again, other = (fingerprint(make(value), name, True) for value in (0.5, 0.5, 1.5))
    assert first == again
    assert first != other


VARIABLES = {
    "subscript": lambda result: float(os.environ["TISIM_TEST"]),
    "get": lambda result: float(os.environ.get("TISIM_TEST", 0.0)),
    "getenv": lambda result: float(os.getenv("TISIM_TEST", default=0.0)),
    "contains": lambda result: "TISIM_TEST" in os.environ,
    "imported name": lambda result: float(environ["TISIM_TEST"]),
    "nested function": lambda result: [float(os.environ["TISIM_TEST"]) for _ in range(2)],
}


@pytest.mark.parametrize("name", VARIABLES)
def test_environment_variables_that_code_names_count(name, monkeypatch):
    def now():
        return fingerprint(VARIABLES[name], "objective R", True)

    prints = [now()]
    for value in ("1.0", "1.0", "2.0"):
        monkeypatch.setenv("TISIM_TEST", value)
        prints.append(now())
    monkeypatch.setenv("TISIM_OTHER", "3.0")
    assert prints[1] == prints[2]
    assert len(set(prints)) == 3
    assert now() == prints[3], "other variables do not count"


KEY, GET = "TISIM_TEST", os.getenv
IN_PARTS = {
    "a variable": lambda result: os.environ[KEY],
    "an expression": lambda result: os.getenv("TISIM" + result),
    "the dictionary": lambda result: dict(os.environ),
    "an argument": lambda result, part="": os.environ.get(f"TISIM_{part}"),
    "an alias": lambda result: GET("TISIM_TEST"),
    "a default": lambda result, get=os.getenv: get("TISIM_TEST"),
}


@pytest.mark.parametrize("name", IN_PARTS)
def test_environment_variables_without_constant_names_are_refused(name):
    with pytest.raises(InputError) as refused:
        fingerprint(IN_PARTS[name], "objective R", True)
    got = "getenv" if name in ("an expression", "an alias", "a default") else "environ"
    place = "" if name in ("an alias", "a default") else " (<lambda>)"
    assert str(refused.value) == (
        "objective R must name each environment variable by a constant, os.environ['NAME'], as its values "
        f"are used again; received {got}{place}. Or give Problem(code=...), a text that you change with "
        "these values"
    )


HIDDEN = {
    "globals": lambda result: globals()["LEVEL"],
    "eval": lambda result: eval("LEVEL"),
    "exec": lambda result: exec("LEVEL"),
    "__import__": lambda result: __import__("sys").LEVEL,
    "import_module": lambda result: importlib.import_module("own_levels").LEVEL,
    "modules": lambda result: sys.modules["own_levels"].LEVEL,
    "f_globals": lambda result: sys._getframe().f_globals["LEVEL"],
    "__globals__": lambda result: of_global.__globals__["LEVEL"],
}


@pytest.mark.parametrize("name", HIDDEN)
def test_code_that_finds_values_by_any_name_is_refused(name):
    with pytest.raises(InputError) as refused:
        fingerprint(HIDDEN[name], "objective R", True)
    assert str(refused.value) == (
        "objective R must read values by names that its code shows, as its values are used again; received "
        f"{name} (<lambda>). Or give Problem(code=...), a text that you change with these values"
    )
    assert fingerprint(HIDDEN[name], "method M"), "nothing is used again"
    made = replace(problem("default", ""), objective=HIDDEN[name], code="1")
    assert made.objective_identity != replace(made, code="2").objective_identity


def test_values_of_modules_found_by_name_or_imported_late_count(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_package").mkdir()
    (tmp_path / "own_package/__init__.py").write_text("")
    (tmp_path / "own_package/own_values.py").write_text("T = 1.0\n")
    module = importlib.import_module("own_package.own_values")
    names = {"own_package": importlib.import_module("own_package"), "own_values": module}
    texts = (
        "def f(r): return getattr(own_values, 'T')", "def f(r, n='T'): return getattr(own_values, n)",
        "def f(r): return vars(own_values)['T']", "def f(r): return own_values.__dict__['T']",
        "def f(r): return own_package.own_values.T",
        "def f(r):\n    from own_package.own_values import T\n    return T",
        "def f(r):\n    import own_package.own_values as v\n    return v.T",
        "def f(r):\n    from own_package import own_values as v\n    return v.T",
    )  # fmt: skip
    for text in texts:
        exec(text, names)
        before = fingerprint(names["f"], "x", True)
        assert fingerprint(names["f"], "x", True) == before
        with monkeypatch.context() as patch:
            patch.setattr(module, "T", 2.0)
            assert fingerprint(names["f"], "x", True) != before, text
    for name in ("own_package", "own_package.own_values"):
        monkeypatch.delitem(sys.modules, name)


def test_values_kept_from_an_old_file_are_not_used(tmp_path):
    """The cache of the function is emptied, so that the file is read again, and noticed."""
    file = tmp_path / "target.txt"

    @functools.lru_cache
    def target():
        return float(file.read_text())

    def away(design):
        return (design["x"] - target()) ** 2

    def of(value, **more):
        file.write_text(str(value))
        return optimize.Problem.of_function(away, [optimize.Gene("x", "", 0.0, 1.0)], **more)

    settings = {"method": "random", "generations": 1, "options": {"population": 4}}
    for value in (0.25, 0.75):
        made = of(value)
        target()
        with pytest.raises(InputError, match=r"^objective value must read no file but .*target\.txt$"):
            optimize.run(made, out=tmp_path / "a", **settings)
        best = optimize.run(of(value, files=[file]), out=tmp_path / str(value), **settings).designs[0]
        assert best.values["value"] == (best.genes["x"] - value) ** 2


SCRIPT = """
from tests.optimize import test_fingerprint as t
print(*(t.fingerprint(make(0.5), name) for name, make in t.MAKERS.items()))
"""


def test_fingerprints_are_equal_in_another_process():
    command = [sys.executable, "-c", SCRIPT]
    root = Path(__file__).parents[2]
    told = subprocess.run(command, capture_output=True, text=True, check=True, cwd=root).stdout.split()
    assert told == [fingerprint(make(0.5), name) for name, make in MAKERS.items()]


FEW = {
    "generations": 0, "options": {"population": 4},
    "ensemble": {"max_starts": 1, "min_starts": 1, "block": 1},
}  # fmt: skip


def away(result, target):
    return abs(result.state["mass"][0] - target)


@pytest.mark.long
def test_another_target_in_the_same_folder_is_another_problem(tmp_path):
    """The second search is refused and does not reuse the values of the first."""

    def of(target):
        objective = functools.partial(
            lambda result, target: abs(result.state["mass"][0] - target), target=target
        )
        return replace(problem("default", ""), objective=objective)

    first = optimize.run(of(0.25), out=tmp_path, **FEW)
    assert first.evaluations > 0
    assert optimize.run(of(0.25), out=tmp_path, **FEW).evaluations == 0
    with pytest.raises(InputError, match=r"the problem file, or a value that its functions use, has changed"):
        optimize.run(of(0.5), out=tmp_path, **FEW)


@pytest.mark.long
@pytest.mark.slow
def test_another_range_of_a_gene_is_another_search(tmp_path):
    """The searches differ, but the values of equal designs are reused."""
    made = problem("default", "")
    gene, *others = made.genome.genes
    wider = replace(made, genome=optimize.Genome((replace(gene, high=2 * gene.high), *others)))
    first, second = (optimize.run(one, out=tmp_path, **FEW) for one in (made, wider))
    assert second.evaluations == first.evaluations
    assert first.name != second.name
    assert sorted(optimize.read(tmp_path).searches) == sorted(
        one.name.removeprefix("searches/") for one in (first, second)
    )
    assert max(design.genes[gene.name] for design in second.designs) > gene.high
