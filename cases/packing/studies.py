"""Sets of packings, each of which answers one question of B16 chapters 2 to 4."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tisim.analysis.packings.wall_alignment import wall_alignment
from tisim.cases.case import size_named
from tisim.cases.packing.measures import MeasuredPacking, packings
from tisim.cases.packing.scene import PUBLISHED_STEP, SIZES, of_shape, rod, superball
from tisim.cases.packing.study_table import PackedRow, Study, key_of
from tisim.engine.batches import Progress
from tisim.geometry import CylindricalContainer, WedgeContainer
from tisim.geometry import container as containers
from tisim.shapes.particle_shape import ParticleShape

ASPECTS = (1.0, 1.1, 1.25, 1.4, 1.5, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0, 10.0)
"""Aspect ratios Lambda of rods in a periodic box."""
REVISED_ASPECTS = (1.0, 1.5, 3.0, 5.0, 10.0)
"""Aspect ratios that are also packed by the revised method."""
LONG_ASPECTS = (25.0, 50.0)
"""Aspect ratios of long rods, for which B16 finds phi L/D = 5."""
LONGEST_ASPECTS = (100.0, 150.0)
"""Aspect ratios of longer rods: minutes on a graphics card, some hours on one core."""
CYLINDER_ASPECTS = (1.0, 3.0)
"""Aspect ratios in a cylinder."""
WIDTHS = (1.1, 1.4, 1.67, 1.9, 2.05, 2.3, 2.6, 3.1, 4.5, 8.0)
"""Diameters D_cyl of cylinders, D."""
IN_FILE = 50
"""Bodies in a cylinder in which they cannot pass each other or turn round."""
WEDGE_ASPECTS = (1.25, 3.0)
"""Aspect ratios in a wedge."""
ANGLES = (9.0, 45.0)
"""Angles of wedges, degrees."""
WEDGE_LENGTHS = (1.2, 3.0)
"""Lengths l_w of wedges over the shortest one that holds a row of rods (B16 (2.12))."""
LONG_WEDGE, MANY_ATTEMPTS = 6.0, 20_000
"""Length of a wedge over the shortest one, and attempts, that show whether either changes the alignment."""
DENSEST_START = 1.0
"""Largest packing fraction of a start, times Lambda, at which rods find places at random."""
CONFINED_START = 0.03
"""Packing fraction of a start in a cylinder or a wedge, much of which bodies cannot reach."""
EXPONENTS = (2.0, 2.5, 3.0, 4.0, 5.0)
"""Exponents gamma of superballs."""
INERTIAS = (1e-2, 1e-1, 0.3, 1.0, 10.0, 1e2)
"""xi over the moment of inertia."""
INERTIA_ASPECTS = (1.5, 3.0)
"""Aspect ratios for which xi is varied."""
STEADY_MOTION = 0.5
"""``motion`` of the revised method in these studies. With B16's 0.1 packings need several times the attempts,
and 200 spheres end at 0.602 in place of 0.610 with 3000."""
SIDE_BY_SIDE = 8
"""Packings that are made side by side; a study that is stopped loses at most these."""


@dataclass(frozen=True)
class PackedPlan:
    """Packings that differ only in their seeds.

    shape : aspect ratio of rods, or exponent of superballs. width : D_cyl or l_w (D). angle : of a wedge
    (degrees). inertia : xi over the moment of inertia. number, start, step, limit, halvings, tolerance : of
    ``scene``, whose ``attempts`` is ``limit``; None for the value of the size. ``number`` and ``limit`` are
    for the size "default"; other sizes have them in proportion. published : number of bodies at the size
    "paper", where B16 has other than 500.
    """

    study: Study
    shape: float
    method: str = "original"
    width: float = np.nan
    angle: float = np.nan
    inertia: float = 1.0
    number: int | None = None
    start: float | None = None
    step: float | None = None
    limit: int | None = None
    halvings: int | None = None
    tolerance: float | None = None
    published: int | None = None

    def body(self) -> ParticleShape:
        """Return the shape of the bodies."""
        return superball(self.shape) if self.study == "superballs" else rod(self.shape)

    def container(self) -> containers.Container | None:
        """Return the container; None for a periodic box."""
        return container_of(self)

    def options(self, size: str, **settings: Any) -> dict[str, Any]:
        """Return the arguments of ``of_shape``. settings : arguments of ``scene``; they override the size."""
        usual = {"halvings": 4, "tolerance": 1e-4, **size_named(size, SIZES).scene, **settings}
        around, start = self.container(), self.start
        if around is not None and start is None:
            start = CONFINED_START
        elif start is None and self.study != "superballs":
            # Long rods find no places at random in a dense start.
            start = min(usual["start"], DENSEST_START / self.shape)
        own = {"start": start, "step": self.step, "halvings": self.halvings, "tolerance": self.tolerance}
        own["attempts"] = at_size(self.limit, "attempts", size)
        number = self.published if size == "paper" else None
        number = number or at_size(self.number, "number", size) or usual["number"]
        own["number"] = self.least_number(number)
        options = usual | {key: value for key, value in own.items() if value is not None}
        if self.step is None:
            # The same relative step of the volume, however many bodies the box needs.
            options["step"] *= options["number"] / usual["number"]
        options |= {"motion": STEADY_MOTION} if self.method == "revised" else {"inertia": self.inertia}
        return {**options, "method": self.method, "container": around}

    def least_number(self, usual: int) -> int:
        """Return the number of bodies: ``usual``, or more, to keep the box twice as wide as a body is
        long."""
        body, around = self.body(), self.container()
        length = 2 * body.bounding_radius()
        # Densities that these packings do not exceed, with a margin.
        dense = 0.75 if self.shape < 5 else min(0.75, 6.0 / self.shape)
        section = (2.1 * length) ** 2 if around is None else around.volume_in(np.ones(3), 1.0)
        return max(usual, int(np.ceil(dense * section * 2.1 * length / body.volume())))


def at_size(value: int | None, name: str, size: str) -> int | None:
    """Return a number that is given for the size "default", in proportion to a setting of another size; None
    for None."""
    if value is None:
        return None
    here, default = (size_named(one, SIZES).scene[name] for one in (size, "default"))
    return max(1, round(value * here / default))


def container_of(one: PackedPlan | PackedRow) -> containers.Container | None:
    """Return the container of a packing; None for a periodic box."""
    if one.study == "cylinder":
        return CylindricalContainer(diameter=one.width)
    if one.study in ("wedge", "wedge effort"):
        return WedgeContainer(length=one.width, angle=np.radians(one.angle))
    return None


OF_PACKING = ("fraction", "contacts", "touching", "held", "nematic", "cubatic")
"""Columns that are measures of the packing by itself."""


def plans(study: Study) -> list[PackedPlan]:
    """Return the packings of a study."""
    if study == "aspect ratio":
        both = (("original", ASPECTS), ("revised", REVISED_ASPECTS))
        return [PackedPlan(study, one, method) for method, aspects in both for one in aspects]
    if study == "long rods":
        return [long_rods(study, one) for one in LONG_ASPECTS]
    if study == "longest rods":
        return [long_rods(study, one) for one in LONGEST_ASPECTS]
    if study == "cylinder":
        # In a file, overlaps vanish by diffusion from body to body, so short files need far fewer attempts.
        return [
            PackedPlan(study, one, width=width, number=IN_FILE if width <= max(2.2, one) else None)
            for one in CYLINDER_ASPECTS
            for width in WIDTHS
        ]
    if study == "wedge":
        return [
            PackedPlan(study, one, width=factor * shortest(one, angle), angle=angle)
            for one in WEDGE_ASPECTS
            for angle in ANGLES
            for factor in WEDGE_LENGTHS
        ]
    if study == "wedge effort":
        # Rods are less aligned there than in B16.
        aspect, angle = WEDGE_ASPECTS[-1], ANGLES[-1]
        length = shortest(aspect, angle)
        one = PackedPlan(study, aspect, width=WEDGE_LENGTHS[-1] * length, angle=angle)
        return [one, replace(one, limit=MANY_ATTEMPTS), replace(one, width=LONG_WEDGE * length)]
    if study in ("moment of inertia", "inertia effort"):
        # B16 has 10,000 attempts.
        limit = 1000 if study == "moment of inertia" else 10_000
        return [
            PackedPlan(study, one, inertia=xi, limit=limit, halvings=2)
            for one in INERTIA_ASPECTS
            for xi in INERTIAS
        ]
    if study == "effort":
        spheres, rods = PackedPlan(study, 1.0), PackedPlan(study, 1.5)
        limits = [replace(one, limit=limit) for one in (spheres, rods) for limit in (200, 2000, 20_000)]
        tolerances = [replace(spheres, tolerance=one) for one in (1e-3, 1e-5)]
        published = replace(spheres, number=500, start=0.05, step=PUBLISHED_STEP)
        full = [replace(published, limit=100_000, method=method) for method in ("original", "revised")]
        steps = [replace(spheres, step=PUBLISHED_STEP), published, *full]
        return [*limits, *tolerances, *steps]
    # The search for contacts of superquadrics takes long.
    return [PackedPlan(study, one, "revised", number=100, limit=500, published=750) for one in EXPONENTS]


def long_rods(study: Study, aspect: float) -> PackedPlan:
    """Return a packing of long rods.

    Its start is in proportion to the end, where the packing fraction is about 5/Lambda. Its first step is a
    part of the final volume that grows with the rods: 1.9 % at Lambda = 25, 3.8 % at 50, 6.4 % at 100 and 8.8
    % at 150. With a third of this step and 100 attempts, rods of Lambda = 25 ended at 0.145.
    """
    number = PackedPlan(study, aspect).least_number(1)
    final = number * aspect / 5.0  # volume of the box, in volumes of a rod
    step = 1e-3 * rod(aspect).volume() * final
    return PackedPlan(study, aspect, start=2.0 / aspect, step=step, limit=1000)


def shortest(aspect: float, angle: float) -> float:
    """Return the length (D) of the shortest wedge that holds a row of rods. angle : degrees."""
    return WedgeContainer.shortest(np.radians(angle), aspect)


def measured_packings(
    chosen: Sequence[PackedPlan],
    size: str,
    starts: int,
    progress: Progress | None = None,
    made: Container[tuple[str, ...]] = (),
    **settings: Any,
) -> Iterator[tuple[PackedRow, MeasuredPacking]]:
    """Pack the plans from random starts; yield the line and the packing of each as it ends.

    made : keys of packings that exist already and are left out. settings : arguments of ``scene``; they
    override the size.
    """
    each = [
        (plan, given(plan, plan.options(size, **settings), seed)) for plan in chosen for seed in range(starts)
    ]
    each = [(plan, known) for plan, known in each if key_of(known) not in made]
    scenes = [
        of_shape(plan.body(), size, known["seed"], **plan.options(size, **settings)) for plan, known in each
    ]
    for index, one in packings(scenes, progress, SIDE_BY_SIDE):
        yield row(*each[index], one), one


def packed(
    chosen: Sequence[PackedPlan], size: str, starts: int, progress: Progress | None = None, **settings: Any
) -> list[PackedRow]:
    """Return the lines of the packings of plans from random starts, in this order."""
    rows = {one.key(): one for one, _ in measured_packings(chosen, size, starts, progress, **settings)}
    options = [(plan, plan.options(size, **settings)) for plan in chosen]
    return [rows[key_of(given(*one, seed))] for one in options for seed in range(starts)]


def given(plan: PackedPlan, options: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Return the columns of a line that are known before it is packed."""
    by = {name: getattr(plan, name) for name in ("study", "method", "shape", "width", "angle", "inertia")}
    effort = {name: options[name] for name in ("halvings", "step", "tolerance", "number")}
    return {**by, **effort, "limit": options["attempts"], "seed": seed}


def row(plan: PackedPlan, known: Mapping[str, Any], one: MeasuredPacking) -> PackedRow:
    """Return the line of a packing."""
    measures = {name: getattr(one, name) for name in OF_PACKING}
    aligned, with_any = near_walls(plan, one)
    return PackedRow(**known, **measures, attempts=one.attempts, aligned=aligned, with_any=with_any)


def near_walls(plan: PackedPlan, one: MeasuredPacking) -> tuple[float, float]:
    """Return f_align of B16, and the part of the bodies near walls that lie along at least one; NaN without
    walls."""
    around = plan.container()
    if around is None:
        return float("nan"), float("nan")
    side, unit = one.bodies.high - one.bodies.low, float(one.bodies.diameters()[0])
    distance, normal = around.distances(one.bodies.position - one.bodies.low, side, unit)
    found = wall_alignment(one.bodies, distance, normal)
    return found.fraction, found.with_any


def plan_of(one: PackedRow) -> PackedPlan:
    """Return the plan of a line without its effort."""
    by = {name: getattr(one, name) for name in ("shape", "method", "width", "angle", "inertia")}
    return PackedPlan(one.study, **by)  # type: ignore[arg-type]
