"""The contract of a case."""

import pytest

from cases.case import every
from tisim import InputError

INVERSE = [name for name, case in every().items() if case.problem]


@pytest.mark.parametrize("name", INVERSE)
def test_variants_are_those_of_the_inverse_problem(name):
    case = every()[name]
    size = next(key for key, one in case.sizes.items() if one.search is not None)
    with pytest.raises(InputError, match=f"variant must be one of {', '.join(case.variants)}; received ''"):
        case.problem(size, "")
    made = [case.problem(size, variant) for variant in case.variants]
    assert len({problem.name for problem in made}) == len(made)
