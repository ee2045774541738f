"""The reference texts are complete: parts, parameters and options have texts; templates make parts."""

import re
import tomllib

import numpy as np
import pytest

from tisim import InputError
from tisim.backend.taichi import ti
from tisim.components import serialization
from tisim.components.arrays import Numbers, Rows
from tisim.components.component import Component, Vector, option, parameter
from tisim.components.invalid import text_of, unit_of
from tisim.describe import docstrings, reference, template
from tisim.describe.explain import known_effects
from tisim.effects import Force

ENTRIES = [entry for entry in reference.entries() if entry.kind.__module__.startswith("tisim.")]
ALL = pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
TABLES = [entry for entry in ENTRIES if entry.toml]
"""Without rows of lists, which are described in the tables of their sources."""
LISTS = (
    tuple[float, ...],
    tuple[float, ...] | None,
    tuple[Vector, ...],
    np.ndarray,
    Numbers | None,
    Rows | None,
)
PHYSICAL = (float, float | None, Vector, Vector | None, *LISTS)


class Buoy(Force):
    """Water carries a buoy, F = k z.

        F = k z

    z is its depth.

    Source: Z99 Eq. (1).
    """

    fields = ("radius",)
    stiffness: float = parameter("N/m", "stiffness k of the water", examples=[2.0], gt=0, le=9)
    still: bool = option("whether the water is still", True)

    @ti.func
    def force(self, s, w, i, t):
        return -self.stiffness(w) * s.position[w, i]


@ALL
def test_every_part_has_a_description(entry):
    assert re.fullmatch(r"[A-Z].*[^.:]", entry.summary)
    assert len(entry.summary) <= 120
    assert "``" not in entry.summary


@ALL
def test_every_setting_has_a_text_and_every_quantity_a_unit(entry):
    for name, info in entry.kind.model_fields.items():
        assert text_of(info), name
        declared = isinstance(info.json_schema_extra, dict) and "unit" in info.json_schema_extra
        assert declared == (info.annotation in PHYSICAL), name


@ALL
def test_short_citations_have_a_full_reference(entry):
    short = set(re.findall(r"\b[BLZ]\d\d\b", f"{entry.source} {entry.body}"))
    assert short <= set(docstrings.PUBLICATIONS)


@pytest.mark.parametrize("entry", TABLES, ids=lambda entry: entry.name)
def test_a_template_makes_its_part_with_its_defaults(entry):
    family = reference.FAMILIES[entry.family]
    table = tomllib.loads(entry.toml)
    for key in family.place.replace("NAME", entry.name).split("."):
        table = table[key]
    part = serialization.from_dict(family.base, {"kind": entry.name, **table}, "template")
    assert type(part) is entry.kind
    for name, info in template.fields(entry.kind).items():
        has_example = info.is_required() or info.examples
        assert has_example or getattr(part, name) == info.get_default(call_default_factory=True), name
        assert f"# {text_of(info)}" in entry.toml or name in dict(entry.kind.lists()), name


def test_user_effects_are_listed():
    buoy = reference.find("buoy")
    assert buoy.summary == "Water carries a buoy, F = k z"
    assert buoy.body == "    F = k z\n\nz is its depth."
    assert buoy.source == "Z99 Eq. (1)"
    assert buoy.fields == (("radius", "m"),)
    assert [(one.name, one.unit, one.rule, one.default) for one in buoy.settings] == [
        ("stiffness", "N/m", "> 0, <= 9", ""),
        ("still", "", "true or false", "true"),
    ]
    assert buoy.toml.splitlines() == [
        "[effects.buoy]",
        "# stiffness k of the water (N/m; an example)",
        "stiffness = 2.0",
        "# whether the water is still",
        "still = true",
    ]
    assert Buoy not in known_effects()


def test_only_rows_of_lists_have_no_table_of_their_own():
    assert {entry.family for entry in ENTRIES if not entry.toml} == {
        "bodies",
        "contact_parts",
        "grain_classes",
        "materials",
        "particle_shapes",
        "shapes",
    }


def test_families_are_disjoint_and_complete():
    names = [entry.name for entry in ENTRIES]
    assert len(set(names)) == len(names)
    kinds = {kind.kind() for kind in Component.known().values() if kind.__module__.startswith("tisim.")}
    # Clump templates are made in Python only.
    assert kinds - set(names) == {"clump", "component", "scene"}


def test_needs_of_parts():
    needs = {entry.name: entry.needs for entry in ENTRIES}
    assert needs["friction"] == ("impact",)
    assert needs["contact_bond"] == ("contact or hertz", "a stepper with inertia, not brownian")
    assert needs["lorentz"][0] == "a source of electric_field or magnetic_flux_density"
    assert needs["sphere"] == ("magnetic_spheres, a row of its spheres or pore_flow, a row of its spheres",)
    assert needs["collocation"] == ("a step control: stage_control",)
    # If a test of another file defines an event of its own, the text is "no impact or recorder".
    assert any(one.startswith("no impact") for one in needs["capture"])


def test_an_unknown_name_gives_near_ones():
    lists = r"^part must be one of \d+ that 'tisim effects' lists, such as .*\bwalls, .*; received 'wallz'"
    with pytest.raises(InputError, match=lists):
        reference.find("wallz")
    with pytest.raises(InputError, match=r"received 'mei'; did you mean 'mie'\?$"):
        reference.find("mei")


def test_units_equal_the_declaration():
    impact = reference.find("impact")
    units = {name: unit_of(info) for name, info in template.fields(impact.kind).items()}
    assert {one.name: one.unit for one in impact.settings} == units
    assert units["hardness"] == "Pa"
