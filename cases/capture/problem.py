"""The inverse problem of capture: a filter of magnetised fibres that catches the most from a stream.

Fibres of one size lie along z in a channel that water flows through along y, side by side in layers one
behind the other, in a uniform field in any direction of the xz plane. They are of soft steel: the field
decides which way and how far they are magnetised (soft_magnet.py). Particles come from upstream, evenly
over the channel, and are caught or pass by. The wire that fibres are cut from is limited, so that many
short ones compete with few long ones.

What B16 found for one cylinder, a search must find by itself: transverse, which is that its axis lies across
the field and not along it (section 6.4.2), and short, as short ones have more capture volume for their own
(6.4.1). As there, the flow is uniform: that fibres turn it aside is left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice, product

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from cases.capture.scene import (
    DENSITY,
    DIAMETER,
    SATURATION_MAGNETISATION,
    SATURATION_MOMENTS,
    TEMPERATURE,
    VISCOSITY,
)
from optimize.problem.genome import Gene, Genome
from optimize.problem.objective import Objective
from optimize.problem.problem import Problem
from tisim import Cloud, RandomInBox, Result, Scene
from tisim.components.component import Vector
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.errors import must
from tisim.operators import Capture
from tisim.plotting.style import empty, letters, plain
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, UniformFlow
from tisim.sources.magnetic.soft_magnet import magnetisation
from tisim.steppers import Brownian, DriftLimit

WIRE = 20 * DIAMETER
"""All fibres together are so long at most, m: as one of B16's longest."""
CHANNEL_WIDTH, CHANNEL_HEIGHT = 6 * DIAMETER, 20 * DIAMETER
"""The channel is so wide along x, and so high along z, m."""
UPSTREAM, SLAB, DOWNSTREAM = 3 * DIAMETER, DIAMETER, 2 * DIAMETER
"""Particles start so far before the first layer, in a slab so thick, and are seen until so far behind the
last one, m."""
FILTER_PARTICLES = 120
"""So many particles flow through a filter in a run."""
FLOW_SPEED, FILTER_RADIUS = 3e-4, 125.0
"""The speed of the flow, m/s, and the radius of the particles, nm, where they are no genes."""
DOMAIN_MOMENT = 2.3e-19
"""The moment of a magnetite grain of 10 nm, A m^2 (B16 7.6): particles are saturated from some 0.1 T on."""
PUSHED, CARRIED = 5e-6, 20e-6
"""How far forces and the flow move a particle in a step at most, m."""
LARGEST = 212
"""The radius of B16's largest particles, nm. Those of other sizes have its moment (table 6.1) by volume."""
TABLE_DIGITS = 3
"""The field of the fibres is tabulated to so many digits; what decides is random."""
MILLI = 1e-3

FIBRE_GENES = (
    Gene("flux", "T", 0.05, 1.0),
    Gene("field_angle", "degrees", 0.0, 90.0),
    Gene("aspect", "L/D", 5 / 3, 20.0, "log"),
    Gene("number", "fibres", 0.51, 12.49),
    Gene("spacing", "D", 1.2, 6.0),
)
HARD_GENE = Gene("magnetisation_angle", "degrees", 0.0, 90.0)
STREAM_GENES = (Gene("speed", "m/s", 1e-4, 1e-2, "log"), Gene("radius", "nm", 25.0, 212.0))
GENES = {
    "fraction": FIBRE_GENES,
    "hard": (*FIBRE_GENES, HARD_GENE),
    "throughput": (*FIBRE_GENES, *STREAM_GENES),
}
"""The genes of each variant of the problem."""
WANTED = {
    "fraction": "the soft fibres and the field that catch the most particles from a stream",
    "hard": "the hard magnets and the field that catch the most particles from a stream",
    "throughput": "the front of fraction caught and throughput, with speed and radius of particles free",
}
"""What each variant of the problem looks for."""
MEANINGS = {
    "captured": "fraction of the particles that is caught",
    "throughput": "water that flows through the channel",
    "aspect": "length of a fibre over its diameter D",
    "spacing": "distance of the axes of fibres side by side",
}


@dataclass(frozen=True)
class Filter:
    """A filter, the particles, and how fast they come.

    flux : of the uniform field, T; field_angle : of it to the axis of the fibres, degrees;
    magnetisation_angle : of theirs, saturated, if they are hard magnets; None for soft steel. aspect : L/D.
    number : of fibres, rounded. spacing : of neighbours in D: between axes, and along them the gap is one
    less. speed : of the flow, m/s. radius : of particles, nm.
    """

    flux: float = 1.0
    field_angle: float = 90.0
    magnetisation_angle: float | None = None
    aspect: float = 5 / 3
    number: float = 12.0
    spacing: float = 3.0
    speed: float = FLOW_SPEED
    radius: float = FILTER_RADIUS

    @property
    def length(self) -> float:
        """The length of a fibre, m."""
        return self.aspect * DIAMETER

    def magnetisation(self) -> Vector:
        """The magnetisation of the fibres, A/m."""
        if self.magnetisation_angle is not None:
            return _in_plane(SATURATION_MAGNETISATION, self.magnetisation_angle)
        field = _in_plane(self.flux, self.field_angle)
        return magnetisation((0.0, 0.0, 1.0), DIAMETER / 2, self.length, SATURATION_MAGNETISATION, field)

    def places(self) -> list[Vector]:
        """Centres of the fibres, m: layer after layer, each from its middle outwards.

        InputError when there is not wire enough, or no fibre.
        """
        count = round(self.number)
        must(count >= 1, "number of fibres", "at least 1", count)
        must(count * self.length <= WIRE * (1 + 1e-9), "wire", f"at most {WIRE:g} m", count * self.length)
        across, along = self.spacing * DIAMETER, self.length + (self.spacing - 1) * DIAMETER
        columns = _row(1 + int((CHANNEL_WIDTH - DIAMETER) / across + 1e-9), across)
        rows = _row(1 + int((CHANNEL_HEIGHT - self.length) / along + 1e-9), along)
        layer = sorted(product(columns, rows), key=lambda at: (at[0] ** 2 + at[1] ** 2, at))
        layers = ((x, k * across, z) for k in range(count) for x, z in layer)
        return list(islice(layers, count))

    def scene(self, seed: int, number: int = FILTER_PARTICLES) -> Scene:
        """Particles that flow through it."""
        places, radius = self.places(), self.radius * 1e-9
        start = -UPSTREAM - SLAB
        way = places[-1][1] + DOWNSTREAM - start
        half = np.array([CHANNEL_WIDTH, CHANNEL_HEIGHT]) / 2
        fibre = {"radius": DIAMETER / 2, "length": self.length}
        magnetised = self.magnetisation()
        moment = SATURATION_MOMENTS[LARGEST] * (self.radius / LARGEST) ** 3
        return Scene(
            name="filter",
            particles=Cloud(
                number=number,
                radius=radius,
                density=DENSITY,
                placement=RandomInBox(low=(-half[0], start, -half[1]), high=(half[0], start + SLAB, half[1])),
                quantities={"saturation_moment": moment, "domain_moment": DOMAIN_MOMENT},
            ),
            effects=(
                MagneticField(constant=_in_plane(self.flux, self.field_angle)),
                MagneticCylinders(
                    cylinders=tuple(
                        Cylinder(centre=place, magnetisation=magnetised, **fibre) for place in places
                    ),
                    table_digits=TABLE_DIGITS,
                ),
                UniformFlow(velocity=(0.0, self.speed, 0.0)),
                LangevinMoment(temperature=TEMPERATURE),
                Magnetophoresis(),
                Capture(),
            ),
            stepper=Brownian(
                temperature=TEMPERATURE,
                viscosity=VISCOSITY,
                control=DriftLimit(longest=CARRIED / self.speed, shortest=1e-9, drift=PUSHED / radius),
            ),
            duration=way / self.speed,
            seed=seed,
        )


def _row(count: int, pitch: float) -> np.ndarray:
    """Places (m) of so many in a row about 0, a pitch (m) apart."""
    return pitch * (np.arange(count) - (count - 1) / 2)


def _in_plane(size: float, angle: float) -> Vector:
    """A vector of a size at an angle (degrees) to z, in the xz plane."""
    return size * float(np.sin(np.radians(angle))), 0.0, size * float(np.cos(np.radians(angle)))


def captured(result: Result) -> float:
    """The fraction of the particles that is caught."""
    return float((result.state["captured_by"] >= 0).mean())


def throughput(result: Result) -> float:
    """Water that flows through the channel, m^3/s."""
    flow = next(e for e in result.scene.effects if isinstance(e, UniformFlow))
    return flow.velocity[1] * CHANNEL_WIDTH * CHANNEL_HEIGHT


def problem(size: str = "default", variant: str = "fraction") -> Problem:
    """The filter that catches the largest fraction of FLOW_SPEED and FILTER_RADIUS: "fraction", of soft
    steel, or "hard", of magnets with a direction of their own. "throughput": the front of fraction and
    throughput, where speed and radius are free too. Of size "default" only."""
    must(variant in GENES, "variant", f"one of {', '.join(GENES)}", variant)
    fraction = Objective("captured", captured, maximise=True)
    flow = Objective("throughput", throughput, "m^3/s", maximise=True)
    return Problem(
        name=f"filter-{variant}",
        title="A filter of magnetised fibres (B16)",
        description=WANTED[variant],
        genome=Genome(GENES[variant]),
        scene=lambda design, seed: Filter(**design).scene(seed),
        objective=(fraction, flow) if variant == "throughput" else (fraction,),
        meanings=MEANINGS,
        picture=lambda scene, result: caught(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> dict[str, float]:
    """What the best filter is like, in the terms of B16."""
    best = Filter(**design)
    m = np.asarray(best.magnetisation())
    return {
        "fibres": float(round(best.number)),
        "length of a fibre, mm": 1e3 * best.length,
        "wire used, of what there is": round(best.number) * best.length / WIRE,
        "magnetisation to the axis, degrees": float(np.degrees(np.arctan2(m[0], m[2]))),
        "magnetisation over saturation": float(np.linalg.norm(m)) / SATURATION_MAGNETISATION,
    }


def caught(result: Result) -> Figure:
    """The channel from the side and as the flow sees it: fibres, and where particles began and ended."""
    figure = empty(10.4, 6.6)
    side, front = figure.subplots(2, 1, sharex=True)
    state, start = result.state, result.start
    stopped = state["captured_by"] >= 0
    magnets = next(e for e in result.scene.effects if isinstance(e, MagneticCylinders))
    for axis, k in ((side, 1), (front, 0)):
        for body in magnets.cylinders:
            low = np.array([body.centre[2] - body.length / 2, body.centre[k] - body.radius]) / MILLI
            box = Rectangle((low[0], low[1]), body.length / MILLI, 2 * body.radius / MILLI)
            box.set(facecolor="0.85", edgecolor="0.4", lw=0.7)
            axis.add_patch(box)
        shown = ((start, ~stopped, "0.6", "passed by"), (start, stopped, "#dd8899", "caught"),
                 (state, stopped, "#882255", "where it was caught"))  # fmt: skip
        for arrays, which, colour, name in shown:
            z, y = arrays["position"][which][:, 2], arrays["position"][which][:, k]
            axis.plot(z / MILLI, y / MILLI, "o", ms=3, color=colour, label=name)
        axis.set(ylabel=f"{'xy'[k]} (mm)", aspect="equal")
        plain(axis)
    side.set_title(f"from the side, the flow upwards: {stopped.mean():.0%} caught")
    side.legend(frameon=False, fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.02))
    front.set(xlabel="z, along the fibres (mm)")
    front.set_title("as the flow sees it")
    letters((side, front))
    return figure
