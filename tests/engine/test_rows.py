"""A parameter that is a list of components: in files, by dotted keys, and in kernels."""

import tomllib

import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim import InputError, Scene
from tisim.backend.taichi import ti
from tisim.components.component import Component, Vector
from tisim.effects import Force, parameter


class Spring(Component):
    """A spring to a point."""

    stiffness: float = parameter("N/m", "stiffness", gt=0)
    end: Vector = parameter("m", "end")


class Springs(Force):
    """F = sum of k (end - r) over springs. Source: Hooke (1678)."""

    share: float = parameter("", "share", 1.0)
    springs: tuple[Spring, ...]

    @ti.func
    def force(self, s, w, i, t):
        total = 0.0 * s.velocity[w, i]
        for k in range(self.springs.size(w)):
            total += self.springs.stiffness(w, k) * (self.springs.end(w, k) - s.position[w, i])
        return self.share(w) * total


def hung(rng, n, share=1.0):
    springs = [Spring(stiffness=rng.uniform(1, 2), end=rng.normal(size=3)) for _ in range(n)]
    return scene(
        rng.normal(size=(3, 3)),
        np.zeros((3, 3)),
        (Springs(springs=springs, share=share),),
        mass=1.0,
        dt=1e-3,
        steps=1,
    )


@pytest.mark.long
def test_each_world_has_its_own_number(rng):
    """None, one, and more than the initial size of the table; the same bits alone."""
    worlds = [hung(rng, 5), hung(rng, 0), hung(rng, 1, share=0.5), hung(rng, 31)]
    together = simulate(worlds, worlds=4, capacity=4)
    for setup, result in zip(worlds, together, strict=True):
        law = setup.effects[0]
        r = result.state["position"]
        pull = [s.stiffness * (np.array(s.end) - r) for s in law.springs]
        np.testing.assert_allclose(result.state["force"], law.share * sum(pull, np.zeros((3, 3))), atol=1e-13)
    (alone,) = simulate(worlds[3:], worlds=4, capacity=4)
    np.testing.assert_array_equal(alone.state["force"], together[3].state["force"])
    (many,) = simulate([hung(rng, 40)], worlds=4, capacity=4)
    assert many.status.ok


def test_files_and_dotted_keys(rng):
    """An array of tables in TOML; a row by its number."""
    setup = hung(rng, 2)
    assert setup.to_toml().count("[[effects.springs.springs]]") == 2
    for again in (Scene.from_dict(setup.to_dict()), Scene.from_dict(tomllib.loads(setup.to_toml()))):
        assert again == setup
        assert again.digest() == setup.digest()
    changed = setup.replace({"effects.springs.springs.1.stiffness": 7})
    assert [s.stiffness for s in changed.effects[0].springs] == [setup.effects[0].springs[0].stiffness, 7.0]
    assert changed.structure() == setup.structure()
    assert changed.digest() != setup.digest()
    none = hung(rng, 0)
    assert Scene.from_dict(tomllib.loads(none.to_toml())) == none


@pytest.mark.parametrize(
    ("key", "received"),
    [("effects.springs.springs.2.stiffness", "'2'"), ("effects.springs.springs.first.stiffness", "'first'"),
     ("effects.springs.springs.-1", "'-1'")],
)  # fmt: skip
def test_an_absent_row_is_refused(rng, key, received):
    with pytest.raises(InputError) as fault:
        hung(rng, 2).replace({key: 1.0})
    rule = "a setting of this scene (effects.springs.springs has rows 0 to 1)"
    assert str(fault.value) == f"{key} must be {rule}; received {received}"
