"""Scenes as plain data: TOML and back, changes by dotted key, and a digest of everything that affects
results."""

import subprocess
import sys

import numpy as np
import pytest

from tests.scenes import flow, scene
from tisim import Box, Cloud, InputError, Material, Particles, Scene
from tisim.effects import Agglomeration, DeformationWork, Friction, Heating, Impact, Softening
from tisim.operators import Cooling, Operator
from tisim.steppers import ApproachTime, FixedStep, Verlet


def cloud(**changes):
    settings = {
        "name": "a cloud",
        "particles": Cloud(
            number=7, radius=1e-3, density=2e3, mean_velocity=(1, 2, 3), deviation=(4, 5, 6), temperature=400
        ),
        "effects": (Impact(hardness=1e5), Friction(coefficient=0.3), Heating(heat_capacity=5e2), Cooling()),
        "domain": Box(low=(-1, -1, -1), high=(1, 1, 2), images=False),
        "stepper": Verlet(control=ApproachTime(shortest=1e-7)),
        "duration": 0.5,
        "seed": 2**62 + 1,
    }
    return Scene(**{**settings, **changes})


SCENES = {
    "cloud": cloud,
    "flow": lambda: flow(grains=5),
    "one by one": lambda: scene(
        np.random.default_rng(1).normal(size=(3, 3)),
        np.full((3, 3), 1 / 3),
        radius=[0.1, 1 / 7, 1e-90],
        mass=0.1,
    ),
    "bare": lambda: Scene(particles=Cloud(number=1, radius=1, density=1), duration=1),
    "named oddly": lambda: cloud(name='a "quoted" \\ name\nof two lines, größer'),
}


@pytest.mark.parametrize("make", SCENES.values(), ids=SCENES)
def test_toml_keeps_the_scene_to_the_last_bit(make, tmp_path):
    before = make()
    file = tmp_path / "scene.toml"
    file.write_text(before.to_toml(), encoding="utf-8")
    after = Scene.from_toml(file)
    assert after.to_dict() == before.to_dict()
    assert after.digest() == before.digest()
    assert after.structure() == before.structure()
    assert after.to_toml() == before.to_toml()


def leaves(table, path=()):
    for key, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, (*path, key))
        else:
            yield (*path, key), value


def other(key, value):
    """Another valid value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return value * 0.999 if value else 1e-3
    if isinstance(value, str):
        return value + "x"
    return [other(key, part) for part in value]


def test_digest_changes_with_every_number_in_the_scene():
    """Changing any single leaf of the data changes the digest, and nothing else does."""
    base = flow(grains=3)
    digests = {base.digest()}
    changed = 0
    for path, value in leaves(base.to_dict()):
        if path[-1] in ("kind", "name"):
            continue
        new = other(path[-1], value)
        digests.add(base.replace({".".join(path): new}).digest())
        changed += 1
    assert changed > 25
    assert len(digests) == changed + 1
    assert base.digest() == flow(grains=3).digest()


def test_a_skin_is_part_of_the_scene_and_not_of_its_digest(tmp_path):
    """Results do not depend on the skin, so stored results stay valid."""
    base, file = flow(grains=3), tmp_path / "scene.toml"
    wide = base.replace({"skin": 0.125})
    file.write_text(wide.to_toml(), encoding="utf-8")
    assert Scene.from_toml(file).skin == 0.125
    assert wide.digest() == base.digest()
    with pytest.raises(InputError, match=r"scene.skin must be greater than 0.0; received -1"):
        base.replace({"skin": -1.0})


def test_digest_changes_with_each_quantity_and_effect():
    base = cloud()
    fewer = cloud(effects=(Impact(hardness=1e5), Friction(coefficient=0.3), Heating(heat_capacity=5e2)))
    order = cloud(
        effects=(Friction(coefficient=0.3), Impact(hardness=1e5), Heating(heat_capacity=5e2), Cooling())
    )
    warm, warmer = (
        scene([[0, 0, 0]], [[0, 0, 0]], quantities={"temperature": t})
        for t in (300.0, np.nextafter(300, 301))
    )
    digests = [s.digest() for s in (base, fewer, order, warm, warmer)]
    assert len(set(digests)) == 5, "the order of effects is the order in which they act"


class TestReplace:
    def test_only_named_values_are_changed(self):
        after = cloud().replace({"effects.impact.hardness": 3e5, "duration": 0.25, "particles.number": 9})
        assert after.effects[0].hardness == 3e5
        assert (after.duration, after.particles.number) == (0.25, 9)
        back = after.replace({"effects.impact.hardness": 1e5, "duration": 0.5, "particles.number": 7})
        assert back.digest() == cloud().digest()

    @pytest.mark.parametrize(
        ("key", "value", "message"),
        [
            ("effects.impact.hardness", -1, "impact.hardness must be greater than 0.0; received -1"),
            (
                "effects.impact.hardnes",
                1,
                "impact.hardnes must be a known key: name, hardness, deformation_length, initial_area, "
                "final_area, tolerance or max_iterations; received 1; did you mean 'hardness'?",
            ),
            (
                "effects.impcat.hardness",
                1,
                "effects.impcat.hardness must be a setting of this scene (effects has impact, friction, "
                "heating, cooling); received 'impcat'; did you mean 'impact'?",
            ),
            (
                "duration.long",
                1,
                "duration.long must be a setting of this scene (duration has none); received 'long'",
            ),
            ("duration", 0, "scene.duration must be greater than 0.0; received 0"),
            ("stepper.control.shortest", "soon", "approach_time.shortest must be a number; received 'soon'"),
            (
                "nonsense",
                1,
                "scene.nonsense must be a known key: name, particles, materials, material_pairs, effects, "
                "domain, stepper, accuracy, duration, skin or seed; received 1",
            ),
        ],
    )
    def test_wrong_names_are_reported(self, key, value, message):
        with pytest.raises(InputError) as fault:
            cloud().replace({key: value})
        assert str(fault.value) == message

    def test_a_scene_is_not_checked_again_without_a_change(self):
        """The command line changes each scene; a large cloud would be placed and checked three times."""
        scene = cloud()
        assert scene.replace({}) is scene
        assert scene.without() is scene


class TestWithout:
    def test_only_named_parts_are_left_out(self):
        assert cloud().without("cooling").effects == cloud().effects[:-1]
        assert cloud().without("cooling", "heating").effects == cloud().effects[:-2]

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            (
                "warp",
                "effect to leave out must be one of impact, friction, heating, cooling; received 'warp'",
            ),
            ("heating", "effects.cooling must be used together with effects.heating; received 'impact, "),
        ],
    )
    def test_wrong_names_are_reported(self, name, message):
        with pytest.raises(InputError) as fault:
            cloud().without(name)
        assert str(fault.value).startswith(message)


class TestRequires:
    @pytest.mark.parametrize(
        ("effects", "message"),
        [
            ((Friction(coefficient=0.1),), "effects.friction must be used together with effects.impact"),
            (
                (Impact(hardness=1), DeformationWork()),
                "effects.deformation_work must be used together with effects.heating",
            ),
            ((Agglomeration(),), "effects.agglomeration must be used together with effects.impact"),
            (
                (Impact(hardness=1), Softening(activation_energy=1)),
                "effects.softening must be used together with effects.heating",
            ),
            ((Impact(hardness=1), Impact(hardness=2)), "effects.impact must be given only once; received 2"),
        ],
    )
    def test_an_effect_without_its_requirements_is_refused(self, effects, message):
        with pytest.raises(InputError) as fault:
            cloud(effects=effects)
        assert str(fault.value).startswith(message)
        assert "; received " in str(fault.value)

    def test_an_unmet_contract_is_named(self):
        class Unmet(Operator):
            contract = True

        class Lonely(Operator):
            requires = (Unmet,)

        with pytest.raises(InputError, match=r"^effects\.lonely must be used together with unmet; received"):
            cloud(effects=(Lonely(),))

    def test_quantities_that_effects_need_must_be_given(self):
        from tisim import Simulation

        start = scene([[0, 0, 0]], [[0, 0, 0]], (Impact(hardness=1), Heating(heat_capacity=1)))
        with pytest.raises(InputError, match=r"^particles must be given temperature, .*; received none$"):
            Simulation(start).load([start])


def test_equal_structures_share_a_batch_and_others_do_not():
    base = cloud()
    assert (
        base.structure()
        == cloud(
            seed=3,
            duration=9,
            effects=(
                Impact(hardness=9),
                Friction(coefficient=0),
                Heating(heat_capacity=1),
                Cooling(emissivity=1),
            ),
        ).structure()
    )
    for changes in (
        {"effects": ()},
        {"domain": Box(low=(-1, -1, -1), high=(1, 1, 1), images=True)},
        {"stepper": Verlet(control=FixedStep(dt=1))},
        {"effects": (Impact(hardness=1e5, max_iterations=3), *base.effects[1:])},
    ):
        assert cloud(**changes).structure() != base.structure()


def test_a_scene_is_a_value():
    """It is frozen, including its arrays; later changes of its source data do not affect it."""
    place = np.zeros((2, 3))
    particles = Particles(position=place, velocity=place, radius=1.0, mass=1.0)
    place += 1
    assert particles.position.tolist() == [[0, 0, 0], [0, 0, 0]]
    with pytest.raises(Exception, match="frozen"):
        cloud().duration = 2.0


def test_a_missing_effect_is_named_as_in_the_list():
    """In a process of its own, because no other effect may have been imported yet."""
    code = (
        "import tisim; from tisim.effects import Walls; from tisim.geometry import Plane\n"
        "particles = tisim.Particles(position=[(0, 0, 0)], velocity=[(0, 0, 0)], radius=1e-3, density=1.0)\n"
        "try: tisim.Scene(particles=particles, effects=(Walls(planes=[Plane()]),), duration=1.0)\n"
        "except tisim.InputError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "must be used together with effects.capillary_bridge or effects.granular" in done.stdout


def test_a_scene_and_a_material_are_printed_in_a_line():
    assert (
        repr(cloud())
        == str(cloud())
        == ("Scene('a cloud': 7 particles, Impact, Friction, Heating, Cooling, Verlet, 0.5 s)")
    )
    assert repr(Material(young=1e7, poisson=0.25)) == "Material(young=10000000.0, poisson=0.25)"


@pytest.mark.parametrize("name", ["stepper", "domain"])
def test_a_table_in_place_of_a_part_is_refused_by_name(name):
    with pytest.raises(InputError, match=rf"scene.{name} must be a {name}, not its table"):
        cloud(**{name: {"kind": "verlet"}})
