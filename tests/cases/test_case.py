"""The contract of a case, and the checks of a case."""

import importlib
import importlib.util
import inspect

import pytest

from tisim import InputError
from tisim.analysis import Mean
from tisim.cases.case import Check, Claim, Late, Shown, every

INVERSE = [name for name, case in every().items() if case.problem]


@pytest.mark.parametrize("name", INVERSE)
def test_variants_of_the_inverse_problem(name):
    case = every()[name]
    size = next(key for key, one in case.sizes.items() if one.search is not None)
    with pytest.raises(InputError, match=f"variant must be one of {', '.join(case.variants)}; received ''"):
        case.inverse(size, "")
    problems = [case.problem(size, variant) for variant in case.variants]
    assert len({problem.name for problem in problems}) == len(problems)


def test_a_case_has_a_scene_of_its_own_for_some_variants():
    flow, capture = every()["agglomeration"], every()["capture"]
    assert flow.scene_of("small", 2) == flow.scene("small", 2)
    charged = flow.scene_of("small", 2, "fields")
    assert {"near_field", "lorentz", "dipole_dipole"} <= {effect.label for effect in charged.effects}
    assert charged.seed == 2
    for case, variant, rule in (
        (flow, "paper", "one of fields; received 'paper'"),
        (capture, "hard", "left out, as capture has one scene; received 'hard'"),
    ):
        with pytest.raises(InputError, match=f"variant must be {rule}"):
            case.scene_of("default", 0, variant)


ARGUMENTS = {"check": (), "problem": ("default", ""), "quantities": (None,), "pictures": (None,),
             "spectra": (None,),
             "figures": ("default", None), "calibration": ("default", "", None)}  # fmt: skip

PACKED = ("packing", "packed_filter")
"""Cases whose starts are packings, which take long."""


@pytest.mark.parametrize("name", every())
def test_late_imports_of_a_case_exist_and_accept_their_arguments(name):
    functions = {field: value for field, value in vars(every()[name]).items() if isinstance(value, Late)}
    assert functions.keys() <= ARGUMENTS.keys()
    for field, late in functions.items():
        inspect.signature(late.function).bind(*ARGUMENTS[field])


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in PACKED else ()) for name in every()]
)
def test_every_scene_of_moderate_size_has_a_valid_start(name):
    """Its effects accept its initial state; nothing is compiled."""
    case, begun = every()[name], 0
    for size in case.sizes:
        for variant in (None, *case.scenes):
            scene = case.scene_of(size, 1, variant)
            if scene.capacity() < 5000:
                start = scene.start()
                for effect in scene.acting():
                    effect.check_start(start, scene)
                begun += 1
    assert begun > 0


def test_claim_holds_when_all_of_the_interval_does():
    assert Claim("", Mean(0.5, 0.1), least=0.39).ok
    assert not Claim("", Mean(0.5, 0.1), least=0.41).ok
    assert Claim("", Mean(0.5, 0.1), most=0.61).ok
    assert not Claim("", Mean(0.5, 0.1), most=0.59).ok
    assert Claim("", Mean(0.5, 0.1), most=0.6).cells[:2] == ("0.50 ± 0.10", "below 0.6")


def test_shown_values_are_not_judged():
    assert Shown("", Mean(1.0, 0.5), "2").cells == ("1.00 ± 0.50", "2", "", "")
    assert Shown("", 1.23456).cells[0] == "1.235"
    assert Shown("", 1.0).ok is None


def test_checks_are_checks():
    assert Check("", 1.0, 1.0, 0.0).cells[3] == "0.0e+00"


@pytest.mark.parametrize("name", every())
def test_the_pictures_of_a_case_are_drawn_by_the_command_line(name):
    """A case that draws pictures of a run names them in its CASE."""
    spec = importlib.util.find_spec(f"tisim.cases.{name}.figures")
    figures = importlib.import_module(spec.name) if spec else None
    assert (every()[name].pictures is not None) or not hasattr(figures, "pictures")
