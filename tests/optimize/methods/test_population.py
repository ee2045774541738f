"""Options of a generation that are not given follow from those that are, for every method and case."""

import functools

import numpy as np
import pytest

from tests.optimize.fake_runs import fake_problem
from tisim import InputError
from tisim.cases import case as catalogue
from tisim.cli.scene_arguments import with_changes
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.base import every, find
from tisim.optimize.methods.breeding_settings import Breeding
from tisim.optimize.settings import Settings, proposed, without_dependent_options

GENES = 3
POPULATIONS = range(2, 101)
REFUSED = {
    "cma-es": (lambda n: n < 4, "search.options.population must be at least 4; received {}"),
}
"""The reason for a real limit: too few individuals to adapt a covariance."""
SURROGATE = ("gaussian-process", "genetic")
"""Methods with a generation 0 of a different size, whose second generation takes 0.05 s or more."""
USUAL = {
    "of no case": {},
    "vibration": {"options": {"population": 8}},
    "agglomeration, as published": {"method": "zohdi", "options": {"population": 10, "parents": 4}},
    "of 24 and 8": {"method": "zohdi", "options": {"population": 24, "parents": 8}},
    "mrf_shear": {"options": {"population": 8, "first": 12}},
    "granular_bench": {"method": "cma-es", "options": {"population": 8, "sigma": 0.2}},
}


@functools.cache
def generations(name, **options):
    """Sizes of the first two generations of a method, and the number of new individuals in the second."""
    kind = find(name)
    method = kind(fake_problem(GENES).genome, 1, kind.Options(**options), seed=1)
    first = method.ask()
    for rank, individual in enumerate(first):
        individual.know((FitnessEstimate.certain(float(rank)),))
    method.tell(first, first[:1])
    second = method.ask()
    return (len(first), len(second)), sum(not individual.fitness.valid for individual in second)


def settings_of(usual, method, options):
    """Settings as made by the command line: --method, --population or --set, for a case."""
    wishes = {f"options.{name}": value for name, value in options.items()}
    return Settings(
        **with_changes(
            without_dependent_options(proposed(fake_problem(GENES), usual, method), wishes), wishes
        )
    )


def test_the_table_lists_the_existing_cases():
    searches = [case.sizes["default"].search for case in catalogue.every().values() if case.problem]
    options = [search["options"] for search in searches if "options" in search]
    assert all(any(usual.get("options") == own for usual in USUAL.values()) for own in options)


@pytest.mark.parametrize("case", USUAL)
@pytest.mark.parametrize("method", every())
def test_every_population_is_accepted_or_refused_for_a_real_reason(case, method):
    unfit, message = REFUSED.get(method, (lambda n: False, None))
    for population in (2, 3, 12, 33) if method in SURROGATE else POPULATIONS:
        if unfit(population):
            with pytest.raises(InputError) as error_info:
                settings_of(USUAL[case], method, {"population": population})
            assert len(str(error_info.value).splitlines()) == 1
            assert message.format(population) in str(error_info.value)
            continue
        first = {"first": population} if method in SURROGATE else {}
        settings = settings_of(USUAL[case], method, {"population": population, **first})
        usual = USUAL[case]
        spread = {"sigma"} & usual.get("options", {}).keys() if usual.get("method") == method else ()
        own = {name: usual["options"][name] for name in spread}
        wanted = {**own, "population": population, **first}
        alone = Settings(method=method, options=wanted)
        assert settings.options == alone.options, "the same from Python"
        sizes, new = generations(method or settings.method, **wanted)
        assert sizes == (population, population)
        assert new > 0


def test_proportions_are_the_published_ones():
    assert (Breeding().population, Breeding().parents, Breeding().bred) == (20, 6, 6)
    for population in POPULATIONS:
        breeding = Breeding(population=population)
        assert breeding.bred in (breeding.parents, breeding.parents - 1)
        assert abs(breeding.parents - 0.3 * population) <= 1.0 or population < 4
    for usual in USUAL.values():
        options = usual.get("options", {})
        if "parents" in options:
            assert Breeding(population=options["population"]).parents == options["parents"]


@pytest.mark.parametrize(
    ("options", "population", "parents", "bred"),
    [
        ({"parents": 2}, 20, 2, 2),
        ({"parents": 10}, 20, 10, 10),
        ({"parents": 12}, 40, 12, 12),
        ({"parents": 5}, 20, 5, 4),
        ({"offspring": 4}, 20, 6, 4),
        ({"offspring": 12}, 40, 12, 12),
        ({"population": 8, "parents": 6}, 8, 6, 2),
        ({"population": 8, "offspring": 4}, 8, 4, 4),
        ({"population": 100, "offspring": 0}, 100, 30, 0),
        ({"population": np.int64(8)}, 8, 2, 2),
        ({"parents": 12, "offspring": 10}, 37, 12, 10),
    ],
)
def test_given_options_stay_and_the_others_follow(options, population, parents, bred):
    breeding = Breeding(**options)
    assert (breeding.population, breeding.parents, breeding.bred) == (population, parents, bred)


def test_parents_alone_leave_the_population_of_the_case():
    settings = settings_of(USUAL["of 24 and 8"], None, {"parents": 4})
    assert (settings.options.population, settings.options.parents) == (24, 4)


@pytest.mark.parametrize("options", [[8], None, "population", {1: 8}])
def test_options_are_given_by_name(options):
    with pytest.raises(
        InputError, match=r"search\.options must be settings of the method, by name; received"
    ):
        Settings(options=options)


def test_a_non_numeric_option_is_reported():
    for wrong in ("many", [8], None, 2.5):
        with pytest.raises(InputError, match=r"search\.options\.population must be a whole number; received"):
            Breeding(population=wrong)
    with pytest.raises(InputError, match="method must be one of"):
        Settings(method=["zohdi"])


@pytest.mark.parametrize("same", [float, str, np.int64, np.float64])
@pytest.mark.parametrize("options", [{"population": 5}, {"parents": 12}, {"offspring": 12}])
def test_numbers_are_accepted_in_every_notation(options, same):
    """As in ``--set search.options.population=5.0``; a file may also contain the number as text."""
    assert Breeding(**{name: same(number) for name, number in options.items()}) == Breeding(**options)


def test_non_numeric_options_are_refused():
    with pytest.raises(InputError, match=r"population must be .*; received 5\.5"):
        Breeding(population=5.5)
