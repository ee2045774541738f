"""A valve of a magnetorheological fluid: a constriction that iron grains jam in a field (L21 section 3.4.4).

Oil with a prescribed velocity drags grains through a constriction of a round duct. After a while a field
across the duct is switched on, and the grains form chains, which either arrest the flow or yield and flow on.
The duct is periodic along the flow: grains that leave it below enter it above.

It is the simulation of L21 section 3.4.4. SIZES and the page of the case list the differences at the sizes
for a laptop.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tisim import Box, Cloud, GrainClass, Particles, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common import magnetorheological_fluid as fluid
from tisim.cases.valve import published
from tisim.cases.valve.duct import Duct
from tisim.effects import CARBONYL_IRON, MutualInducedMoment, StokesDrag, TruncatedDipoleDipole
from tisim.errors import must
from tisim.scene.initial_state import Arrays
from tisim.sources import MagneticField
from tisim.sources.switched import NO_END
from tisim.steppers import FixedStep, Verlet

TITLE = "A magnetorheological valve: jam or flow by constriction, grain size and field"

D = published.LARGEST
"""Diameter of the coarse grains, m, equal to L21's largest."""
FINE_DIAMETER = D / 2
"""Diameter of the fine grains, m."""
COARSE, FINE_GRAINS = fluid.equal(D / 2, 1.0), fluid.equal(FINE_DIAMETER / 2, 1.0)
"""Grains of one size: the largest of L21, and half as large."""
THROATS = (4 * D, 6.5 * D)
"""Diameters of the constrictions, m."""
BORE, LENGTH = 8 * D, 8 * D
"""Diameter and length of the duct, m."""

L21_BORE, L21_LENGTH = 3.2e-3, 0.9e-3
"""Diameter of the duct of L21, m, and its length. L21 does not state the diameter; here it is an eighth of an
inch, which leaves 0.4 mm of wall in a valve that is 4 mm wide (its table 3.1). With this length, its oil
drags grains at rest with 90, 117 and 141 kPa in constrictions 20, 30 and 40 grains wide, close to its 100
kPa."""
GRADIENT = published.PRESSURE / L21_LENGTH
"""The drag on grains at rest per volume of the duct, Pa/m: L21's 100 kPa over that length."""

SEARCHED: dict[str, Any] = {"flowing": 0.0, "lasting": 4e-4}
"""Settings of the runs in a search: the field is on from the beginning."""
SEARCH_SETTINGS = {
    "generations": 6, "options": {"population": 8, "first": 12}, "ensemble": {"min_starts": 4, "confirm": 8},
}  # fmt: skip
"""With one start, some valves jam by chance, and a search would select those."""
FLOWING, LASTING = 0.1e-3, 0.5e-3
"""Durations of the flow without a field and with it, s."""
CUTOFF = 4.4
"""Cut-off of magnetisation and attraction between grains, in radii. In diameters it equals the range in L21's
cell (section 2.4.3), a gap of 8 um between grains of 6.7 um."""
FIELD = 0.3
"""Flux density of the field, T."""
SUSCEPTIBILITY = CARBONYL_IRON.parameters()["susceptibility"]
"""Susceptibility of carbonyl iron."""
SLOPE = 1.0
"""Length of a cone divided by the decrease of the radius along it."""


def l21(ratio: int, **more: Any) -> dict[str, Any]:
    """Return the settings of L21's valve with a constriction ``ratio`` grains wide."""
    throat = published.CONSTRICTIONS[ratio]
    return {
        "throat": throat, "bore": L21_BORE, "straight": throat / 4, "slope": 0.25, "length": L21_LENGTH,
        "grains": fluid.classes(fluid.VALVE_GRAINS, "mass"), "speed": published.OIL_SPEED,
        "dt": published.STEP, "flux": published.FLUX, "flowing": published.UNMAGNETISED, "lasting": 4e-3,
        **more,
    }  # fmt: skip


SIZES = {
    "default": Size(
        "185 grains of 44 um, a constriction of 4 diameters in a duct of 8 by 8", {}, SEARCH_SETTINGS
    ),
    "l21_20": Size("L21's numbers: a constriction of 0.88 mm, 44,668 grains of its coarse mixture", l21(20)),
    "l21_30": Size("the same, 1.32 mm, 47,782 grains", l21(30)),
    "l21_40": Size("the same, 1.76 mm, 53,848 grains", l21(40)),
    "l21_fine": Size(
        "1.32 mm, 1,498,645 grains of L21's fine mixture, in a shorter duct with a shorter constriction",
        l21(
            30,
            grains=fluid.classes(fluid.FINE_VALVE_GRAINS, "mass"),
            dt=published.FINE_STEP,
            straight=0.1e-3,
            slope=0.1,
            length=0.4e-3,
        ),
    ),
}


def duct(throat: float, bore: float, straight: float, slope: float, length: float) -> Duct:
    """Return the duct of a valve; lengths in m. slope : length of a cone divided by the decrease of the
    radius."""
    return Duct(throat, bore, straight, slope * (bore - throat) / 2, length)


def mean_radius(grains: Sequence[GrainClass]) -> float:
    """Return the number-averaged mean radius of the grains of a mixture, m."""
    numbers = np.array([one.number() for one in grains])
    radii = np.array([one.sizes.mean_radius() for one in grains])
    return float(numbers @ radii / numbers.sum())


def step(radius: float, young: float) -> float:
    """Return a step (s) for grains with a smallest radius (m) and a Young's modulus (Pa), to two digits.

    It is L21's step, scaled like the duration of an impact by Hertz.
    """
    smaller = 2 * radius / (fluid.VALVE_GRAINS[-1][0] * published.MICRO)
    return float(f"{published.STEP * smaller * (published.YOUNG / young) ** 0.4:.2g}")


def speed_of(pressure: float, duct: Duct, grains: Sequence[GrainClass], fraction: float) -> float:
    """Return the speed of the oil along the duct (m/s) at which the drag equals a pressure (Pa) on its
    cross-section.

    The drag is that on grains at rest, evenly distributed over the duct.
    """
    volume = duct.filling().volume()
    density = fluid.number_of(grains, fraction, volume) / volume
    drag = 6 * np.pi * published.OIL_VISCOSITY * mean_radius(grains) * density * duct.oil_through()
    return float(pressure * duct.area / drag)


def continued(state: Arrays) -> Particles:
    """Return the grains of a state as the start of another run of the same structure, in the order of their
    ids.

    Contact springs and moments are those at the end of the first run.
    """
    order = np.argsort(state["id"])
    core = {name: state[name][order] for name in ("position", "velocity", "radius", "mass")}
    made_anew = {*core, "id", "force", "torque"}
    return Particles(**core, quantities={name: state[name][order] for name in state if name not in made_anew})


def scene(
    throat: float = THROATS[0],
    grains: Sequence[GrainClass] = COARSE,
    flux: float = FIELD,
    pressure: float | None = None,
    speed: float | None = None,
    fraction: float = published.FRACTION,
    seed: int = 0,
    bore: float = BORE,
    straight: float | None = None,
    slope: float = SLOPE,
    length: float = LENGTH,
    flowing: float = FLOWING,
    lasting: float = LASTING,
    reopened: float = 0.0,
    state: Arrays | None = None,
    young: float = published.YOUNG,
    dt: float | None = None,
    friction: float = published.FRICTION,
) -> Scene:
    """Return the scene of a valve.

    throat, bore : diameters of the constriction and of the duct, m. grains : the mixture. flux : density of
    the field along x, T.
    pressure : drag on grains at rest over the cross-section, Pa; by default from the gradient of L21.
    speed : of the oil along the duct, m/s, instead of the pressure. fraction : of the volume that is filled
    by grains.
    straight : length of the constriction, m; by default a quarter of its diameter.
    slope : length of the cones before and after it divided by the decrease of the radius. length : of the
    duct, m.
    flowing, lasting : durations without a field and with it, s.
    reopened : duration after the field has been switched off again, s; with 0 the field has no end.
    state : a state of this structure to begin from, by name, instead of a random start.
    young : Pa.
    dt : s; by default L21's step scaled to this size and modulus. friction : coefficient of sliding friction.

    All are values of one structure: valves that differ in them run as one batch.
    """
    shape = duct(throat, bore, throat / 4 if straight is None else straight, slope, length)
    must(pressure is None or speed is None, "pressure", "left out if the speed is given", pressure)
    if speed is None:
        speed = speed_of(GRADIENT * length if pressure is None else pressure, shape, grains, fraction)
    half = (bore / 2, bore / 2, length / 2)
    return Scene(
        name="valve",
        particles=Cloud(
            number=fluid.number_of(grains, fraction, shape.filling().volume()),
            grains=tuple(grains),
            placement=shape.filling(),
        )
        if state is None
        else continued(state),
        materials={"iron": fluid.iron(young, friction=friction)},
        domain=Box(low=(-half[0], -half[1], -half[2]), high=half, periodic=(False, False, True)),
        effects=(
            MagneticField(
                constant=(flux, 0.0, 0.0), begin=flowing, end=flowing + lasting if reopened > 0 else NO_END
            ),
            # One sweep a step, as in L21 (section 2.2.3).
            MutualInducedMoment(susceptibility=SUSCEPTIBILITY, sweeps=0, cutoff=CUTOFF),
            TruncatedDipoleDipole(cutoff=CUTOFF),
            fluid.contact_law(),
            shape.walls(),
            shape.oil(speed),
            StokesDrag(viscosity=published.OIL_VISCOSITY),
        ),
        stepper=Verlet(control=FixedStep(dt=step(fluid.smallest(grains), young) if dt is None else dt)),
        duration=flowing + lasting + reopened,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the scene of a size."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
