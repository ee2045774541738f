"""Judges the numbers of a hard case."""


def holds(case, *arguments):
    """Assert that all numbers of a hard case are within their bounds.

    arguments : of its measurement, for another stepper or law than the one of the case.
    """
    outcomes = case.run(*arguments)
    assert outcomes
    for one in outcomes:
        assert one.ok, f"{case.name}: {one.bound.quantity} is {one.measured}, allowed {one.bound.allowed}"
