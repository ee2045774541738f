"""Grains under each granular law at a plane, a disc and a piston: one scene structure for each law.

Together the laws use every part of the contact models. The Hertz-Mindlin law acts beside liquid bridges and
bonds, which have no effect unless a liquid or a cement is given.
"""

import numpy as np
from scipy.integrate import quad

from tests.effects.contact import compositions
from tests.effects.contact.grains import AWAY, FAR, HERTZ_MINDLIN
from tests.scenes import by_id, compiled, scene
from tisim import Material
from tisim.cases.granular_bench import closed_forms
from tisim.effects import CapillaryBridge, Gravity, ParallelBond, Translation, Walls
from tisim.geometry import Disc, Plane

WORLDS, CAPACITY = 16, 64
LAWS = {**compositions.LAWS, "mindlin": HERTZ_MINDLIN}
ELASTIC = {
    **compositions.NEUTRAL,
    "mindlin": {"young": 1e6, "poisson": 0.3, "restitution": 1.0, "friction": 0.0},
}
"""Materials with elastic repulsion only, SI units."""
LOSSY = {
    **compositions.TWO,
    "mindlin": (
        {"young": 1e5, "poisson": 0.25, "restitution": 0.6, "friction": 0.4},
        {"young": 1e6, "poisson": 0.4, "restitution": 0.9, "friction": 0.1},
    ),
}
"""Two materials for each law in which every part of the law acts."""
DRY = {"surface_tension": 0.0, "volume": 1e-12}
LOOSE = {"young": 1e3, "gap": -FAR, "tensile_strength": 1.0, "shear_strength": 1.0}


def grains(name, position, velocity, spin=None, **more):
    """A scene of grains under a law; each has 1 kg and a radius of 1 m unless given.

    first, second : properties of the two materials that differ from ``ELASTIC``. planes, disc, piston :
    walls, far away unless given; a piston is a plane and its velocity (m/s). liquid, cement : parameters of
    the bridges and bonds of the Hertz-Mindlin law.
    """
    position = np.asarray(position, float)
    spin = np.zeros_like(position) if spin is None else spin
    planes, (place, speed) = more.pop("planes", (AWAY,)), more.pop("piston", (AWAY, (0.0, 0.0, 0.0)))
    liquid, cement = more.pop("liquid", DRY), more.pop("cement", LOOSE)
    made = {each: Material(**{**ELASTIC[name], **more.pop(each, {})}) for each in ("first", "second")}
    acting = (
        LAWS[name],
        Walls(
            planes=[Plane(point=point, normal=normal) for point, normal in planes],
            discs=[more.pop("disc", Disc(centre=(FAR, FAR, FAR), radius=1.0))],
        ),
        Walls(
            name="piston",
            planes=[Plane(point=place[0], normal=place[1])],
            motion=Translation(velocity=tuple(speed)),
        ),
        Gravity(acceleration=more.pop("gravity", (0.0, 0.0, 0.0))),
    )
    if name == "mindlin":
        acting = (*acting, CapillaryBridge(**liquid), ParallelBond(**cement))
    given = {"radius": 1.0, "mass": 1.0, **more}
    return scene(position, velocity, acting, quantities={"spin": spin}, materials=made, **given)


def lossy(name):
    """Two materials that lose energy in every way that the law has."""
    soft, hard = LOSSY[name]
    if name == "hooke":
        # If 2 pi k_c R* exceeds the stiffness, cohesion exceeds the repulsion at every overlap.
        soft, hard = ({**one, "cohesion_energy_density": 500.0} for one in (soft, hard))
    return soft, hard


def push(name, overlap, radius, law):
    """The elastic and cohesive force (N) at an overlap (m) for an effective radius R* (m)."""
    if name == "hooke":
        return (law["stiffness"] - 2 * np.pi * radius * law["cohesion_energy_density"]) * overlap
    e_star, energy = law["young"] / (2 * (1 - law["poisson"] ** 2)), law.get("surface_energy", 0.0)
    if name == "jkr":
        return closed_forms.jkr_force(overlap, energy, radius, e_star)
    return 4 / 3 * e_star * radius**0.5 * overlap**1.5 - 4 * np.pi * energy * radius


def stored(name, overlap, radius, law):
    """Energy (J) stored at an overlap (m) for an effective radius R* (m).

    It is the integral of the elastic and cohesive force from the overlap at which the contact ends.
    """
    if name == "hooke":
        return (law["stiffness"] - 2 * np.pi * radius * law["cohesion_energy_density"]) * overlap**2 / 2
    e_star, energy = law["young"] / (2 * (1 - law["poisson"] ** 2)), law.get("surface_energy", 0.0)
    if name == "jkr":
        ends_at = closed_forms.jkr_stretch(energy, radius, e_star)
        return quad(lambda d: closed_forms.jkr_force(d, energy, radius, e_star), -ends_at, overlap)[0]
    return 8 / 15 * e_star * radius**0.5 * overlap**2.5 - 4 * np.pi * energy * radius * overlap


def loaded(scenes):
    """The compiled simulation of one law with these scenes loaded."""
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    return simulation


def ends(scenes):
    """Final states of scenes of one law, sorted by id; every run must succeed."""
    simulation = loaded(scenes)
    simulation.run()
    results = simulation.results()
    for result in results:
        assert result.status.ok, result.status.reason
    return [by_id(result) for result in results]


def kinetic(state):
    """Kinetic energy of each grain, with rotation, J."""
    inertia = 0.4 * state["mass"] * state["radius"] ** 2
    moving = state["mass"] * (state["velocity"] ** 2).sum(axis=1)
    return 0.5 * (moving + inertia * (state["spin"] ** 2).sum(axis=1))
