"""The report of explain matches the compiled program: it lists all allocated memory and nothing else."""

import io
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from tests.effects.contact.grains import heap
from tests.scenes import scene
from tests.self_consistent.test_self_consistent import Potential
from tests.steppers.brownian.colloids import colloids
from tests.throwaway import SoftShell
from tisim import Material, MaterialPair, Simulation
from tisim.backend import memory
from tisim.backend.thread import in_taichi_thread
from tisim.cases.agglomeration.scene import BEST
from tisim.cases.agglomeration.scene import scene as agglomeration
from tisim.cases.case import every
from tisim.cases.vibration.scene import scene as vibration
from tisim.describe.explain import COST_OF_ABSENT, brief, explain, known_effects, render
from tisim.describe.explained_parts import explained, explained_materials
from tisim.effects import Granular, MindlinForce, RollingEPSD, Rotation, Walls
from tisim.engine.allocation import Allocation
from tisim.geometry import Plane
from tisim.materials.materials import Materials
from tisim.pairs.half_list import ListSizes
from tisim.population.spatial_sort import SORTED_FROM
from tisim.steppers import Collocation, Trapezoid

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]


@cache
def flow():
    """The flow of grains that agglomerate, and its explanation, which compiles it."""
    made = agglomeration(BEST, 1, grains=60)
    return made, explain(made)


@cache
def explained_bare():
    """Without any effect."""
    made = agglomeration(BEST, 1, grains=60)
    return explain(made.without(*(effect.kind() for effect in made.effects)))


@cache
def explained_pair():
    return explain(pair(SHELL))


@cache
def explained_cloud():
    return explain(vibration(sites=2))


def text(explanation):
    stream = io.StringIO()
    Console(file=stream, width=150).print(render(explanation))
    return stream.getvalue()


def test_every_effect_of_the_flow_is_listed():
    made, explanation = flow()
    assert [part.name for part in explanation.effects] == [effect.kind() for effect in made.effects]
    assert all(part.summary and part.source for part in explanation.effects)
    names = {part.name for part in explanation.effects}
    assert {part.name for part in explanation.absent_effects} == {k.kind() for k in known_effects()} - names
    assert (explanation.particles, explanation.capacity) == (60, 60)
    assert explanation.steps == pytest.approx(made.duration / made.stepper.control.longest)


def test_absent_effects_and_fields():
    whole = agglomeration(BEST, 1, grains=60)
    explanation = explain(
        whole.without(*(e.kind() for e in whole.effects if e.kind() not in ("impact", "friction")))
    )
    absent = {part.name for part in explanation.absent_effects}
    assert {"heating", "cooling", "reaction", "fragmentation", "agglomeration"} <= absent
    assert not absent & {"impact", "friction", "impact_law", "operator", "force"}
    fields = dict(explanation.absent_fields)
    assert "reaction" in fields["temperature"]
    assert "fragmentation" in fields["pieces"]
    assert not {item.name for item in explanation.memory} & set(fields)


def test_without_any_effect_nothing_of_effects_is_compiled():
    explanation = explained_bare()
    assert explanation.effects == ()
    assert {
        item.why for item in explanation.memory if item.bytes and not item.name.endswith(("table", "list"))
    } == {"every scene"}
    assert not {"OpenContacts*", "Bid*", "Resolve*", "MarkLive*", "SumForces"} & set(explanation.phases)


@pytest.mark.slow
def test_memory_equals_the_allocated_memory():
    made, explanation = flow()
    simulation = Simulation(made)
    sizes = {item.name: item.bytes for item in explanation.memory}
    assert {name: sizes[name] for name in simulation.s.bytes()} == simulation.s.bytes()
    assert sizes["position"] == 3 * sizes["radius"]
    assert explanation.phases == tuple(simulation.program.names())
    simulation.close()


def pair(*effects, **more):
    """Two fixed particles under these effects."""
    return scene([[0.0, 0, 0], [1.0, 0, 0]], np.zeros((2, 3)), effects, **more)


SHELL = SoftShell(stiffness=1.0, width=1.0)
BESIDE = {
    "impacts": (lambda: agglomeration(BEST, 1, grains=60), 60),
    "grains": (lambda: heap(np.random.default_rng(1)), 40),
    "sorted": (lambda: heap(np.random.default_rng(1)), SORTED_FROM),
    "sweeps": (lambda: pair(Potential(strength=1.0), SHELL), 2),
    "trapezoid": (lambda: pair(SHELL, stepper=Trapezoid(acceleration="anderson")), 2),
    "collocation": (lambda: pair(SHELL, stepper=Collocation()), 2),
    "diffusion": (lambda: colloids([[0.0, 0, 0]], together=True, hydrodynamics="rotne-prager"), 2),
}
"""Scenes, and capacities for particles, whose steps use every kind of memory besides the state."""


@pytest.mark.parametrize("kind", BESIDE)
@in_taichi_thread
def test_step_memory_equals_the_allocated_memory(kind):
    made, capacity = BESIDE[kind]
    with memory.collected() as trees:
        allocation = Allocation(made(), 3, capacity)
        with memory.collected() as beside:
            allocation.assemble(ListSizes())
    known = sum(buffer.memory.bytes() for buffer in allocation.assembly.buffers)
    assert known == sum(tree.bytes for tree in beside) > 0
    for tree in trees:
        tree.destroy()


LINES, COLUMNS = 45, 100
"""Of a screen."""
CHEAP = ("agglomeration", "blast")
"""Cases whose scenes are explained in a moment: one of many effects, and one of few."""


def short(explanation):
    stream = io.StringIO()
    Console(file=stream, width=COLUMNS).print(brief(explanation))
    return stream.getvalue()


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in CHEAP else pytest.mark.slow) for name in sorted(every())]
)
def test_the_brief_form_of_every_case_fits_a_screen(name):
    explanation = explain(every()[name].scene("default", 0))
    lines = short(explanation).splitlines()
    assert len(lines) <= LINES
    assert max(map(len, lines)) <= COLUMNS
    starts = [line.split()[0] for line in lines if line.strip()]
    assert {part.name for part in explanation.effects} <= set(starts)
    # In one line: the next one has another subject.
    assert starts[starts.index("Left") + 1] == "Cost"


def test_the_brief_form_has_values_memory_and_a_number_of_absent_effects_by_family():
    _, explanation = flow()
    output = short(explanation)
    assert "hardness = 265480 Pa" in output
    assert "heat_capacity = 1796.3 J/(kg K)" in output
    rows = {line.split()[0]: line.split() for line in output.splitlines() if line.strip()}
    # Softening needs the same temperature (8 bytes a grain), which is counted once.
    assert rows["heating"][1:3] == ["480", "bytes"]
    assert rows["softening"][1] == "activation_energy"
    assert "convection" not in rows["cooling"]
    assert "RebuildNearList* > ClearContacts > FindContacts > Rounds* >" in " ".join(output.split())
    assert "SearchRows" not in output
    assert "(0, 0, 0)" not in short(explained_cloud())
    named = " ".join(output.split("Left out")[1].split("Cost")[0].split())
    counted = {name: int(number) for name, number in (item.split() for item in named.split(", "))}
    magnetic = [kind for kind in known_effects() if ".magnetic." in kind.__module__]
    assert counted["magnetic"] == len([kind for kind in magnetic if "sources" not in kind.__module__])
    assert sum(counted.values()) == len(explanation.absent_effects)
    assert "surface_energy" not in counted
    assert len(text(explanation).splitlines()) > 2 * LINES


def test_the_memory_of_the_brief_form_adds_up():
    _, explanation = flow()
    units = {"bytes": 1, "kB": 1e3}
    found = re.findall(r"([\d.]+)\s+(bytes|kB)\b", short(explanation))
    total, *parts = [float(number) * units[unit] for number, unit in found]
    assert total == pytest.approx(explanation.bytes, rel=5e-3)
    assert len(parts) > 6
    assert sum(parts) == pytest.approx(total, rel=1e-2)


def test_a_law_is_shown_with_its_parts_and_long_values_are_cut():
    law = Granular(tangential=MindlinForce(), rolling=RollingEPSD(damping_ratio=0.2))
    walls = Walls(planes=[Plane(point=(0.1 * k, 0.0, 0.0)) for k in range(3)])
    empty = explained_pair()
    rubber, steel = (Material(young=2e8 * k, poisson=0.3, friction=0.1 * k) for k in (1, 2))
    table = {"rubber-steel": MaterialPair(friction=0.7)}
    materials = tuple(explained_materials(Materials({"rubber": rubber, "steel": steel}, table)))
    output = short(replace(empty, effects=(explained(law), explained(walls)), materials=materials))
    assert "mindlin_force; rolling_epsd (damping_ratio = 0.2)" in " ".join(output.split())
    assert "planes.0.point" in output
    assert "planes.2.point" not in output
    assert re.search(r"; \d more", output)
    # The other properties of the pair follow from those of the materials.
    rows = {line.split()[0]: line.split()[1:] for line in output.splitlines() if line.strip()}
    assert rows["rubber-steel"] == ["friction", "=", "0.7"]
    assert "rubber-rubber" not in rows


def test_the_cost_of_absent_effects_is_the_same_in_the_program_and_in_the_documentation():
    for page in ("README.md", "docs/index.md", "docs/performance.md"):
        words = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert COST_OF_ABSENT in words, page
    record = (ROOT / "docs/measurements/compiling.md").read_text(encoding="utf-8")
    assert COST_OF_ABSENT.replace("to", "..") in record
    assert COST_OF_ABSENT in short(explained_pair())


@in_taichi_thread
def test_the_bytes_of_effects_that_are_present_are_as_documented():
    """The fields of the case agglomeration over those of its impacts and agglomeration alone."""
    whole = agglomeration(BEST, 1, grains=60)
    alone = whole.without(*(e.kind() for e in whole.effects if e.kind() not in ("impact", "agglomeration")))
    sizes = []
    for one in (whole, alone):
        with memory.collected() as trees:
            sizes.append(sum(Allocation(one, 1, 60).s.bytes().values()) / 60)
        for tree in trees:
            tree.destroy()
    ratio, (many, few) = f"{sizes[0] / sizes[1]:.2f} times", map(int, sizes)
    readme, page = (
        " ".join((ROOT / file).read_text(encoding="utf-8").split())
        for file in ("README.md", "docs/agglomeration.md")
    )
    assert f"[{ratio} the bytes]" in readme
    assert f"{ratio} the bytes, {many} instead of {few} per grain" in page


def test_parameters_have_units_and_sources():
    output = text(flow()[1])
    assert "hardness = 265480 Pa" in output
    assert "heat_capacity = 1796.3 J/(kg K)" in output
    assert "Z04 Eq. (6.9)" in output
    assert "Rounds" not in output
    assert "Resolve*" in output


def test_parts_of_a_law_and_pairs_of_materials():
    """Under the names of a scene file, with the numbers that kernels get."""
    law = Granular(tangential=MindlinForce(), rolling=RollingEPSD(damping_ratio=0.2))
    materials = {
        "steel": Material(young=2e11, poisson=0.3, friction=0.4, rolling_friction=0.1),
        "rubber": Material(young=2e8, poisson=0.49, friction=0.9, rolling_friction=0.2, stiffness=1.0),
    }
    walls = Walls(planes=[Plane()], motion=Rotation(rate=(0.0, 0.0, 2.0)))
    table = {"rubber-steel": MaterialPair(friction=0.7)}
    granular, body = explained(law), explained(walls)
    assert [part.name for part in granular.all()] == [
        "granular",
        "granular.normal: hertz_material",
        "granular.tangential: mindlin_force",
        "granular.rolling: rolling_epsd",
    ]
    assert granular.parts[2].parameters[0][:2] == ("damping_ratio", "0.2")
    assert [part.name for part in body.parts] == ["walls.motion: rotation"]
    names = ["steel", "rubber", "steel-steel", "steel-rubber", "rubber-rubber"]
    parts = tuple(explained_materials(Materials(materials, table)))
    assert [part.name for part in parts] == names
    mixed = {name: (float(value), text) for name, value, _, text in parts[3].parameters}
    assert mixed["friction"] == (0.7, "given for the pair")
    assert mixed["rolling_friction"] == (pytest.approx(0.02**0.5, rel=1e-5), "geometric mean")
    expected = 1 / ((1 - 0.09) / 2e11 + (1 - 0.49**2) / 2e8)
    assert mixed["E*"][0] == pytest.approx(expected, rel=1e-5)
    # A property that one of the materials lacks is not listed for the pair.
    assert "stiffness" not in mixed
    explanation = explained_bare()
    assert explanation.materials == ()
    output = text(replace(explanation, effects=(granular,), materials=parts))
    assert "rolling_friction = 0.141421" in output
    assert "granular.rolling: rolling_epsd" in output


def test_a_vibrating_cloud_has_no_contact_spin_or_temperature():
    """Z13: only forces on charges; no fields, lists or phases of anything else."""
    explanation = explained_cloud()
    effects = {"lorentz", "electric_field", "magnetic_field", "tether", "near_field"}
    assert {part.name for part in explanation.effects} == effects
    absent = {part.name for part in explanation.absent_effects}
    assert absent == {kind.kind() for kind in known_effects()} - effects
    assert {"contact", "contact_friction", "impact", "heating", "cooling", "agglomeration"} <= absent
    core = {"position", "velocity", "mass", "radius", "id"}
    before = {"position_before", "velocity_before", "force_before", "iterate_change"}
    more = {"parameter table", "sums of the iteration"}
    assert {item.name for item in explanation.memory} == core | before | more | {"charge", "anchor", "force"}
    fields = dict(explanation.absent_fields)
    assert "heating" in fields["temperature"]
    forbidden = ("list", "contact", "touch", "spin", "torque", "temperature", "heat")
    memory_names = " ".join(item.name for item in explanation.memory)
    assert not [word for word in forbidden if word in memory_names]
    iteration = ["SumTrialForces**", "Correct**", "JudgeIteration**"]
    step = [
        "Begin",
        "SaveState",
        "ChooseTrapezoidStep*",
        "PredictEnd*",
        *iteration,
        "RestoreState*",
        "Decide*",
        "AdvanceClock",
        "FinishStep",
    ]
    assert list(explanation.phases) == step
