"""What a scene is made of once compiled - effects, memory, phases of a step - and what it leaves out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.components.component import Component
from tisim.components.invalid import text_of, unit_of
from tisim.effects.base import Effect
from tisim.engine import docstrings, reference
from tisim.engine.assembly import needed_fields
from tisim.engine.simulation import Simulation
from tisim.scene.scene import Scene
from tisim.worlds.fields import CORE

ROWS_SHOWN = 3
"""This many rows of a list are shown."""


@dataclass(frozen=True)
class Part:
    """A part is an effect, the domain or the step control of a scene.

    name : in files. summary : one line. source : where the law is from. parameters : name, value, unit and
    text of each.
    """

    name: str
    summary: str
    source: str
    parameters: tuple[tuple[str, str, str, str], ...]


@dataclass(frozen=True)
class Memory:
    """This memory is allocated for one world of the scene. bytes : its size. why : which parts need it."""

    name: str
    bytes: int
    why: str


@dataclass(frozen=True)
class Explanation:
    """An explanation describes a scene, as one world of it is compiled.

    particles, capacity : at the start, and room for. steps : that a run takes at least. memory : every
    allocation, fields first. phases : of a step, in order; those with * are repeated until nothing waits.
    absent_effects : known, and left out.
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
    memory: tuple[Memory, ...]
    phases: tuple[str, ...]
    absent_effects: tuple[Part, ...]
    absent_fields: tuple[tuple[str, str], ...]

    @property
    def bytes(self) -> int:
        return sum(item.bytes for item in self.memory)


def explain(scene: Scene) -> Explanation:
    """Compose the scene under the running settings, look at it, and give its memory back; run nothing."""
    simulation = Simulation(scene)
    try:
        memory = tuple(_memory(simulation, scene))
        phases = tuple(simulation.program.names())
        present = {field.name for field in simulation.s.fields}
        capacity, schedule = simulation.s.capacity, simulation.schedule
        precision = simulation.runtime.precision
    finally:
        # Taichi checks the shapes of vectors at the next launch, and of these it would find none.
        simulation.s.read("count")
        simulation.close()
    absent = [kind for kind in known_effects() if kind not in {type(e) for e in scene.effects}]
    return Explanation(
        name=scene.name,
        particles=len(scene.particles.masses(scene.seed)),
        capacity=capacity,
        steps=scene.stepper.fewest(scene.effects, scene.duration),
        schedule=schedule,
        precision=precision,
        effects=tuple(_part(effect) for effect in scene.acting()),
        others=(_part(scene.domain), _part(scene.stepper), _part(scene.stepper.control)),
        memory=memory,
        phases=phases,
        absent_effects=tuple(_what(kind) for kind in absent),
        absent_fields=tuple(_absent_fields(absent, present)),
    )


def known_effects() -> list[type[Effect]]:
    """Return every effect of the package, by name."""
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


def _part(spec: Component) -> Part:
    return replace(_what(type(spec), tuple(_values(spec))), name=spec.label)


def _what(kind: type[Component], values: tuple[tuple[str, str, str, str], ...] = ()) -> Part:
    return Part(kind.kind(), docstrings.summary(kind), docstrings.source(kind), values)


def _values(spec: Component, within: str = "") -> Iterator[tuple[str, str, str, str]]:
    """Yield (name, value, unit, text) of each parameter; of a long list, of its first rows."""
    lists = dict(spec.lists())
    for name, info in type(spec).model_fields.items():
        value = getattr(spec, name)
        if name == "name":
            continue  # It stands at the head.
        if name in lists:
            for k, row in enumerate(value[:ROWS_SHOWN]):
                yield from _values(row, f"{within}{name}.{k}.")
            if not 0 < len(value) <= ROWS_SHOWN:
                yield f"{within}{name}", f"{len(value)} in all", "", text_of(info)
        elif not isinstance(value, Component):
            yield f"{within}{name}", reference.shown(value), unit_of(info), text_of(info)


def render(explanation: Explanation) -> RenderableType:
    """Return the explanation for a terminal."""
    head = Text.assemble(
        (explanation.name, "bold"),
        f": {explanation.particles} particles, room for {explanation.capacity}; {explanation.precision}; "
        f"schedule '{explanation.schedule}'; {_bytes(explanation.bytes)} per world; "
        f"at least {explanation.steps:.3g} steps",
    )
    what = _table("It has", "effect", "what it is", "source")
    for part in (*explanation.effects, *explanation.others):
        what.add_row(part.name, part.summary, part.source)
        for name, value, unit, text in part.parameters:
            what.add_row("", f"{name} = {value} {unit}".rstrip(), text)
    memory = _table("It allocates", "", "bytes", "for")
    memory.columns[1].justify = "right"
    for item in explanation.memory:
        memory.add_row(item.name, f"{item.bytes:,}", item.why)
    phases = Text.assemble(("A step runs  ", "italic"), " > ".join(explanation.phases))
    absent = _table("It leaves out (not compiled, nothing allocated)", "effect", "what it is", "source")
    for part in explanation.absent_effects:
        absent.add_row(part.name, part.summary, part.source)
    fields = [f"{name} (of {kinds_})" for name, kinds_ in explanation.absent_fields]
    lacking = Text.assemble(("Fields it does without  ", "italic"), "; ".join(fields) or "none")
    left_out = absent if explanation.absent_effects else Text("It leaves out no effect that tisim knows.")
    return Group(head, "", what, "", memory, "", phases, "", left_out, lacking)


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
