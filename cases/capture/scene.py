"""Magnetic colloids that a magnetised fibre captures (B16 chapter 6).

B16 is R. J. Baars, thesis, Utrecht University (2016): particles of table 6.1 in water about a steel cylinder
in a field of 1 T along x, at an angle to its axis. The cylinder is saturated. Its magnetisation has the
direction given by the model of Stoner and Wohlfarth; for the capture volumes of section 6.4.1 it may instead
have the direction of the field. The suspension is so dilute that particles do not interact; their moment is
along the field. A particle that touches the cylinder stays there.

The paper draws its start regions TOP and SIDE but does not give their width. Here they are one cylinder
radius wide and together form the layer around the cylinder; ``part`` chooses one of them.
"""

from tisim import Cloud, RandomAroundCylinder, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common import magnetic_fibre as b16
from tisim.effects import FixedMoment, Magnetophoresis
from tisim.operators import Capture
from tisim.sources import MagneticCylinders, MagneticField
from tisim.steppers import Brownian, DriftLimit

DURATION, NUMBER = 50.0, 100
"""Duration, s, and number of particles of a run (B16 section 6.3)."""
DENSITY = 1500.0
"""The density of particles, kg/m^3. It has no effect without inertia and gravity."""
LONGEST_MOVE, LONGEST_STEP = 2e-6, 0.05
"""Largest displacement (m) and longest step (s) of a particle: the field changes over 300 um."""


SEARCH_SETTINGS = {
    "generations": 60, "max_evaluations": 1600, "ensemble": {"confirm": 20},
}  # fmt: skip

SIZES = {
    "default": Size("100 particles of 125 nm about a short transverse cylinder, 50 s", {}, SEARCH_SETTINGS),
    "longitudinal": Size("the same about a longitudinal cylinder", {"angle": 0.0}),
    "long": Size("the same about a transverse cylinder of length 20 D", {"aspect": 20.0}),
    "25nm": Size("100 particles of 25 nm, which are captured far later", {"nanometres": 25}),
}


def scene(
    nanometres: int = 125,
    angle: float = 90.0,
    aspect: float = 5 / 3,
    part: str = "all",
    number: int = NUMBER,
    duration: float = DURATION,
    seed: int = 0,
    magnetised: b16.Magnetised = "minimum",
) -> Scene:
    """Return particles of a radius of table 6.1 (nm) about a cylinder at an angle (degrees) to the field.

    aspect : length of the cylinder over its diameter.
    part : of the layer in which particles start: "top", beyond both ends; "side", beside the rest; or "all".
    duration : s.
    magnetised : the cylinder, in the direction of least energy ("minimum") or along the field ("fixed").
    """
    body = b16.fibre(angle, aspect, magnetised)
    radius = nanometres * 1e-9
    return Scene(
        name="capture",
        particles=Cloud(
            number=number,
            radius=radius,
            density=DENSITY,
            placement=RandomAroundCylinder(
                axis=body.axis, radius=body.radius, length=body.length, thickness=body.radius, part=part
            ),
            quantities={"saturation_moment": b16.SATURATION_MOMENTS[nanometres]},
        ),
        effects=(
            MagneticField(constant=(b16.APPLIED_FLUX, 0.0, 0.0)),
            MagneticCylinders(cylinders=(body,)),
            FixedMoment(),
            Magnetophoresis(),
            Capture(),
        ),
        stepper=Brownian(
            temperature=b16.WATER_TEMPERATURE,
            viscosity=b16.WATER_VISCOSITY,
            control=DriftLimit(longest=LONGEST_STEP, shortest=1e-9, drift=LONGEST_MOVE / radius),
        ),
        duration=duration,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the capture of a size, from the random start of a seed."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
