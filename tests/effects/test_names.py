"""Two effects of one kind in a scene, distinguished by their names."""

import json
import re

import numpy as np
import pytest

from tests.effects.pair.test_mie import crowd, reference
from tests.scenes import scene, simulate
from tests.throwaway import RandomKicks, SoftShell, Trap
from tisim import InputError, Scene
from tisim.effects import Gravity, Impact, Lorentz, Mie, NearField, Tether
from tisim.engine.assembly import needed_fields
from tisim.operators import Cooling
from tisim.sources import ElectricField
from tisim.state.fields import Field, resolve_fields
from tisim.steppers import IterationControl, Trapezoid, Verlet

CORE, SHELL = Mie(name="core", epsilon=1.0), Mie(name="shell", epsilon=0.3, n=9, m=4, cutoff=2.0)
ONE = ([[0, 0, 0]], [[0, 0, 0]])


class Remembering(SoftShell):
    """A shell whose pairs store two values."""

    memory = 2


def one(*effects, **more):
    """A scene of one grain under these effects."""
    return scene(*ONE, effects, mass=1.0, **more)


@pytest.mark.slow
def test_named_effects_have_their_own_parameters(rng):
    """The forces of two Mie pairs, one of them without a name, are the sum of their NumPy references."""
    for other in (CORE, Mie(epsilon=2.0)):
        setup = crowd(rng, SHELL).model_copy(update={"effects": (other, SHELL)})
        (result,) = simulate([setup])
        expected = reference(other, result.state) + reference(SHELL, result.state)
        alone = reference(SHELL, result.state)
        assert np.abs(expected - alone).max() > 0.1 * np.abs(alone).max()
        np.testing.assert_allclose(
            result.state["force"], expected, rtol=0, atol=1e-7 * np.abs(expected).max()
        )


def test_files_use_names_as_table_names():
    setup = one(CORE, Mie(epsilon=2.0), SHELL)
    tables = setup.to_dict()["effects"]
    assert list(tables) == ["core", "mie", "shell"]
    assert [table.get("kind") for table in tables.values()] == ["mie", None, "mie"]
    assert not any("name" in table for table in tables.values())
    again = Scene.from_dict(json.loads(json.dumps(setup.to_dict())))
    assert again == setup
    assert again.digest() == setup.digest()
    assert '[effects.core]\nkind = "mie"\n' in setup.to_toml()


def test_settings_and_removal_use_names():
    setup = one(CORE, SHELL)
    changed = setup.replace({"effects.core.epsilon": 5.0})
    assert [effect.epsilon for effect in changed.effects] == [5.0, 0.3]
    assert changed.digest() != setup.digest()
    assert setup.without("core").effects == (SHELL,)
    with pytest.raises(InputError, match="effect to leave out must be one of core, shell; received 'mie'"):
        setup.without("mie")
    with pytest.raises(InputError, match=r"^core\.epsilon must be greater than 0\.0; received -1$"):
        setup.replace({"effects.core.epsilon": -1})
    rule = "effects.core.depth.x must be a setting of this scene (effects.core has "
    with pytest.raises(InputError, match=f"^{re.escape(rule)}.*; received 'depth'$"):
        setup.replace({"effects.core.depth.x": 1})


def test_names_are_in_the_digest_and_kinds_are_no_names():
    plain = one(Mie(epsilon=1.0))
    assert list(plain.to_dict()["effects"]) == ["mie"]
    assert "kind" not in plain.to_dict()["effects"]["mie"]
    assert one(Mie(name="mie", epsilon=1.0)).digest() == plain.digest()
    assert one(CORE).digest() != plain.digest()


@pytest.mark.long
def test_two_oscillating_fields_add_up():
    """The force on a charge in both fields is the force in their sum; each field has its own frequency."""
    slow = ElectricField(name="slow", amplitude=(1.0, 0, 0), omega=(3.0, 0, 0))
    fast = ElectricField(name="fast", amplitude=(0, 2.0, 0), omega=(0, 50.0, 0), phase=(0, 0.3, 0))
    setup = one(slow, fast, Lorentz(), quantities={"charge": 1e-6}, dt=0.01, steps=7)
    (result,) = simulate([setup])
    t = result.time
    expected = 1e-6 * np.array([np.sin(3 * t), 2 * np.sin(50 * t + 0.3), 0])
    np.testing.assert_allclose(result.state["force"][0], expected, rtol=1e-12)


def test_each_effect_has_its_own_contact_history():
    two = (Remembering(stiffness=1.0, width=1e-3), Remembering(name="other", stiffness=1.0, width=1e-3))
    users = needed_fields(two, Verlet())
    memories = {
        one.name: who for one, who in users.items() if not isinstance(one, str) and "_partners" in one.name
    }
    assert memories == {"remembering_partners": "remembering", "other_partners": "other"}


class Anchored(Gravity):
    """An effect that declares a field of its own, in another unit than Tether does."""

    fields = (Field("anchor", "mm", 3, "mean", default="position"),)


def test_shared_fields_must_be_declared_equally():
    """Two tethers share the field of initial positions; a conflicting declaration is refused."""
    tethers = (Tether(stiffness=(1.0,) * 3), Tether(name="other", stiffness=(2.0,) * 3))
    shared = resolve_fields(needed_fields(tethers, Verlet()))
    assert [field.name for field in shared].count("anchor") == 1
    with pytest.raises(
        InputError, match=r"^field anchor must be declared as everywhere, Field\(name='anchor', unit='m'"
    ):
        resolve_fields(needed_fields((*tethers, Anchored()), Verlet()))


REFUSED = {
    "effects.mie must be given only once; received 2": lambda: one(Mie(epsilon=1.0), Mie(epsilon=2.0)),
    "effects.core must be given only once; received 2": lambda: one(CORE, NearField(name="core")),
    "effects of kind impact must be at most one in a scene; received 2": lambda: one(
        Impact(hardness=1e5), Impact(name="soft", hardness=1e3)
    ),
    "effects of kind random_kicks must be at most one in a scene; received 2": lambda: one(
        RandomKicks(sigma=1.0), RandomKicks(name="more", sigma=1.0)
    ),
    "effects.cold must be used together with effects.heating; received 'cold'": lambda: one(
        Cooling(name="cold", **{n: 1.0 for n, i in Cooling.model_fields.items() if i.is_required()})
    ),
    "a.b.name must be text of the form ^[A-Za-z][A-Za-z0-9_]*$; received 'a.b'": lambda: Gravity(name="a.b"),
    "effects.core.name must be left out: it is the table's name; received 'x'": lambda: Scene.from_dict(
        {**one().to_dict(), "effects": {"core": {"kind": "mie", "name": "x", "epsilon": 1.0}}}
    ),
    "effects.core.kind must be one of": lambda: Scene.from_dict(
        {**one().to_dict(), "effects": {"core": {"epsilon": 1.0}}}
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_invalid_duplicates_and_names_are_refused(message):
    with pytest.raises(InputError) as fault:
        REFUSED[message]()
    assert str(fault.value).startswith(message)


@pytest.mark.long
def test_a_failure_names_the_effect():
    control = IterationControl(first=1e-2, longest=1e-2, shortest=1e-2)
    traps = (Trap(stiffness=1.0), Trap(name="stiff", stiffness=1e7))
    setup = scene([[1, 0, 0]], [[0, 0, 0]], traps, mass=1.0, stepper=Trapezoid(control=control), duration=1.0)
    (result,) = simulate([setup])
    assert "by effects.stiff, at particle 0" in result.status.reason


@pytest.mark.long
def test_explain_lists_effects_by_name():
    from tisim.describe.explain import explain

    shells = SoftShell(stiffness=1.0, width=1e-3), SoftShell(name="outer", stiffness=0.1, width=2e-3)
    explanation = explain(one(*shells))
    assert [part.name for part in explanation.effects] == ["soft_shell", "outer"]
    assert [dict((n, v) for n, v, *_ in part.parameters)["width"] for part in explanation.effects] == [
        "0.001",
        "0.002",
    ]
