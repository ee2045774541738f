"""Magnetic colloids in a column packed with magnetised fibres: the filter of B16 chapter 7.

A field along x magnetises fibres of soft steel, which are packed at random (matrix.py). Water flows along z.
The colloids are single domains of magnetite of a lognormal distribution of sizes. They diffuse, and a colloid
that touches a fibre is captured.

"static" is B16's static separation: the colloids are spread at random in the pores, and nothing flows. The
matrix and the positions of the colloids are periodic along all axes. "dynamic" is B16's dynamic separation: a
suspension enters in front of the matrix, flows through it, and is counted behind it. The matrix is periodic
across the flow, or is in a tube, whose wall reflects colloids. "elution" is static separation with its end:
the colloids are spread in the pores and rest for a time, and then clear water rinses those that are free out
of the matrix, with the field on. The field is the sum of the fields of all fibres within ``IMAGE_REACH`` of
the matrix.

B16 gives the field of about 1 and 1.5 T, the fibres, of 0.4 mm and 4, 7 and 11 mm, and the magnetic radius of
the colloids. It does not give the solid fraction, the flow, or the hydrodynamic radius, which is here the
magnetic one.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, Self

import numpy as np
from scipy.constants import Boltzmann
from scipy.fft import next_fast_len

from tisim import Box, Particles, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common.magnetic_fibre import WATER_TEMPERATURE, WATER_VISCOSITY
from tisim.cases.packed_filter.matrix import FLOW_DIRECTION, Matrix, in_pores, magnets_of
from tisim.components.component import Vector
from tisim.effects import Effect, LangevinMoment, Magnetophoresis
from tisim.geometry import CylindricalSurface, Plane
from tisim.operators import Capture, Inlet, Outlet, ReflectingWalls, Release
from tisim.packing import GrainClass, LognormalSizes, MagneticCore
from tisim.packing.grains import draw
from tisim.packing.magnetic_core import core_normals
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, PoreFlow, UniformFlow
from tisim.sources.magnetic.cell_sum import Corners
from tisim.sources.switched import NO_END
from tisim.steppers import Brownian, DriftLimit

TITLE = "Magnetic colloids captured in a packing of magnetised fibres (B16)"
MAGNETITE_SATURATION = 4.46e5
"""Saturation magnetisation of magnetite, A/m (B16 7.6)."""
MAGNETITE_DENSITY = 5180.0
"""Density of magnetite, kg/m^3."""
MEAN_RADIUS, POLYDISPERSITY = 5.1e-9, 0.40
"""Mean magnetic radius of the colloids, m, and their standard deviation over it (B16 section 7.4.1)."""
SMALLEST_RADIUS, LARGEST_RADIUS = 1e-9, 20e-9
"""Radii of the smallest and largest colloids, m."""
LONGEST_MOVE = 0.02
"""Largest displacement of a colloid in a step by forces, by the flow and by diffusion, D. Captures are found
at the ends of steps: with 0.05, 3 % more colloids pass (docs/packed_filter.md)."""
FIELD_DIGITS = 2
"""Number of digits of the field, or of the table of a fibre; random motion outweighs this error."""
APPROACH = 1.0
"""Distance of the faces at which colloids enter and leave from the matrix, in lengths of a fibre."""
ADHERING = 0.4
"""Fraction of captured colloids that are never released: B16 released at most 60 % (section 7.5)."""
MATRIX_SETTINGS = tuple(one.name for one in fields(Matrix))
TUBE = 2.0
"""Diameter of the tube of variant "tube" over the length of a rod with its caps."""
ELUTION_SPEED = 1e-3
"""Superficial velocity of the water that rinses the matrix, m/s; B16 lets it run out (section 7.4.3)."""
ELUTION_WAIT = 60.0
"""Time of rest before the elution of variant "elution", s."""
ELUTION_TRANSITS = 4.0
"""Duration of the rinse, in times in which the water passes the filter."""
Mode = Literal["static", "dynamic", "elution"]
Flow = Literal["resolved", "uniform"]

SEARCH: dict[str, Any] = {"options": {"population": 8, "first": 12}, "ensemble": {"confirm": 8}}
"""Settings of searches of every size."""
SIZES = {
    "small": Size(
        "30 fibres of L/D = 2 and 200 colloids, which enter for 40 s; the field is switched off at 150 s",
        {"aspect": 2.0, "number": 200, "feed": 40.0, "field_end": 150.0, "duration": 300.0},
        {"generations": 8, "max_evaluations": 80, **SEARCH},
    ),
    "default": Size(
        "95 fibres of L/D = 5 and 1000 colloids, which enter for 60 s; the field is switched off at 300 s",
        {"aspect": 5.0, "number": 1000, "feed": 60.0, "field_end": 300.0, "duration": 600.0},
        {"generations": 20, "max_evaluations": 240, **SEARCH},
    ),
    "large": Size(
        "438 fibres of L/D = 10, as B16's of 4 mm, and 10,000 colloids",
        {"aspect": 10.0, "fraction": 0.3, "number": 10_000, "feed": 120.0, "field_end": 600.0}
        | {"duration": 1200.0},
    ),
}


@dataclass(frozen=True)
class PackedFilter:
    """A filter and the suspension in it.

    matrix : the fibres. mode : of the separation. flux : of the applied field, T. mutual : whether the
    fibres magnetise each other. saturated : whether the fibres are saturated in any field, in the
    direction of least energy (Stoner and Wohlfarth), as in B16 chapter 6; otherwise they are soft steel.
    digits : of the sum of their fields by cells; None to add the fibres one by one, from a table, which
    is faster for few colloids. speed : superficial velocity of the water, the volume flow over the cross
    section of the column, m/s. flow : "resolved" between the fibres, or "uniform" with the mean velocity
    in the pores. resolution : cells of the resolved flow over D, unless ``cells`` along x, y and z are
    given. wait : time at which the flow of mode "elution" begins, s. feed : time until which colloids
    enter in mode "dynamic", s. field_end : time at which the field is switched off, s. adhering :
    fraction of captured colloids that are never released; None for captures that last for ever.
    mean_radius, polydispersity : of the colloids, m, and relative. number : of colloids. duration : of
    the run, s. longest_move : largest displacement of a colloid in a step, D.
    """

    matrix: Matrix = field(default_factory=Matrix)
    mode: Mode = "static"
    flux: float = 1.0
    mutual: bool = True
    saturated: bool = False
    digits: int | None = FIELD_DIGITS
    speed: float = 1e-4
    flow: Flow = "resolved"
    resolution: float = 8.0
    cells: tuple[int, int, int] | None = None
    wait: float = 0.0
    feed: float = 60.0
    field_end: float = NO_END
    adhering: float | None = None
    mean_radius: float = MEAN_RADIUS
    polydispersity: float = POLYDISPERSITY
    number: int = 1000
    duration: float = 60.0
    longest_move: float = LONGEST_MOVE

    @property
    def pore_speed(self) -> float:
        """Return the mean velocity of the water in the pores, m/s."""
        return self.speed / (1 - self.matrix.fraction)

    @property
    def stage(self) -> float:
        """Return the time in which the water passes the mean distance of fibres, s."""
        return self.matrix.density ** (-1 / 3) / self.pore_speed

    @property
    def transit(self) -> float:
        """Return the time in which the water passes the filter, from the place of the inlet to the outlet,
        s."""
        (_, _, first), (_, _, last) = self.stretch(self.box())
        return (last - first) / self.pore_speed

    def with_packing(self, seed: int) -> Self:
        """Return the filter with the packing of a seed."""
        return replace(self, matrix=replace(self.matrix, seed=seed))

    def grains(self) -> GrainClass:
        """Return the distribution of the colloids."""
        variance = np.log1p(self.polydispersity**2)
        sizes = LognormalSizes(
            by="number",
            median=self.mean_radius * float(np.exp(-variance / 2)),
            ratio=float(np.exp(np.sqrt(variance))),
            smallest=SMALLEST_RADIUS,
            largest=LARGEST_RADIUS,
        )
        core = MagneticCore(magnetisation=MAGNETITE_SATURATION)
        return GrainClass(sizes=sizes, density=MAGNETITE_DENSITY, core=core)

    def radii(self, number: int, seed: int) -> np.ndarray:
        """Return the magnetic radii of a number of colloids, m."""
        return draw([self.grains()], number, seed)[1]

    def field(self) -> Vector:
        """Return the flux density of the applied field, T."""
        return self.flux, 0.0, 0.0

    def magnets(self) -> tuple[Cylinder, ...]:
        """Return the magnetised fibres of the matrix, followed by their images."""
        return magnets_of(self.matrix, self.field(), self.mode == "static", self.mutual, self.saturated)

    def box(self) -> Box:
        """Return the box of the matrix."""
        half, across = self.matrix.sides[0] / 2, self.matrix.tube is None
        return Box(
            low=(-half, -half, 0.0),
            high=(half, half, self.matrix.depth),
            periodic=(across, across, self.mode == "static"),
            images=False,
        )

    def walls(self) -> tuple[ReflectingWalls, ...]:
        """Return the wall of a tube, on which colloids do not stick."""
        if self.matrix.tube is None:
            return ()
        radius, depth = self.matrix.sides[0] / 2, self.matrix.depth
        tube = CylindricalSurface(start=(0.0, 0.0, 0.0), end=(0.0, 0.0, depth), radius=radius)
        return (ReflectingWalls(cylinders=(tube,)),)

    def scene(self, seed: int) -> Scene:
        """Return the scene of a seed."""
        return self.scene_about(self.matrix.fibres(), self.magnets(), self.box(), seed)

    def scene_about(
        self, fibres: tuple[Cylinder, ...], magnets: tuple[Cylinder, ...], box: Box, seed: int
    ) -> Scene:
        """Return the scene of other fibres in another box. magnets : the fibres and their images."""
        core = self.grains().core
        assert core is not None
        radius = self.radii(self.number, seed)
        moments = core.moments(radius, core_normals(self.number, seed))["saturation_moment"]
        return Scene(
            name="packed_filter",
            particles=Particles(
                position=in_pores(self.number, magnets, box, seed, self.matrix.tube is not None),
                velocity=np.zeros((self.number, 3)),
                radius=radius,
                density=MAGNETITE_DENSITY,
                quantities={"saturation_moment": moments, "domain_moment": moments},
            ),
            domain=box,
            effects=(
                MagneticField(constant=self.field(), end=self.field_end),
                MagneticCylinders(
                    cylinders=magnets,
                    sum_digits=self.digits,
                    table_digits=FIELD_DIGITS if self.digits is None else None,
                    sum_box=self.stretch(box),
                    end=self.field_end,
                ),
                LangevinMoment(temperature=WATER_TEMPERATURE),
                Magnetophoresis(),
                *self.walls(),
                Capture(release=self.release()),
                *self.stream(fibres, box),
            ),
            stepper=self.stepper(),
            duration=self.duration,
            seed=seed,
        )

    def stream(self, fibres: tuple[Cylinder, ...], box: Box) -> tuple[Effect, ...]:
        """Return the flow, and the faces before and behind a box at which colloids enter, if they do, and
        leave."""
        if self.mode == "static":
            return ()
        (left, front, first), (right, back, last) = self.stretch(box)
        entry = first + self.matrix.diameter
        begin = self.wait if self.mode == "elution" else 0.0
        flow: Effect = UniformFlow(velocity=(0.0, 0.0, self.pore_speed), begin=begin)
        if self.flow == "resolved":
            size = np.array([right - left, back - front, last - first]) / self.matrix.diameter
            x, y, z = self.cells or (next_fast_len(int(np.ceil(self.resolution * one))) for one in size)
            # PoreFlow takes the mean velocity over the square around the tube.
            tube = self.matrix.tube is not None
            flow = PoreFlow(
                low=(left, front, first),
                high=(right, back, last),
                column="tube" if tube else "none",
                speed=self.speed * self.matrix.section / self.matrix.sides[0] ** 2,
                viscosity=WATER_VISCOSITY,
                cylinders=fibres,
                cells=(x, y, z),
                begin=begin,
            )
        outlet = Outlet(planes=(Plane(point=(0.0, 0.0, last), normal=(0.0, 0.0, -1.0)),))
        if self.mode == "elution":
            return flow, outlet
        inlet = Inlet(
            low=(left, front, first), high=(right, back, entry), direction=FLOW_DIRECTION, end=self.feed
        )
        return flow, inlet, outlet

    def stretch(self, box: Box) -> Corners:
        """Return the corners (m) of the box in which colloids are: the box of the matrix, from the place of
        the inlet to the outlet if there is a flow."""
        (left, front, bottom), (right, back, top) = box.low, box.high
        if self.mode != "static":
            before = APPROACH * self.matrix.length
            bottom, top = bottom - before - self.matrix.diameter, top + before
        return (left, front, bottom), (right, back, top)

    def release(self) -> Release | None:
        """Return the conditions under which captured colloids are released."""
        if self.adhering is None:
            return None
        return Release(adhering=self.adhering, temperature=WATER_TEMPERATURE)

    def stepper(self) -> Brownian:
        """Return the stepper, whose steps move a colloid by at most ``longest_move``."""
        move = self.longest_move * self.matrix.diameter
        diffusion = Boltzmann * WATER_TEMPERATURE / (6 * np.pi * WATER_VISCOSITY * self.mean_radius)
        longest = min(move**2 / (2 * diffusion), np.inf if self.mode == "static" else move / self.pore_speed)
        return Brownian(
            temperature=WATER_TEMPERATURE,
            viscosity=WATER_VISCOSITY,
            control=DriftLimit(longest=longest, shortest=1e-6, drift=move / self.mean_radius),
        )


def filter_of(size: str, mode: Mode = "dynamic", seed: int = 0, **settings: Any) -> PackedFilter:
    """Return the filter of a size. seed : of its matrix. settings : of Matrix and PackedFilter; they override
    the size."""
    wanted = {**size_named(size, SIZES).scene, **settings, "seed": seed}
    matrix = Matrix(**{name: wanted.pop(name) for name in MATRIX_SETTINGS if name in wanted})
    if mode == "static":
        wanted |= {"field_end": NO_END}
    elif mode == "elution":
        wanted = {"speed": ELUTION_SPEED, **wanted, "field_end": NO_END}
    else:
        wanted = {"adhering": ADHERING, **wanted}
    return PackedFilter(matrix, mode, **wanted)


def scene_for(size: str, seed: int) -> Scene:
    """Return dynamic separation of a size, with the packing, the colloids and the noise of a seed."""
    return filter_of(size, seed=seed).scene(seed)


def static_scene(size: str, seed: int) -> Scene:
    """Return static separation of a size, from the start of a seed."""
    return filter_of(size, "static", seed).scene(seed)


def uniform_scene(size: str, seed: int) -> Scene:
    """Return dynamic separation in a uniform flow."""
    return filter_of(size, seed=seed, flow="uniform").scene(seed)


def tube_scene(size: str, seed: int) -> Scene:
    """Return dynamic separation in a tube."""
    return filter_of(size, seed=seed, tube=TUBE).scene(seed)


def eluted(wait: float, size: str, seed: int = 0, **settings: Any) -> PackedFilter:
    """Return static separation of a size that ends with an elution, after a wait (s); see ``filter_of``."""
    filter = filter_of(size, "elution", seed, wait=wait, **settings)
    return replace(filter, duration=wait + ELUTION_TRANSITS * filter.transit)


def elution_scene(size: str, seed: int) -> Scene:
    """Return static separation with its elution after a minute."""
    return eluted(ELUTION_WAIT, size, seed).scene(seed)


PACKED_FILTER_SCENES: Mapping[str, Callable[[str, int], Scene]] = {
    "dynamic": scene_for,
    "static": static_scene,
    "elution": elution_scene,
    "uniform-flow": uniform_scene,
    "tube": tube_scene,
}
"""Scenes of ``tisim run packed_filter --variant``."""
