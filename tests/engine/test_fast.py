"""Fast arithmetic, in a separate process: the effects it may have, and those it must not have."""

import numpy as np
import pytest
from scipy.constants import mu_0

import tisim
from tests.effects.contact import sheared
from tests.effects.contact.grains import grains, heap, reference
from tests.scenes import by_id, fixed, scene, simulate
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import DipoleDipole, Force, NearField, parameter
from tisim.numerics import elementary
from tisim.numerics.elementary import power
from tisim.numerics.ieee import compensated_sum, finite, infinity, same
from tisim.sources import Cylinder, MagneticCylinders, sample

pytestmark = pytest.mark.long

CLOSE = 1e-12
"""Largest difference between forces in fast arithmetic and in NumPy, over the largest force."""

GRANULAR_STEPS = 100
"""Few enough steps for rounding errors to stay below 1e-12 of the grains' motion."""


class Wall(Force):
    """A spring whose stiffness overflows beyond some position."""

    place: float = parameter("m", "where it begins", 0.5)
    stiffness: float = parameter("N/m", "stiffness beyond", 1e308)

    @ti.func
    def force(self, s, w, i, t):
        stiffness = ti.select(s.position[w, i][0] > self.place(w), self.stiffness(w), 0.0)
        return -1e3 * stiffness * s.position[w, i]


class Screened(NearField):
    """A near field that decays; the inherited sum over inverse distances does not."""

    length: float = parameter("m", "length of decay", 0.1)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        decay = elementary.exp(-distance / self.length(w))
        return decay * self.between(s, w, i, j, separation, distance)


class Reversed(NearField):
    """A near field of opposite sign, which overrides a function that the law calls."""

    @ti.func
    def between(self, s, w, i, j, separation, distance):
        attraction = self.alpha1(w) * power(distance, -1 - self.beta1)
        return -self.own(s, w, i) * self.own(s, w, j) * attraction * separation


class Named(NearField):
    """A near field that overrides no device function."""

    def approximations(self, extent):
        return ()


@in_taichi_thread
@ti.kernel
def _sums(terms: ti.types.ndarray(), out: ti.types.ndarray()):  # type: ignore[valid-type]
    ti.loop_config(serialize=True)
    for _ in range(1):
        total, carry, n = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64), terms.shape[0]
        for k in range(n):
            total, carry = compensated_sum(total, terms[k], carry, ti.cast(out[1], ti.i32))
        out[0] = total


@in_taichi_thread
@ti.kernel
def _kinds(x: ti.types.ndarray(), out: ti.types.ndarray()):  # type: ignore[valid-type]
    for k in range(x.shape[0]):
        out[k, 0] = ti.cast(finite(x[k] * x[k]), ti.i32)
        out[k, 1] = ti.cast(finite(x[k] - infinity(k)), ti.i32)
        place = ti.Vector([x[k], x[k], x[k]])
        out[k, 2] = same(place + 1e-3, place)[0]


def numbers():
    """Classification of numbers in kernels; and a compensated sum of tenths."""
    x = np.array([0.0, 1.0, -3.0, 1e100, 1e160, -1e300, np.inf, np.nan])
    out, total = np.zeros((len(x), 3), np.int32), np.zeros(2)
    _kinds(x, out)
    _sums(np.full(100_000, 0.1), total)
    return out.tolist(), total[0]


def references():
    """The largest errors of forces over all pairs, against NumPy, over the largest force."""
    rng, n, errors = np.random.default_rng(3), 100, []
    position, charge, moment = rng.uniform(0, 1, (n, 3)), rng.normal(size=n), rng.normal(size=(n, 3))
    d = position[None] - position[:, None]
    distance = np.linalg.norm(d, axis=2) + np.eye(n)
    direction, other = d / distance[..., None], 1 - np.eye(n)
    law = NearField(alpha1=0.7, alpha2=1.3, beta1=1, beta2=3, strength="charge")
    size = other * charge[:, None] * charge * (0.7 / distance - 1.3 / distance**3)
    expected = [(size[..., None] * direction).sum(axis=1)]
    i, j = np.einsum("ic,ijc->ij", moment, direction), np.einsum("jc,ijc->ij", moment, direction)
    total = i[..., None] * moment[None] + j[..., None] * moment[:, None]
    total += (moment @ moment.T - 5 * i * j)[..., None] * direction
    expected.append(-3 * mu_0 / (4 * np.pi) * ((other / distance**4)[..., None] * total).sum(axis=1))
    quantities = {"charge": charge, "moment": moment}
    for effect, force in zip((law, DipoleDipole()), expected, strict=True):
        name = "charge" if effect is law else "moment"
        own = {"mass": 1.0, "dt": 1e-15, "quantities": {name: quantities[name]}}
        one = scene(position, 0 * position, (effect,), **own)
        (result,) = simulate([one], capacity=128)
        assert result.status.ok
        errors.append(float(np.abs(result.state["force"] - force).max() / np.abs(force).max()))
    return errors


def failure():
    """The end of a world whose force becomes infinite half-way, and of another world beside it."""
    start = scene([[0.0, 0, 0]], [[1.0, 0, 0]], (Wall(),), mass=[1.0], stepper=fixed(1e-3), duration=1.0)
    bad, good = simulate([start, start.replace({"effects.wall.place": 2.0})], worlds=2)
    return [bad.status.reason, bad.time, good.status.ok, good.time, float(good.state["position"][0, 0])]


def beside_a_long_cylinder():
    """Flux density (T) beside a cylinder of length 2e7 radii in an oblique direction, magnetised
    transversely, far from its middle."""
    axis = np.array([0.3, -0.7, 0.648])
    magnet = Cylinder(
        centre=(1 / 3000, 1 / 7000, 1 / 900),
        axis=tuple(axis),
        radius=1e-3,
        length=2e4,
        magnetisation=(1e6, 0.0, 0.0),
    )
    side = np.cross(axis, [1.0, 0, 0])
    places = 2e-3 * side / np.linalg.norm(side) + np.array([0.1, 30.0, 3e3])[:, None] * axis
    source = (MagneticCylinders(cylinders=(magnet,)),)
    return sample(source, "magnetic_flux_density", places)[0].tolist()


def derived():
    """The forces (N) on one of two particles 1 m apart, by laws derived from the near field."""
    forces = []
    for law in (Screened(alpha1=1.0), Reversed(alpha1=1.0)):
        (result,) = simulate([scene([[0.0, 0, 0], [1, 0, 0]], np.zeros((2, 3)), (law,), dt=1e-15)])
        forces.append(float(result.state["force"][0, 0]))
    return forces


def error(result, place, velocity, spin):
    """The largest error of grains against NumPy, over the largest value."""
    expected, state = {"position": place, "velocity": velocity, "spin": spin}, by_id(result)
    return max(float(np.abs(state[name] - x).max() / np.abs(x).max()) for name, x in expected.items())


def piled():
    """The error of a heap in a cell, and the number of sliding contacts; and the end of another world, whose
    initial overlap is too deep for its step."""
    pile = heap(np.random.default_rng(5), steps=GRANULAR_STEPS)
    couple = grains([[0, 0, 9], [1.9, 0, 9]], np.zeros((2, 3)), law={"young": 1e10}, dt=1e-3)
    result, deep = simulate([pile, couple], worlds=2)
    known = reference(pile)
    known.run(GRANULAR_STEPS, pile.stepper.control.dt)
    return [error(result, known.x, known.v, known.w), int(known.sliding), deep.status.reason, deep.time]


def flowing():
    """The error of a crowd in shear, and the number of sliding contacts."""
    crowd = sheared.crowd(np.random.default_rng(5), n=40, steps=GRANULAR_STEPS)
    (result,) = simulate([crowd])
    known = sheared.ShearedGrains(crowd)
    known.run(GRANULAR_STEPS, sheared.DT)
    place, velocity = sheared.inside(crowd.domain, known.x, known.v, result.time)
    return [error(result, place, velocity, known.w), int(known.sliding)]


def everything():
    """Results of the functions above, from one process."""
    settings = tisim.run(scene([[0.0, 0, 0]], [[1.0, 0, 0]])).settings
    return [settings["arithmetic"], numbers(), references(), failure(), beside_a_long_cylinder()]


@pytest.fixture(scope="module")
def fast(in_fast_arithmetic):
    return in_fast_arithmetic("engine.test_fast", "everything")


def test_results_state_the_arithmetic(fast):
    assert fast[0] == "fast"


def test_non_finite_values_are_found_and_sums_are_compensated(fast):
    kinds, total = fast[1]
    assert [kind[0] for kind in kinds] == [1, 1, 1, 1, 0, 0, 0, 0]
    assert [kind[1] for kind in kinds] == [0] * 8
    assert [kind[2] for kind in kinds] == [0, 0, 0, 1, 1, 1, 1, 1]
    assert total == 10_000.0


def test_forces_equal_their_references(fast):
    assert max(fast[2]) < CLOSE


@pytest.mark.slow
def test_forces_of_derived_laws(in_fast_arithmetic):
    forces = in_fast_arithmetic("engine.test_fast", "derived")
    np.testing.assert_allclose(forces, [np.exp(-10.0), -1.0], rtol=1e-9)


def test_derived_laws_do_not_inherit_the_inverse_sum():
    assert not Screened.offers_inverse()
    assert NearField.offers_inverse()
    assert Named.offers_inverse()


def test_a_force_that_becomes_infinite_is_reported_and_worlds_end_on_time(fast):
    reason, time, well, end, place = fast[3]
    assert "particle 0" in reason
    assert "wall" in reason
    assert time == pytest.approx(0.5, abs=2e-3)
    assert well
    assert end == 1.0
    assert place == pytest.approx(1.0, rel=1e-12)


def test_the_field_beside_a_long_cylinder_keeps_its_digits(fast):
    np.testing.assert_allclose(fast[4], beside_a_long_cylinder(), rtol=1e-12)


@pytest.mark.slow
def test_a_heap_equals_its_reference_and_deep_overlaps_are_reported(in_fast_arithmetic):
    off, sliding, reason, time = in_fast_arithmetic("engine.test_fast", "piled")
    assert off < CLOSE
    assert sliding > 1000
    for word in ("not finite", "effects.granular", "particle 0"):
        assert word in reason
    assert time == 0.0


@pytest.mark.slow
def test_a_crowd_in_shear_equals_its_reference(in_fast_arithmetic):
    off, sliding = in_fast_arithmetic("engine.test_fast", "flowing")
    assert off < CLOSE
    assert sliding > 1000
