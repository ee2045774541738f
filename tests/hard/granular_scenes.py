"""Grains under each granular law at a plane, at a disc and at a piston: one structure for each law.

The laws have all parts between them. That of Hertz and Mindlin acts beside liquid bridges and bonds, which do
nothing unless a liquid or a cement is given.
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
"""Materials that press alone, SI."""
LOSSY = {
    **compositions.TWO,
    "mindlin": (
        {"young": 1e5, "poisson": 0.25, "restitution": 0.6, "friction": 0.4},
        {"young": 1e6, "poisson": 0.4, "restitution": 0.9, "friction": 0.1},
    ),
}
"""Two materials of each law in which every part does something."""
DRY = {"surface_tension": 0.0, "volume": 1e-12}
LOOSE = {"young": 1e3, "gap": -FAR, "tensile_strength": 1.0, "shear_strength": 1.0}


def grains(name, position, velocity, spin=None, **more):
    """Grains given one by one under a law, 1 kg each and 1 m in radius unless said.

    first, second : what their two materials have other than those that press alone. planes, disc, piston :
    walls, far away unless given; a piston is a plane and its velocity (m/s). liquid, cement : what bridges
    and bonds have under the law of Hertz and Mindlin.
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
        # Where 2 pi k_c R* is above the stiffness nothing holds grains apart.
        soft, hard = ({**one, "cohesion_energy_density": 500.0} for one in (soft, hard))
    return soft, hard


def push(name, overlap, radius, law):
    """The elastic and cohesive force (N) at an overlap (m) of some R* (m)."""
    if name == "hooke":
        return (law["stiffness"] - 2 * np.pi * radius * law["cohesion_energy_density"]) * overlap
    e_star, energy = law["young"] / (2 * (1 - law["poisson"] ** 2)), law.get("surface_energy", 0.0)
    if name == "jkr":
        return closed_forms.jkr_force(overlap, energy, radius, e_star)
    return 4 / 3 * e_star * radius**0.5 * overlap**1.5 - 4 * np.pi * energy * radius


def stored(name, overlap, radius, law):
    """What an overlap (m) of some R* (m) holds of energy, J: the integral of the elastic and cohesive
    force from where contact ends."""
    if name == "hooke":
        return (law["stiffness"] - 2 * np.pi * radius * law["cohesion_energy_density"]) * overlap**2 / 2
    e_star, energy = law["young"] / (2 * (1 - law["poisson"] ** 2)), law.get("surface_energy", 0.0)
    if name == "jkr":
        ends_at = closed_forms.jkr_stretch(energy, radius, e_star)
        return quad(lambda d: closed_forms.jkr_force(d, energy, radius, e_star), -ends_at, overlap)[0]
    return 8 / 15 * e_star * radius**0.5 * overlap**2.5 - 4 * np.pi * energy * radius * overlap


def loaded(scenes):
    """The simulation that scenes of one law share, with these in it."""
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    return simulation


def ends(scenes):
    """States of scenes of one law at their ends, by id; each goes well."""
    simulation = loaded(scenes)
    simulation.run()
    results = simulation.results()
    for result in results:
        assert result.status.ok, result.status.reason
    return [by_id(result) for result in results]


def kinetic(state):
    """Energy of motion and of spin of each grain, J."""
    inertia = 0.4 * state["mass"] * state["radius"] ** 2
    moving = state["mass"] * (state["velocity"] ** 2).sum(axis=1)
    return 0.5 * (moving + inertia * (state["spin"] ** 2).sum(axis=1))


def momenta(state):
    """Momentum of all grains, and their angular momentum about the origin; shape (6,)."""
    momentum = state["mass"][:, None] * state["velocity"]
    inertia = 0.4 * (state["mass"] * state["radius"] ** 2)[:, None]
    turning = np.cross(state["position"], momentum) + inertia * state["spin"]
    return np.concatenate([momentum, turning], axis=1).sum(axis=0)
