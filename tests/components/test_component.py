"""Validated plain data: allowed parameters, error messages, and structure."""

from typing import ClassVar

import numpy as np
import pytest

from tisim import InputError
from tisim.components.component import Component, Vector, option, parameter
from tisim.components.invalid import text_of, unit_of
from tisim.errors import must


class SampleSpring(Component):
    """A component with one parameter of each kind."""

    stiffness: float = parameter("N/m", "stiffness k of the spring", gt=0)
    axis: Vector = parameter("", "axis", (0.0, 0.0, 1.0))
    share: float = parameter("", "share", 0.5, ge=0, le=1)
    stiff: bool = False
    order: int = option("order of the spring", 2, ge=1)
    requires: ClassVar = ()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "sample_spring.stiffness must be given (stiffness k of the spring, N/m); received nothing"),
        ({"stiffness": 0}, "sample_spring.stiffness must be greater than 0.0; received 0"),
        ({"stiffness": -1.5}, "sample_spring.stiffness must be greater than 0.0; received -1.5"),
        ({"stiffness": float("nan")}, "sample_spring.stiffness must be a finite number; received nan"),
        ({"stiffness": float("inf")}, "sample_spring.stiffness must be a finite number; received inf"),
        ({"stiffness": "stiff"}, "sample_spring.stiffness must be a number; received 'stiff'"),
        ({"stiffness": [1.0]}, "sample_spring.stiffness must be a number; received [1.0]"),
        ({"stiffness": None}, "sample_spring.stiffness must be a number; received None"),
        ({"stiffness": 1, "share": 1.5}, "sample_spring.share must be at most 1.0; received 1.5"),
        ({"stiffness": 1, "share": -0.5}, "sample_spring.share must be at least 0.0; received -0.5"),
        (
            {"stiffness": 1, "stifness": 2},
            "sample_spring.stifness must be a known key: stiffness, axis, share, stiff or order; received 2; "
            "did you mean 'stiffness'?",
        ),
        (
            {"stiffness": 1, "stiff": "perhaps"},
            "sample_spring.stiff must be true or false; received 'perhaps'",
        ),
        ({"stiffness": 1, "order": 1.5}, "sample_spring.order must be a whole number; received 1.5"),
        ({"stiffness": 1, "order": 0}, "sample_spring.order must be at least 1; received 0"),
        ({"stiffness": 1, "axis": 3.0}, "sample_spring.axis must be a list; received 3.0"),
        ({"stiffness": 1, "axis": (0, 1, "z")}, "sample_spring.axis.2 must be a number; received 'z'"),
        ({"stiffness": 1, "axis": (0, 1)}, "sample_spring.axis.2 must be given; received nothing"),
    ],
)
def test_messages_state_rule_and_received_value(settings, message):
    with pytest.raises(InputError) as fault:
        SampleSpring(**settings)
    assert str(fault.value) == message


def test_a_list_of_four_is_refused_as_vector():
    with pytest.raises(InputError, match=r"sample_spring\.axis must be .*; received"):
        SampleSpring(stiffness=1, axis=(0, 0, 1, 0))


def test_every_error_has_its_line():
    with pytest.raises(InputError) as fault:
        SampleSpring(stiffness=-1, share=2, colour="red")
    lines = str(fault.value).splitlines()
    assert len(lines) == 3
    assert all(" must be " in line and "; received " in line for line in lines)


def test_frozen_named_and_with_units():
    part = SampleSpring(stiffness=2)
    with pytest.raises(Exception, match="frozen"):
        part.stiffness = 3.0
    assert SampleSpring.kind() == "sample_spring"
    assert Component.named("sample_spring", "part") is SampleSpring
    with pytest.raises(InputError, match=r"^part must be one of .*sample_spring.*; received 'sample_sprig'$"):
        Component.named("sample_sprig", "part")
    assert unit_of(SampleSpring.model_fields["stiffness"]) == "N/m"
    assert unit_of(SampleSpring.model_fields["stiff"]) == ""
    assert text_of(SampleSpring.model_fields["order"]) == "order of the spring"
    assert text_of(SampleSpring.model_fields["stiff"]) == ""


def test_parameters_vary_and_options_are_structure():
    """Floats and vectors may differ between worlds; every other option is compiled in."""
    part = SampleSpring(stiffness=2, axis=(1, 2, 3))
    assert [(name, size) for name, _, size in part.parameters()] == [
        ("stiffness", 1),
        ("axis", 3),
        ("share", 1),
    ]
    assert part.values() == [2.0, 1.0, 2.0, 3.0, 0.5]
    assert part.structure() == SampleSpring(stiffness=9, share=0.1).structure()
    assert part.structure() != SampleSpring(stiffness=2, stiff=True).structure()
    assert part.structure() != SampleSpring(stiffness=2, order=3).structure()


@pytest.mark.parametrize("text", ["", 0.5, None])
def test_a_parameter_without_a_text_is_refused(text):
    with pytest.raises(TypeError, match="parameter must be given a text after its unit; received"):
        parameter("m", text)
    with pytest.raises(TypeError, match="option must be given a text first; received"):
        option(text)


class SampleRow(Component):
    """A row of a list."""

    radius: float = parameter("m", "radius", gt=0)
    centre: Vector = parameter("m", "centre", (0.0, 0.0, 0.0))


class SampleList(Component):
    """A component with a list of rows, whose number may differ between worlds."""

    scale: float = parameter("", "scale", 1.0)
    rows: tuple[SampleRow, ...]


class SampleFilledList(Component):
    """A component with a list of at least one row."""

    rows: tuple[SampleRow, ...] = option("rows", min_length=1)


def test_a_wrong_row_does_not_make_its_list_too_short():
    for given, message in (
        ([{"radius": -1}], "sample_filled_list.rows.0.radius must be greater than 0.0; received -1"),
        ([], "sample_filled_list.rows must be a list of 1; received []"),
    ):
        with pytest.raises(InputError) as fault:
            SampleFilledList(rows=given)
        assert str(fault.value) == message


def test_a_list_of_rows_varies_in_number_too():
    """Up to a capacity, the number of rows is no structure; messages say which row is wrong."""
    few, many = ([SampleRow(radius=1)] * n for n in (0, SampleRow.least_rows))
    assert list(SampleList.lists()) == [("rows", SampleRow)]
    assert [name for name, _, _ in SampleList.parameters()] == ["scale"]
    assert SampleList(rows=few).structure() == SampleList(rows=many, scale=2).structure()
    assert SampleList(rows=[*many, *many]).structure() != SampleList(rows=many).structure()
    with pytest.raises(InputError) as fault:
        SampleList(rows=[{"radius": 1}, {"radius": -1}])
    assert str(fault.value) == "sample_list.rows.1.radius must be greater than 0.0; received -1"
    with pytest.raises(InputError) as fault:
        SampleList(rows=3)
    assert str(fault.value) == "sample_list.rows must be a list; received 3"
    for kind in (SampleList, SampleFilledList):
        rule = "must be a list or tuple of sample_row; received SampleRow"
        with pytest.raises(InputError, match=f"^{kind.kind()}.rows {rule}"):
            kind(rows=SampleRow(radius=1))


def test_must():
    must(True, "x", "y", "z")
    with pytest.raises(InputError, match=r"^x must be above 3; received 2$"):
        must(False, "x", "above 3", 2)
    assert issubclass(InputError, ValueError)


def test_numpy_numbers_are_numbers():
    assert SampleSpring(stiffness=np.float64(2.5), axis=np.arange(3.0).tolist()).values()[0] == 2.5
