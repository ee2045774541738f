"""Sets of packings, each of which answers one question of B16 chapters 2 to 4."""

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from typing import Any, Literal

import numpy as np

from tisim.analysis import Mean
from tisim.analysis.packings.wall_alignment import wall_alignment
from tisim.cases.case import size_named
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.packing.measures import MeasuredPacking, packings
from tisim.cases.packing.scene import SIZES, of_shape, rod, superball
from tisim.engine.batches import Progress
from tisim.geometry import CylindricalContainer, WedgeContainer
from tisim.geometry.container import Container
from tisim.shapes.particle_shape import ParticleShape

Study = Literal["aspect ratio", "cylinder", "wedge", "superballs", "moment of inertia"]
ASPECTS = (1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 10.0)
"""Aspect ratios Lambda of rods in a periodic box."""
CONFINED_ASPECTS = (1.0, 2.0, 3.0, 5.0)
"""Aspect ratios in a cylinder and a wedge."""
WIDTHS = (1.1, 1.4, 1.7, 2.05, 2.3, 2.6, 3.0, 3.5, 4.5, 6.0, 8.0)
"""Diameters D_cyl of cylinders, D."""
ANGLES = (18.0, 27.0, 45.0)
"""Angles of wedges, degrees."""
WEDGE_LENGTHS = (1.2, 1.6, 2.0, 3.0)
"""Lengths l_w of wedges over the shortest one that holds a row of rods (B16 (2.12))."""
CONFINED_START = 0.03
"""Packing fraction of a start in a cylinder or a wedge, much of which bodies cannot reach."""
EXPONENTS = (2.0, 2.1, 2.2, 2.4, 2.6, 2.8, 3.0, 3.5, 4.0, 5.0)
"""Exponents gamma of superballs."""
INERTIAS = (1e-2, 1e-1, 0.3, 1.0, 3.0, 10.0, 1e2)
"""xi over the moment of inertia."""
INERTIA_ASPECTS = (1.0, 1.5, 3.0)
"""Aspect ratios for which xi is varied."""
STEADY_MOTION = 0.5
"""``motion`` of the revised method in these studies. With B16's 0.1 packings need several times the attempts,
and 200 spheres end at 0.602 in place of 0.610 with 3000."""


@dataclass(frozen=True)
class PackedRow:
    """A packing of a study: a line of its table. Lengths are in D; an angle is in degrees; NaN where it does
    not apply."""

    study: str
    method: str
    shape: float
    width: float
    angle: float
    inertia: float
    seed: int
    number: int
    attempts: int
    fraction: float
    contacts: float
    held: float
    nematic: float
    cubatic: float
    aligned: float


@dataclass(frozen=True)
class PackedPlan:
    """The packings of a study: scenes that differ in shape, width, angle and xi, from several seeds."""

    study: Study
    shape: float
    method: str = "original"
    width: float = np.nan
    angle: float = np.nan
    inertia: float = 1.0

    def body(self) -> ParticleShape:
        """Return the shape of the bodies."""
        return superball(self.shape) if self.study == "superballs" else rod(self.shape)

    def container(self) -> Container | None:
        """Return the container; None for a periodic box."""
        if self.study == "cylinder":
            return CylindricalContainer(diameter=self.width)
        if self.study == "wedge":
            return WedgeContainer(length=self.width, angle=np.radians(self.angle))
        return None

    def number(self, usual: int) -> int:
        """Return the number of bodies: ``usual``, or more, to keep the box twice as wide as a body is
        long."""
        body, around = self.body(), self.container()
        length = 2 * body.bounding_radius()
        # Densities that these packings do not exceed, with a margin.
        dense = 0.75 if self.shape < 5 else min(0.75, 6.5 / self.shape)
        section = (2.1 * length) ** 2 if around is None else self.section()
        return max(usual, int(np.ceil(dense * section * 2.1 * length / body.volume())))

    def section(self) -> float:
        """Return the area (D^2) of the cross-section of the container."""
        around = self.container()
        assert around is not None
        return around.volume_in(np.ones(3), 1.0)


def plans(study: Study) -> list[PackedPlan]:
    """Return the packings of a study."""
    if study == "aspect ratio":
        return [PackedPlan(study, one, method) for method in ("original", "revised") for one in ASPECTS]
    if study == "cylinder":
        return [PackedPlan(study, one, width=width) for one in CONFINED_ASPECTS for width in WIDTHS]
    if study == "wedge":
        return [
            PackedPlan(
                study, one, width=factor * WedgeContainer.shortest(np.radians(angle), one), angle=angle
            )
            for one in CONFINED_ASPECTS
            for angle in ANGLES
            for factor in WEDGE_LENGTHS
        ]
    if study == "moment of inertia":
        return [PackedPlan(study, one, inertia=xi) for one in INERTIA_ASPECTS for xi in INERTIAS]
    return [PackedPlan(study, one, "revised") for one in EXPONENTS]


def packed(
    chosen: Sequence[PackedPlan], size: str, starts: int, progress: Progress | None = None, **settings: Any
) -> list[PackedRow]:
    """Return the packings of plans from random starts, packed as one batch."""
    usual = {**size_named(size, SIZES).scene, **settings}
    each = [(plan, seed) for plan in chosen for seed in range(starts)]
    scenes = []
    for plan, seed in each:
        options: dict[str, Any] = {"method": plan.method}
        options |= {"motion": STEADY_MOTION} if plan.method == "revised" else {"inertia": plan.inertia}
        options |= {"number": plan.number(usual["number"]), "container": plan.container()}
        if plan.container() is not None:
            options["start"] = CONFINED_START
        scenes.append(of_shape(plan.body(), size, seed, **{**settings, **options}))
    return [row(plan, seed, one) for (plan, seed), one in zip(each, packings(scenes, progress), strict=True)]


def row(plan: PackedPlan, seed: int, one: MeasuredPacking) -> PackedRow:
    """Return the line of a packing."""
    given = plan.study, plan.method, plan.shape, plan.width, plan.angle, plan.inertia, seed
    measures = one.fraction, one.contacts, one.held, one.nematic, one.cubatic
    return PackedRow(*given, len(one.bodies), one.attempts, *measures, aligned(plan, one))


def aligned(plan: PackedPlan, one: MeasuredPacking) -> float:
    """Return the part of the bodies near walls that are aligned with them; NaN without walls."""
    around = plan.container()
    if around is None:
        return float("nan")
    side, unit = one.bodies.high - one.bodies.low, float(one.bodies.diameters()[0])
    distance, normal = around.distances(one.bodies.position - one.bodies.low, side, unit)
    return wall_alignment(one.bodies, distance, normal).fraction


def table(rows: Iterable[PackedRow]) -> str:
    """Return rows as CSV."""
    return csv_text([[one.name for one in fields(PackedRow)], *(astuple(one) for one in rows)])


def read(text: str) -> list[PackedRow]:
    """Return the rows of a table."""
    types: Mapping[str, Callable[[str], Any]] = {"str": str, "float": float, "int": int}
    kinds = [types[getattr(one.type, "__name__", str(one.type))] for one in fields(PackedRow)]
    lines = list(csv.reader(io.StringIO(text)))[1:]
    return [PackedRow(*(kind(cell) for kind, cell in zip(kinds, line, strict=True))) for line in lines]


def means(rows: Sequence[PackedRow], by: Sequence[str], name: str) -> dict[tuple[Any, ...], Mean]:
    """Return the mean of a measure over seeds, by the values of columns."""
    groups: dict[tuple[Any, ...], list[float]] = {}
    for one in rows:
        groups.setdefault(tuple(getattr(one, key) for key in by), []).append(getattr(one, name))
    return {key: Mean.of(values) for key, values in groups.items()}
