"""A description of a compiled scene: its effects, memory and phases of a step, and the effects it leaves
out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.describe import reference
from tisim.describe.explained_parts import GIVEN, Part, explained, explained_kind, explained_materials
from tisim.effects.base import Effect
from tisim.engine.assembly import needed_fields
from tisim.engine.simulation import Simulation
from tisim.materials.materials import Materials
from tisim.scene.scene import Scene
from tisim.state.fields import CORE

COST_OF_ABSENT = "1.006 (0.981 to 1.034)"
"""Run time with all effects installed over the run time without those that a scene does not use: the median
of 3 pairs of runs, the least and the largest (tests/benchmarks/absent_effects.py --scene vibration)."""
BRIEF_WIDTH = 130
"""Largest number of characters of the values of a part in the brief form."""
FAMILY_NAMES = {"constraint": "bodies", "walls": "bodies", "gravitation": "pair"}
"""Families of effects that do not have the name of the room in which they are."""


@dataclass(frozen=True)
class Memory:
    """Memory allocated for one world of the scene. bytes : its size. why : the parts that need it."""

    name: str
    bytes: int
    why: str

    @property
    def owner(self) -> str:
        """The first part that needs it."""
        return self.why.split(", ")[0]


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
    outline : the same, but each repeat is one item.
    absent_effects : known effects that the scene does not have.
    absent_families : number of these effects by family.
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
    outline: tuple[str, ...]
    absent_effects: tuple[Part, ...]
    absent_families: Mapping[str, int]
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
        outline = tuple(simulation.program.outline())
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
        outline=outline,
        absent_effects=tuple(explained_kind(kind) for kind in absent),
        absent_families=dict(Counter(map(family, absent)).most_common()),
        absent_fields=tuple(_absent_fields(absent, present)),
    )


def known_effects() -> list[type[Effect]]:
    """Return every effect of the package, sorted by name."""
    kinds_by_family = (
        reference.FAMILIES[family].kinds().values() for family in ("effects", "operators", "sources")
    )
    mine = [kind for kinds in kinds_by_family for kind in kinds if kind.__module__.startswith("tisim.")]
    return sorted(mine, key=lambda kind: kind.kind())  # type: ignore[arg-type]


def family(kind: type[Effect]) -> str:
    """Return the family of an effect, such as "magnetic" or "contact"."""
    _, room, inner, *_ = kind.__module__.split(".")
    name = inner if room == "effects" else room
    return FAMILY_NAMES.get(name, name)


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
    """Return a short form of the explanation that fits one screen: the memory, each part with its own memory
    and its values, the items of a step, and the number of effects left out by family."""
    effects = {part.name for part in explanation.effects}
    owned: Counter[str] = Counter()
    for item in explanation.memory:
        owned[item.owner] += item.bytes
    table = _table("", "part", "memory", "values; if it has none, its description")
    table.columns[0].no_wrap = table.columns[1].no_wrap = True
    table.columns[1].justify = "right"
    for part in (*explanation.effects, explanation.others[0], *_materials_in_brief(explanation)):
        own = _bytes(owned[part.name]) if part.name in effects and owned[part.name] else ""
        table.add_row(Text(part.name, "bold"), own, _in_brief(part))
    rest = (f"{owner} {_bytes(size)}" for owner, size in owned.most_common() if owner not in effects)
    left_out = ", ".join(f"{name} {number}" for name, number in explanation.absent_families.items())
    return Group(
        _head(explanation),
        _time_steps(explanation),
        _line("Memory of the effects", f"in the table; of the rest: {', '.join(rest)}"),
        "",
        table,
        "",
        _line("Step, repeats with *", " > ".join(explanation.outline)),
        _line("Left out", left_out or "no effect"),
        _line(
            "Cost of absent effects",
            f"no memory; run time with them over run time without, of the case vibration: {COST_OF_ABSENT}",
        ),
        "tisim effects NAME describes a part; --all lists fields, phases, sources and absent effects",
    )


def _materials_in_brief(explanation: Explanation) -> Iterator[Part]:
    """Yield the materials, and the pairs of materials for which the scene gives properties, with these."""
    for part in explanation.materials:
        given = tuple(row for row in part.parameters if row[3] == GIVEN)
        if "-" not in part.name:
            yield part
        elif given:
            yield replace(part, parameters=given)


def _in_brief(part: Part) -> str:
    """Return the values of a part and of its nested parts, cut at BRIEF_WIDTH; without any, its summary."""
    values = []
    for one in (inner for nested in part.parts for inner in nested.all()):
        own = ", ".join(_shown(one))
        values.append(one.name.partition(": ")[2] + (own and f" ({own})"))
    values += _shown(part)
    shown = 0
    while shown < len(values) and (not shown or len("; ".join(values[: shown + 1])) <= BRIEF_WIDTH):
        shown += 1
    more = [f"{len(values) - shown} more"] if shown < len(values) else []
    return "; ".join([*values[:shown], *more]) or part.summary


def _shown(part: Part) -> Iterable[str]:
    """Return the values of a part without those that leave something out by default."""
    return (
        f"{name} = {value} {unit}".rstrip()
        for name, value, unit, _ in part.parameters
        if name not in part.off and value not in ("none", "0 in all")
    )


def _head(explanation: Explanation) -> Text:
    most = explanation.capacity
    return Text.assemble(
        (explanation.name, "bold"),
        f": {explanation.particles} particles{f', room for {most}' * (most != explanation.particles)}; "
        f"{explanation.precision}; schedule '{explanation.schedule}'; "
        f"{_bytes(explanation.bytes)} per world; at least {explanation.steps:.3g} steps",
    )


def _line(title: str, text: str) -> Text:
    return Text.assemble((f"{title}  ", "italic"), text)


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
    phases = _line("Phases of a step", " > ".join(explanation.phases))
    absent = _table("Effects left out (not compiled, nothing allocated)", "effect", "description", "source")
    for part in explanation.absent_effects:
        absent.add_row(part.name, part.summary, part.source)
    fields = [f"{name} (of {kinds_})" for name, kinds_ in explanation.absent_fields]
    lacking = _line("Fields not allocated", "; ".join(fields) or "none")
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
    head = _line("Stepper", why)
    if not explanation.critical:
        return head
    steps = "; ".join(f"{label} {step:.3g} s" for label, step in explanation.critical.items())
    return Group(head, _line("Critical time steps, 2/omega of the stiffest motion", steps))


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
