"""Fields at arbitrary points, without a run."""

import numpy as np
import pytest

from tisim import InputError
from tisim.backend import memory
from tisim.backend.runtime import current
from tisim.effects import Lorentz
from tisim.sources import ElectricField, FieldSampler, MagneticField, MagneticSpheres, Sphere, sample


def test_sum_of_the_sources_of_one_quantity():
    m, radius = np.array([0.0, 2e5, 1e5]), 0.5
    sphere = MagneticSpheres(spheres=[Sphere(radius=radius, magnetisation=tuple(m))])
    uniform = MagneticField(constant=(1.0, 0, 0), amplitude=(0.5, 0, 0), omega=(np.pi, 0, 0))
    points = np.array([[1.0, 0.2, -0.4], [-0.3, 2.0, 1.0]])
    effects = (Lorentz(), uniform, ElectricField(constant=(9.0, 9.0, 9.0)), sphere)
    field, slope = sample(effects, "magnetic_flux_density", points, time=0.5)

    def dipole(r):
        d = np.linalg.norm(r)
        moment = 4 / 3 * np.pi * radius**3 * m
        return 1e-7 * (3 * r * (moment @ r) / d**5 - moment / d**3)

    precise = current().precision == "f64"
    expected = [np.array([1.5, 0, 0]) + dipole(r) for r in points]
    np.testing.assert_allclose(field, expected, rtol=1e-8 if precise else 1e-5)
    step = 1e-5
    for r, gradient in zip(points, slope, strict=True):
        for axis in range(3):
            ahead, behind = r.copy(), r.copy()
            ahead[axis], behind[axis] = r[axis] + step, r[axis] - step
            difference = (dipole(ahead) - dipole(behind)) / (2 * step)
            np.testing.assert_allclose(
                gradient[:, axis], difference, rtol=1e-5, atol=1e-6 * np.abs(slope).max()
            )


def test_a_sampler_is_called_many_times():
    """At other points and times it gives what ``sample`` gives, and it frees its memory."""
    before = len(memory.in_use())
    field = (MagneticField(amplitude=(0.5, 0, 0), omega=(np.pi, 0, 0)),)
    with FieldSampler(field, "magnetic_flux_density") as sampler:
        for time, points in ((0.5, np.zeros((1, 3))), (0.25, np.ones((20, 3)))):
            again, expected = sampler(points, time), sample(field, "magnetic_flux_density", points, time)
            for one, other in zip(again, expected, strict=True):
                np.testing.assert_array_equal(one, other)
    assert len(memory.in_use()) == before


def test_nothing_to_sample_and_points_of_another_shape():
    with pytest.raises(InputError, match="effects must be with a source of magnetic_flux_density; received"):
        sample((Lorentz(),), "magnetic_flux_density", [[0.0, 0, 0]])
    with pytest.raises(InputError, match=r"points must be of shape \(n, 3\); received"):
        sample((MagneticField(constant=(1.0, 0, 0)),), "magnetic_flux_density", [0.0, 0, 0])


def test_fields_of_sources_are_freed_if_the_kernel_fails(monkeypatch):
    """As for a source that does not compile. A stored error must not keep the memory."""
    before = len(memory.in_use())

    def broken(self, time, places, out):
        raise RuntimeError("does not compile")

    monkeypatch.setattr("tisim.sources.sampling._Sum.at", broken)
    with pytest.raises(RuntimeError, match="does not compile") as error_info:
        sample((MagneticField(constant=(1.0, 0, 0)),), "magnetic_flux_density", [[0.0, 0, 0]])
    assert len(memory.in_use()) == before
    assert error_info.value


def test_a_uniform_field_is_switched_on_at_a_time():
    """The oscillation has the same phase as without the switch."""
    field = MagneticField(constant=(1.0, 0, 0), amplitude=(0.0, 2.0, 0), omega=(0, np.pi, 0), begin=0.5)
    for t, expected in ((0.4999, [0.0, 0, 0]), (0.5, [1.0, 2.0, 0.0]), (0.75, [1.0, np.sqrt(2.0), 0.0])):
        value, gradient = sample((field,), "magnetic_flux_density", [[0.3, 0, 0]], t)
        np.testing.assert_allclose(value[0], expected, rtol=0, atol=1e-6)
        assert (gradient == 0).all()
