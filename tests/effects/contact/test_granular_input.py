"""Hertz, Mindlin and walls: invalid scenes are refused by name; steps that are too long stop the world."""

import numpy as np
import pytest

from tests.effects.contact.grains import CAPACITY, FLOOR, HERTZ_MINDLIN, USUAL, WORLDS, grains
from tests.scenes import scene, simulate
from tisim import GrainClass, InputError, Material, MaterialPair, Open
from tisim.effects import (
    DMT,
    JKR,
    SJKR,
    CapillaryBridge,
    Granular,
    Hertz,
    HertzMaterial,
    Hooke,
    TwistingMarshall,
    Walls,
)
from tisim.geometry import Plane
from tisim.operators import InsertionByFlux
from tisim.packing import EqualSizes
from tisim.steppers import Verlet
from tisim.testing.uncompiled import started

# Grains overlap deeply at the start here, on purpose.
pytestmark = pytest.mark.filterwarnings("ignore::tisim.errors.StartWarning")


def material(**changes):
    return Material(**{**USUAL, **changes})


def one(*acting, **more):
    return scene([[0, 0, 0]], [[0, 0, 0]], acting, **{"materials": {"grain": material()}, **more})


LACKING = {"grain": Material(young=1e7, poisson=0.3, restitution=0.5), "glass": material()}
ALONE = f"effects.walls must be used together with effects.{CapillaryBridge.kind()} or effects.granular"
WRONG = {
    "material.young must be greater than 0.0; received 0": lambda: material(young=0),
    "material.poisson must be greater than -1.0; received -1": lambda: material(poisson=-1),
    "material.poisson must be at most 0.5; received 0.6": lambda: material(poisson=0.6),
    "material.restitution must be at least 0.0; received -0.1": lambda: material(restitution=-0.1),
    "material.restitution must be at most 1.0; received 1.5": lambda: material(restitution=1.5),
    "material.friction must be at least 0.0; received -0.1": lambda: material(friction=-0.1),
    "material.friction must be a finite number; received nan": lambda: material(friction=float("nan")),
    "walls must be given a plane or a surface; received none": lambda: Walls(planes=()),
    "plane.normal must be a direction; received (0.0, 0.0, 0.0)": lambda: Plane(normal=(0, 0, 0)),
    "plane.normal must be a direction; received (0.0, 0.0, 1e-200)": lambda: Plane(normal=(0, 0, 1e-200)),
    f"{ALONE}; received 'walls'": lambda: one(Walls(planes=[Plane()])),
    f"{ALONE}; received 'hertz, walls'": lambda: one(Hertz(young=1, poisson=0), Walls(planes=[Plane()])),
    "stepper.control must be one that suits granular, such as fixed_step or the control of an implicit "
    "stepper; received 'approach_time'": lambda: one(HERTZ_MINDLIN, stepper=Verlet()),
    "effects.granular must be given only once; received 2": lambda: one(HERTZ_MINDLIN, HERTZ_MINDLIN),
    "materials must be given, as hertz_material needs them; received none": lambda: one(
        HERTZ_MINDLIN, materials={}
    ),
    "materials.grain.friction must be given (coefficient mu of friction), as mindlin_force needs it; "
    "received nothing": lambda: one(HERTZ_MINDLIN, materials=LACKING),
    "material_pairs.grain-clay must be named after two of its materials (grain), as in steel-rubber; "
    "received 'grain-clay'": lambda: one(
        HERTZ_MINDLIN, material_pairs={"grain-clay": MaterialPair(friction=1)}
    ),
    "material_pairs.grain-glass must be given once; received 'glass-grain'": lambda: one(
        HERTZ_MINDLIN,
        materials={"grain": material(), "glass": material()},
        material_pairs={"glass-grain": MaterialPair(), "grain-glass": MaterialPair()},
    ),
    "a name of materials must be letters, digits and _, a letter first; received 'a b'": lambda: one(
        materials={"a b": material()}
    ),
    "walls.material must be one of the materials of the scene (grain); received 'grian'; did you "
    "mean 'grain'?": lambda: one(HERTZ_MINDLIN, Walls(planes=[Plane()], material="grian")),
    "granular.tangential must be given, as the resistance to twisting needs it; received nothing": lambda: (
        Granular(twisting=TwistingMarshall())
    ),
    "granular.cohesion must be left out, as jkr is adhesive itself; received 'dmt'": lambda: Granular(
        normal=JKR(), cohesion=DMT()
    ),
}


def cohesive(normal, density, radius, pairs=None, material=None, acting=(), **given):
    """Check cohesion for grains in a row, and for walls, as at the start of a run; ``given`` changes the
    values of "grain"."""
    law = Granular(normal=normal, cohesion=SJKR())
    own = {"stiffness": 2e4, "young": 1e6, "poisson": 0.3, "cohesion_energy_density": density, **given}
    other = {**own, "cohesion_energy_density": 1.0}
    made = scene(
        9.0 * np.arange(len(radius))[:, None] * [1.0, 0.0, 0.0],
        np.zeros((len(radius), 3)),
        (law, *acting),
        radius=radius,
        material=material,
        materials={"grain": Material(**own), "dust": Material(**other)},
        material_pairs=pairs or {},
    )
    for effect in made.acting():
        effect.check_start(made.start(), made)


FLAT = Walls(planes=[Plane()], material="grain")
MOST = 2e4 / (2 * np.pi)
"""J/m^3; the largest cohesion for which this stiffness keeps grains of R* = 1 m apart."""
COHESIVE = {
    "of the largest two": ("1 m touches grain of 0.5 m", (Hooke(), 3 * MOST, [0.2, 0.5, 1.0])),
    "of a wall": ("1 m in radius touches walls", (Hooke(), MOST, [1.0], None, None, (FLAT,))),
    "of two materials": (
        "dust of 0.5 m",
        (Hooke(), 1.0, [1.0, 0.5], {"dust-grain": MaterialPair(cohesion_energy_density=3 * MOST)}, [0, 1]),
    ),
    "beside hertz": ("3 m touches grain of 3 m", (HertzMaterial(), 1e6 / (1.82 * 1.5 * np.pi), [3.0, 3.0])),
}
"""Cohesions at exactly their limit."""


@pytest.mark.parametrize("case", COHESIVE)
def test_cohesion_without_an_equilibrium_is_refused(case):
    """Above k / (2 pi R*) with a linear spring, and 2 E* / (3 pi) with Hertz; just below, the scene is
    accepted."""
    words, (normal, density, *more) = COHESIVE[case]

    def answer(part):
        scaled = [{k: MaterialPair(cohesion_energy_density=part * p.cohesion_energy_density)
                   for k, p in one.items()} if isinstance(one, dict) else one for one in more]  # fmt: skip
        try:
            cohesive(normal, part * density, *scaled)
        except InputError as fault:
            return str(fault)
        return ""

    assert answer(0.999) == ""
    message = answer(1.001)
    assert message.startswith(f"granular.cohesion must be below the repulsion of {normal.kind()} at")
    assert words in message


def test_cohesion_is_checked_for_inserted_grains():
    """Two grains of one class, grains of two classes, an inserted grain with one of the start, and a grain at
    a wall."""
    dense = {"dust-grain": MaterialPair(cohesion_energy_density=3.1 * MOST)}
    coarse, fine = ("grain", 1.0), ("dust", 0.5)
    for words, classes, density, more in (
        ("grain of 1 m touches grain of 1 m", (coarse,), 2.1 * MOST, {}),
        ("grain of 1 m touches dust of 0.5 m", (coarse, fine), 1.0, {"pairs": dense}),
        ("grain of 1 m touches grain of 0.2 m", (coarse,), 6.1 * MOST, {"number": 1}),
        ("grain of 1 m in radius touches walls", (coarse,), 1.1 * MOST, {"walls": (FLAT,)}),
    ):
        number, walls = more.get("number", 9), more.get("walls", ())
        put = InsertionByFlux(
            low=(0, 0, 2), high=(9, 9, 9), flux=1.0, number=number,
            grains=[
                GrainClass(sizes=EqualSizes(radius=radius), density=1.0, material=material)
                for material, radius in classes
            ],
        )  # fmt: skip
        given = ([0.2], more.get("pairs"), [0], (put, *walls))
        cohesive(Hooke(), 0.9 * density, [0.2], {}, [0], (put, *walls))
        with pytest.raises(InputError) as fault:
            cohesive(Hooke(), density, *given)
        assert words in str(fault.value)


def test_failure_hints_of_walls_follow_the_laws():
    """The failure hint mentions cohesion for a law whose cohesion grows with the overlap; a liquid bridge
    adds none."""
    long, held = (
        "a step is too long for the springs and dashpots of a contact, or for how fast surfaces meet",
        "or no elastic force holds the cohesion there",
    )
    bridge = CapillaryBridge(surface_tension=1.0, volume=1e-3)
    for laws, words in (
        ((Granular(normal=Hooke()),), long),
        ((Granular(normal=Hooke(), cohesion=SJKR()), bridge), f"{long}, {held}"),
        ((bridge,), ""),
    ):
        assert FLAT.failure_hint((FLAT, *laws), Open()) == words


def test_a_scene_is_checked_before_it_runs():
    """The check runs whenever a scene is loaded."""
    made = one(Granular(normal=Hooke(), cohesion=SJKR()), Walls(planes=[Plane()]), radius=1.0,
               materials={"grain": Material(stiffness=1.0, cohesion_energy_density=1.0)})  # fmt: skip
    wrong = "granular.cohesion must be below the repulsion of hooke at an overlap of R*, 1 N, when grain of "
    with pytest.raises(InputError) as fault, started(made):
        pass
    assert str(fault.value) == f"{wrong}1 m in radius touches walls; received 6.283"


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message


def ends(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=CAPACITY)


@pytest.mark.long
def test_too_long_steps_stop_the_world_and_are_named():
    """A modulus that overflows, and steps too long for a pair, its damping and a wall; the previous state is
    kept."""
    far = {"dt": 1e-3, "steps": 1000}
    stiff = {"law": {"young": 1e15}, **far}
    couple = [[0, 0, 9], [2.1, 0, 9]]
    made = {
        "no number": (
            grains([[0, 0, 5], [1, 0, 5]], [[0, 0, 0]] * 2, law={"young": 1e300}, **far),
            "granular",
        ),
        "pair": (grains(couple, [[0, 0, 0], [-9, 0, 0]], **stiff), "granular"),
        "wall": (grains([[0, 0, 1.1]], [[0, 0, -9]], planes=[FLOOR], **stiff), "walls"),
        "deep at the start": (
            grains([[0, 0, 9], [1.9, 0, 9]], [[0, 0, 0]] * 2, law={"young": 1e10}, **far),
            "granular",
        ),
        # S_n dt^2 is 1.2 m* after a step: too long because of its damping alone.
        "damping": (
            grains([[0, 0, 9], [1.9, 0, 9]], [[0, 0, 0]] * 2, law={"restitution": 1e-3}, dt=6.4e-4, steps=9),
            "granular",
        ),
        "in a wall at the start": (
            grains([[0, 0, 0.9]], [[0, 0, 0]], planes=[FLOOR], law={"young": 1e10}, **far),
            "walls",
        ),
        "slow": (grains([[0, 0, 1.1]], [[0, 0, -9]], planes=[FLOOR], dt=0.05, steps=99), "walls"),
    }
    for (_, by), result in zip(made.values(), ends([one for one, _ in made.values()]), strict=True):
        assert not result.status.ok
        for word in ("not finite", f"effects.{by}", "particle 0 (this happens if a step is too long for"):
            assert word in result.status.reason
        for name in ("position", "velocity", "spin"):
            assert np.isfinite(result.state[name]).all(), name
        assert np.abs(result.state["velocity"]).max() <= 9


@pytest.mark.long
def test_deep_overlaps_return_their_stored_energy():
    """A grain far beyond a wall, one within a larger one, and centres 1e-6 radii apart: the energy is Hertz's
    8/15 E* sqrt(R*) delta^2.5, in steps that resolve the motion."""
    e_star = USUAL["young"] / (2 * (1 - USUAL["poisson"] ** 2))
    more = {"law": {"restitution": 1.0}, "dt": 1e-5, "steps": 4000}
    still = [[0, 0, 0]] * 2
    made = [
        (grains([[0, 0, -2]], still[:1], planes=[FLOOR], **more), 1, 3),
        (grains([[0, 0, 5], [0.3, 0, 5]], still, radius=[1, 0.5], **more), 1 / 3, 1.2),
        (grains([[0, 0, 5], [1e-6, 0, 5]], still, **more), 0.5, 2 - 1e-6),
    ]
    for (_, radius, overlap), result in zip(made, ends([one for one, *_ in made]), strict=True):
        assert result.status.ok, result.status.reason
        moving = 0.5 * (result.state["velocity"] ** 2).sum()
        assert moving == pytest.approx(8 / 15 * e_star * radius**0.5 * overlap**2.5, rel=1e-3)
        np.testing.assert_array_equal(result.state["spin"], 0)
