"""A description of a compiled scene: its effects, memory and phases of a step, and the effects it leaves
out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.describe import reference
from tisim.describe.explained_parts import Part, explained, explained_kind, explained_materials
from tisim.effects.base import Effect
from tisim.engine.assembly import needed_fields
from tisim.engine.simulation import Simulation
from tisim.materials.materials import Materials
from tisim.scene.scene import Scene
from tisim.state.fields import CORE


@dataclass(frozen=True)
class Memory:
    """Memory allocated for one world of the scene. bytes : its size. why : the parts that need it."""

    name: str
    bytes: int
    why: str


@dataclass(frozen=True)
class Explanation:
    """A description of a scene, as compiled for one world.

    particles, capacity : number of particles at the start, and the largest number.
    steps : smallest number of steps of a run.
    reason : why the stepper was chosen automatically; empty if the scene names one.
    critical : critical time steps (s) by effect, the shortest first.
    materials : the materials by name, then the contact properties of each two of them.
    memory : every allocation, fields first.
    phases : the phases of a step, in order; phases marked * are repeated until no particle waits.
    absent_effects : known effects that the scene does not have.
    absent_fields : (field, effects that would need it), not allocated.
    """

    name: str
    particles: int
    capacity: int
    steps: float
    schedule: str
    precision: str
    effects: tuple[Part, ...]
    others: tuple[Part, ...]
    reason: str
    critical: Mapping[str, float]
    materials: tuple[Part, ...]
    memory: tuple[Memory, ...]
    phases: tuple[str, ...]
    absent_effects: tuple[Part, ...]
    absent_fields: tuple[tuple[str, str], ...]

    @property
    def bytes(self) -> int:
        return sum(item.bytes for item in self.memory)


def explain(scene: Scene) -> Explanation:
    """Return the explanation of a scene: it is composed with the current settings, but not run, and its
    memory is freed."""
    simulation = Simulation(scene)
    try:
        memory = tuple(_memory(simulation, scene))
        phases = tuple(simulation.program.names())
        present = {field.name for field in simulation.s.fields}
        capacity, schedule = simulation.s.capacity, simulation.schedule
        precision = simulation.runtime.precision
    finally:
        # At the next launch Taichi checks the shapes of vectors, and it would find none for these.
        simulation.s.read("count")
        simulation.close()
    absent = [kind for kind in known_effects() if kind not in {type(e) for e in scene.effects}]
    return Explanation(
        name=scene.name,
        particles=len(scene.particles.masses(scene.seed)),
        capacity=capacity,
        steps=scene.stepper.min_steps(scene.effects, scene.duration),
        schedule=schedule,
        precision=precision,
        effects=tuple(explained(effect) for effect in scene.acting()),
        others=(explained(scene.domain), explained(scene.stepper)),
        reason="" if "stepper" in scene.model_fields_set else scene.choice().reason,
        critical=scene.critical_steps(),
        materials=tuple(explained_materials(Materials(scene.materials, scene.material_pairs))),
        memory=memory,
        phases=phases,
        absent_effects=tuple(explained_kind(kind) for kind in absent),
        absent_fields=tuple(_absent_fields(absent, present)),
    )


def known_effects() -> list[type[Effect]]:
    """Return every effect of the package, sorted by name."""
    kinds_by_family = (
        reference.FAMILIES[family].kinds().values() for family in ("effects", "operators", "sources")
    )
    mine = [kind for kinds in kinds_by_family for kind in kinds if kind.__module__.startswith("tisim.")]
    return sorted(mine, key=lambda kind: kind.kind())  # type: ignore[arg-type]


def _memory(simulation: Simulation, scene: Scene) -> Iterator[Memory]:
    users = {
        need if isinstance(need, str) else need.name: why
        for need, why in needed_fields(scene.acting(), scene.stepper).items()
    }
    core = {field.name for field in CORE}
    for name, size in simulation.s.bytes().items():
        yield Memory(name, size, "every scene" if name in core else users[name])
    real = 8 if simulation.runtime.precision == "f64" else 4
    yield Memory("parameter table", simulation.worlds * simulation.table.slots * real, "effects' parameters")
    if simulation.table.array_bytes:
        yield Memory("tables, of all worlds", simulation.table.array_bytes, "effects that look numbers up")
    for buffer in simulation.assembly.buffers:
        yield Memory(buffer.what, buffer.memory.bytes(), buffer.why)


def _needs(kind: type[Effect]) -> list[str]:
    return [need if isinstance(need, str) else need.name for need in kind.fields]


def _absent_fields(absent: list[type[Effect]], present: set[str]) -> Iterator[tuple[str, str]]:
    lacking: dict[str, list[str]] = {}
    for kind in absent:
        for name in _needs(kind):
            if name not in present:
                lacking.setdefault(name, []).append(kind.kind())
    for name, kinds_ in lacking.items():
        yield name, ", ".join(kinds_)


def brief(explanation: Explanation) -> RenderableType:
    """Return a short form of the explanation that fits one screen: effects and materials with their
    parameters, the stepper, and counts of all other parts."""
    made_of = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    made_of.add_column(no_wrap=True)
    made_of.add_column(overflow="fold")
    parts = (*explanation.effects, explanation.others[0], *explanation.materials)
    for part in (one for whole in parts for one in whole.all()):
        made_of.add_row(Text(part.name, "bold"), part.summary)
        if part.parameters:
            values = (
                f"{name} = {value} {unit}".rstrip()
                for name, value, unit, _ in part.parameters
                if value not in ("none", "0 in all")
            )
            made_of.add_row("", Text("; ".join(values), "dim"))
    absent = (
        f"Not compiled, nothing allocated: {len(explanation.absent_effects)} other effects of tisim, "
        f"{len(explanation.absent_fields)} fields"
    )
    more = "--all lists them, the memory, the phases of a step, and the source of each part"
    return Group(_head(explanation), "", _time_steps(explanation), "", made_of, "", absent, more)


def _head(explanation: Explanation) -> Text:
    return Text.assemble(
        (explanation.name, "bold"),
        f": {explanation.particles} particles, room for {explanation.capacity}; {explanation.precision}; "
        f"schedule '{explanation.schedule}'; {_bytes(explanation.bytes)} per world; "
        f"at least {explanation.steps:.3g} steps",
    )


def render(explanation: Explanation) -> RenderableType:
    """Return the whole explanation for a terminal."""
    what = _table("Parts of the scene", "effect", "description", "source")
    for whole in (*explanation.effects, *explanation.others):
        for part in whole.all():
            _add(what, part)
    materials = _table("Materials", "material", "description", "source")
    for part in explanation.materials:
        _add(materials, part)
    memory = _table("Memory allocated", "", "bytes", "for")
    memory.columns[1].justify = "right"
    for item in explanation.memory:
        memory.add_row(item.name, f"{item.bytes:,}", item.why)
    phases = Text.assemble(("Phases of a step  ", "italic"), " > ".join(explanation.phases))
    absent = _table("Effects left out (not compiled, nothing allocated)", "effect", "description", "source")
    for part in explanation.absent_effects:
        absent.add_row(part.name, part.summary, part.source)
    fields = [f"{name} (of {kinds_})" for name, kinds_ in explanation.absent_fields]
    lacking = Text.assemble(("Fields not allocated  ", "italic"), "; ".join(fields) or "none")
    left_out = absent if explanation.absent_effects else Text("No effect of tisim is left out.")
    of_materials = (materials, "") if explanation.materials else ()
    return Group(
        _head(explanation),
        "",
        _time_steps(explanation),
        "",
        what,
        "",
        *of_materials,
        memory,
        "",
        phases,
        "",
        left_out,
        lacking,
    )


def _time_steps(explanation: Explanation) -> RenderableType:
    """Return the stepper, the reason if it was chosen automatically, and the critical time steps."""
    stepper = explanation.others[1].name
    why = (
        f"{stepper}, chosen: {explanation.reason}" if explanation.reason else f"{stepper}, given by the scene"
    )
    head = Text.assemble(("Stepper  ", "italic"), why)
    if not explanation.critical:
        return head
    steps = "; ".join(f"{label} {step:.3g} s" for label, step in explanation.critical.items())
    return Group(
        head, Text.assemble(("Critical time steps, 2/omega of the stiffest motion  ", "italic"), steps)
    )


def _add(table: Table, part: Part) -> None:
    """Add a part and its parameters to a table."""
    table.add_row(part.name, part.summary, part.source)
    for name, value, unit, text in part.parameters:
        table.add_row("", f"{name} = {value} {unit}".rstrip(), text)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0), header_style="dim")
    for column in columns:
        table.add_column(column, overflow="fold")
    return table


def _bytes(size: int) -> str:
    for unit in ("bytes", "kB", "MB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000  # type: ignore[assignment]
    return f"{size:.3g} GB"
