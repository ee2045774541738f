"""The contracts of docs/contracts are those of the code, and their examples are what tisim new writes.

tests/cli/test_new.py runs the examples and their tests.
"""

import ast
import inspect
from pathlib import Path
from string import Template

import pytest

from tests import concepts
from tests.scenes import fixed
from tests.test_testing import WAYS, crossing
from tisim.cases import case
from tisim.cli import new
from tisim.effects import Cohesion, Force, PairForce
from tisim.effects.base import Pairwise
from tisim.effects.contact.granular import parts
from tisim.materials.materials import Touching
from tisim.operators import AddsParticles, Operator
from tisim.operators import base as operators
from tisim.program import phases
from tisim.scene import plugins
from tisim.sources import Source
from tisim.state import fields
from tisim.state.state import State
from tisim.steppers import StepContext, Stepper, common, verlet
from tisim.testing import assert_lists

ROOT = Path(__file__).parents[1]
BASES = {
    "pair_force": (PairForce, Pairwise),
    "contact_part": (parts.ContactPart,),
    "source": (Source,),
    "operator": (Operator, AddsParticles),
    "stepper": (Stepper,),
    "case": (case.Case,),
}
"""The class of each contract, and classes below it whose names are also on the page."""
TEMPLATES = {part: (part, base[0]) for part, base in BASES.items()} | {
    "pair_force": ("pair", PairForce),
    "force": ("external", Force),
    "contact_part": ("contact_part", Cohesion),
}
"""The template of each kind of part, and the class from which its example is derived."""
NOT_WRITTEN = {
    *("contract", "repeatable", "structure", "reaches", "turns", "offers_inverse", "acts_on_worlds"),
    *("resolves", "countable", "min_steps", "rivals", "all_pairs", "packs", "size", "scene_of", "inverse"),
}
"""Names that tisim derives from others, or that only its own parts set."""
PREFIXES = {"s": State, "pair": Touching, "context": StepContext}
MODULES = (common, verlet, phases, fields, case, operators)


def members(kind):
    """The names of a class itself, with those that are only annotated."""
    return {name for name in (*vars(kind), *inspect.get_annotations(kind)) if not name.startswith("_")}


def has(kind, name):
    return any(name in members(base) for base in kind.__mro__)


def bare(text):
    """A name without arguments, prefix and annotation."""
    return text.partition("(")[0].partition(":")[0].rpartition(".")[2]


def rows(part):
    """The rows of a contract; an empty base class is the one above."""
    above = ""
    for row in concepts.rows(part):
        above = row.get("base class", "").strip("`") or above
        yield {**row, "base class": above}


def described(part):
    """Each name of a contract as printed, with the class to which it belongs; None if it stands by itself."""
    for row in rows(part):
        for text in concepts.names(row):
            prefix, name = text.partition("(")[0].rpartition(".")[0], bare(text)
            kinds = (getattr(parts, row["base class"]),) if row["base class"] else BASES[part]
            kinds = (PREFIXES[prefix],) if prefix in PREFIXES else kinds
            if name != "NAME" and prefix not in ("self", "self.sums"):
                yield text, name, next((kind for kind in kinds if has(kind, name)), None)


@pytest.mark.parametrize("part", BASES)
def test_a_contract_is_one_page(part):
    assert len((ROOT / f"docs/contracts/{part}.md").read_text(encoding="utf-8").splitlines()) <= 80


@pytest.mark.parametrize("part", BASES)
def test_the_names_of_a_contract_exist(part):
    for text, name, kind in described(part):
        assert kind is not None or any(hasattr(module, name) for module in MODULES), text


@pytest.mark.parametrize("part", BASES)
def test_the_methods_of_a_contract_have_the_arguments_of_the_code(part):
    """Of a class that stands by itself, the page may leave out the last arguments."""
    for text, name, kind in described(part):
        found = [vars(module)[name] for module in MODULES if name in vars(module)]
        code = getattr(kind, name, None) if kind else found[0]
        if not text.endswith(")") or ": " in text or not callable(code):
            continue
        arguments = [argument for argument in inspect.signature(code).parameters if argument != "self"]
        printed = text.partition("(")[2].rstrip(")").replace(" ", "").split(",")
        assert [one for one in printed if one] == (arguments if kind else arguments[: len(printed)]), text


@pytest.mark.parametrize("part", [part for part in BASES if part != "contact_part"])
def test_a_contract_has_every_name_of_its_class(part):
    """The remaining names of contact parts are in the module to which their page refers."""
    printed = {bare(text) for row in rows(part) for text in concepts.names(row)}
    assert {name for kind in BASES[part] for name in members(kind) if "model_" not in name} <= (
        printed | NOT_WRITTEN
    )


def test_the_contract_of_contact_parts_has_a_method_of_every_base_class():
    kinds = {kind.__name__ for kind in parts.ContactPart.__subclasses__()}
    assert {row["base class"] for row in rows("contact_part") if "method" in row} == kinds


def written(part, name):
    """The file that ``tisim new`` writes: its docstring, and its code."""
    template = (new.TEMPLATES / f"{TEMPLATES[part][0]}.txt").read_text(encoding="utf-8")
    _, docstring, code = Template(template).substitute(new.fields_of(name)).split('"""', 2)
    return docstring, code.lstrip("\n")


@pytest.mark.parametrize("part", BASES)
def test_the_example_is_what_tisim_new_writes(part):
    name, code = concepts.example(part)
    docstring, other = written(part, name)
    assert code == other
    assert f"docs/contracts/{part}.md" in docstring


@pytest.mark.parametrize("part", BASES)
def test_the_example_has_all_that_is_required(part):
    bases = {
        base.id for node in ast.parse(concepts.example(part)[1]).body for base in getattr(node, "bases", ())
    }
    have = {bare(name) for kind in concepts.used(part) for name in kind}
    for row in rows(part):
        if row["required"] == "yes" and (not row["base class"] or row["base class"] in bases):
            assert {bare(text) for text in concepts.names(row)} <= have


@pytest.mark.parametrize("part", TEMPLATES)
def test_the_short_contract_in_a_written_file_names_what_exists(part):
    lines = written(part, "some_name")[0].splitlines()
    names = [line.partition(" : ")[0].split(", ") for line in lines if " : " in line and line[0] != " "]
    assert len(names) >= 4
    assert all(has(TEMPLATES[part][1], name) for line in names for name in line), names


def test_the_table_of_names_in_the_architecture():
    """If it fails, run: python tests/concepts.py."""
    assert concepts.table() in (ROOT / "docs/architecture.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_example_of_a_stepper_reports_displacements(own_file):
    """For motion by the stepper itself, and by operators."""
    name, code = concepts.example("stepper")
    own_file(f"{name}.py", code)
    stepper = plugins.load(f"{name}.py").SymplecticEuler(control=fixed(0.02).control)
    for way in WAYS:
        assert_lists(crossing(stepper, **way))
