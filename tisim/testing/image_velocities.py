"""Test that pair laws take the velocity of an image, which differs from that of its particle, from the
state."""

from typing import Any

import numpy as np

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.state.state import State

STEPS_OF_SPEED = 8
"""Velocities are multiples of a power of two divided by this, so that sums of a few of them are exact."""


@ti.data_oriented
class ImageVelocities:
    """The domain of a scene, but with each particle seen as an image that moves relative to it.

    extra : velocity of the image of each particle relative to it, along each axis, m/s.
    """

    def __init__(self, s: State) -> None:
        self.domain, self.capacity, self.extra, builder = s.domain, s.capacity, ti.field(s.real), Builder()
        builder.dense(ti.ij, (s.capacity, 3)).place(self.extra)
        Tree(builder)

    def __getattr__(self, name: str) -> Any:
        if name == "domain":
            raise AttributeError(name)
        return getattr(self.domain, name)

    @ti.func
    def relative_velocity(self, s, w, i, j, separation):
        v = self.domain.relative_velocity(s, w, i, j, separation)
        for c in ti.static(range(3)):
            v[c] += self.extra[j, c] - self.extra[i, c]
        return v

    def set(self, s: State, speed: float, moving: bool) -> None:
        """Give images velocities of about this speed (m/s), and the particles the same; if images are
        ``moving``, particles have other velocities, and ``extra`` is the difference."""
        unit = 2.0 ** np.round(np.log2(speed or 1.0)) / STEPS_OF_SPEED
        rng = np.random.default_rng(1)
        seen, extra = unit * rng.integers(-STEPS_OF_SPEED, STEPS_OF_SPEED + 1, (2, self.capacity, 3))
        extra = extra if moving else 0.0 * extra
        self.extra.from_numpy(extra.astype(s.read("velocity").dtype))
        s.write("velocity", (seen - extra)[None])


def assert_same(label: str, here: np.ndarray, there: np.ndarray) -> None:
    """Assert that a law gives the same result for particles and for images with equal velocities.

    here, there : force, torque and torque on the other, each of three components, by index of the particle,
        of the other one and of the call.
    """
    groups = (*here.shape[:3], 3, 3)
    size = np.abs(here.reshape(groups)).max(axis=4, keepdims=True)
    allowed = np.broadcast_to(np.sqrt(np.finfo(here.dtype).eps) * size, groups).reshape(here.shape)
    equal = np.isclose(there, here, rtol=0.0, atol=np.nan_to_num(allowed), equal_nan=True)
    for i, j, k, c in np.argwhere(~equal)[:1]:
        raise AssertionError(
            f"{label} must take the velocity of particle {j} relative to {i} from s.relative_velocity, which "
            f"knows of images that move, and give {here[i, j, k, c]:g}; received {there[i, j, k, c]:g}"
        )
