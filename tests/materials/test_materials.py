"""Materials: mixing rules, names, files, and particles of several materials."""

import numpy as np
import pytest

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.scenes import scene
from tisim import InputError, Material, MaterialPair, Scene
from tisim.effects import HertzMaterial
from tisim.engine.assembly import needed_fields
from tisim.materials.materials import Materials

STEEL = Material(young=2e11, poisson=0.3, restitution=0.8, friction=0.4, stiffness=1e6)
RUBBER = Material(young=2e8, poisson=0.49, restitution=0.2, friction=0.9, stiffness=1e3)
TWO = {"steel": STEEL, "rubber": RUBBER}


def two(material=("rubber", "steel"), materials=TWO, **more):
    """A scene of one grain of each material."""
    place = [[0, 0, 0], [1, 0, 0]]
    return scene(place, np.zeros((2, 3)), (HERTZ_MINDLIN,), material=material, materials=materials, **more)


def test_two_materials_are_mixed_by_their_rules_and_by_the_table():
    """The effective elastic constants are the Hertz-Mindlin ones, also for moduli that differ by a factor of
    1000."""
    pairs = Materials(TWO, {"rubber-steel": MaterialPair(restitution=0.55)}).touching()
    same, mixed, back, other = pairs
    assert mixed.effective_young == pytest.approx(1 / ((1 - 0.09) / 2e11 + (1 - 0.49**2) / 2e8), rel=1e-14)
    shear = [e / (2 * (1 + nu)) for e, nu in ((2e11, 0.3), (2e8, 0.49))]
    expected = 1 / ((2 - 0.3) / shear[0] + (2 - 0.49) / shear[1])
    assert mixed.effective_shear == pytest.approx(expected, rel=1e-14)
    assert mixed.mixed("friction") == pytest.approx((0.4 * 0.9) ** 0.5, rel=1e-14)
    assert mixed.mixed("stiffness") == pytest.approx(2 / (1e-6 + 1e-3), rel=1e-14)
    assert [pair.mixed("restitution") for pair in pairs] == [0.8, 0.55, 0.55, 0.2]
    assert back.effective_young == mixed.effective_young
    assert (same.mixed("friction"), other.mixed("friction")) == (0.4, 0.9)


def test_materials_are_kept_in_files_and_changed_by_dotted_keys():
    made = two(material_pairs={"steel-rubber": MaterialPair(friction=0.7)})
    again = Scene.from_dict(made.to_dict())
    assert again == made
    assert again.digest() == made.digest()
    text = made.to_toml()
    assert "[materials.steel]" in text
    assert "[material_pairs.steel-rubber]" in text
    changed = made.replace({"materials.steel.friction": 0.3, "material_pairs.steel-rubber.friction": 0.2})
    assert changed.materials["steel"].friction == 0.3
    assert changed.material_pairs["steel-rubber"].friction == 0.2
    assert changed.digest() != made.digest()
    assert changed.structure() == made.structure()


def test_a_part_of_a_law_may_be_given_by_its_name():
    data = two().to_dict()
    data["effects"]["granular"] = {"normal": "hertz_material", "tangential": "mindlin_force"}
    assert Scene.from_dict(data).effects[0].normal == HertzMaterial()
    with pytest.raises(
        InputError, match=r"effects.granular.normal.kind must be one of .*hooke.*; received 'hoke'"
    ):
        Scene.from_dict({**data, "effects": {"granular": {"normal": "hoke"}}})


def test_particles_name_or_number_their_material_if_there_are_several():
    for given in (("rubber", "steel"), (1, 0), np.array([1, 0])):
        np.testing.assert_array_equal(two(given).start()["material"], [1, 0])
    np.testing.assert_array_equal(two("rubber").start()["material"], [1, 1])
    assert "material" not in two(None).start()
    several, one = two().acting(), two(None, materials={"steel": STEEL}).acting()
    names = [
        {getattr(f, "name", f) for f in needed_fields(acting, two().stepper)} for acting in (several, one)
    ]
    assert ["material" in fields for fields in names] == [True, False]


WRONG = {
    "particles.material must be one of the materials of the scene (steel, rubber); received 'steal'; did you "
    "mean 'steel'?": lambda: two(("steal", "rubber")),
    "particles.material must be below 2, the materials; received 2": lambda: two((0, 2)),
    "particles.material must be one, or 2 of them; received 3": lambda: two((0, 1, 1)),
    "particles.material must be names or numbers; received 0.5": lambda: two(0.5),
    "materials.rubber.young must be given (Young's modulus E, Pa), as hertz_material needs it; received "
    "nothing": lambda: two(materials={"steel": STEEL, "rubber": Material(poisson=0.4)}),
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        WRONG[message]()
    assert str(fault.value) == message


def test_a_wrong_material_in_a_file_is_named():
    data = two().to_dict()
    with pytest.raises(
        InputError, match=r"^scene.materials.rubber.young must be greater than 0.0; received -1"
    ):
        Scene.from_dict({**data, "materials": {**data["materials"], "rubber": {"young": -1}}})
    pairs = {"steel-rubber": {"friktion": 1}}
    with pytest.raises(InputError, match=r"^scene.material_pairs.steel-rubber.friktion must be a known key"):
        Scene.from_dict({**data, "material_pairs": pairs})


def test_pair_values_replace_values_of_single_materials():
    """A pair friction from the table needs no friction of the single materials."""
    alone = {name: Material(young=1e7, poisson=0.3, restitution=0.5) for name in ("a", "b")}
    pairs = {f"{a}-{b}": MaterialPair(friction=0.1) for a, b in ("aa", "ab", "bb")}
    assert two(("a", "b"), alone, material_pairs=pairs)
    with pytest.raises(InputError, match=r"materials.b.friction must be given"):
        two(("a", "b"), alone, material_pairs={"a-a": pairs["a-a"], "a-b": pairs["a-b"]})
