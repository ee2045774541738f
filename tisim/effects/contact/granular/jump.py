"""Adhesive forces that jump where a contact begins or ends.

A stepper sees such a force from the first step on that ends within the contact. It counts the work of half a
step, whatever part of that step was within. So a pair that meets at a speed v gains or loses up to F v dt / 2
at each jump, by chance: an impact in 100 steps a swing is off by up to 0.036 of its energy
(tests/effects/contact/test_adhesive_jumps.py).

Here the force grows with the depth within the contact over two steps, instead of jumping. With s the depth in
steps at the present speed, s = depth / (v dt), it is multiplied by

    3 s / 2  for s < 1,    2 - s / 2  for 1 < s < 2,    1  beyond.

At s and s + 1, the two steps after the jump, these add up to s + 3/2. As a leapfrog does half of the work of
a kick before a step and half after it, that is the work of the force from the jump on, whatever s.

A pair that is at rest or drawn apart slowly, whose momentum m v along the normal is less than F dt, has the
full force, and so has one that is so heavy and fast that F dt is below a millionth of m v: there the work of
half a step matters little.
"""

from tisim.backend.taichi import ti

NEGLIGIBLE = 1e-6
"""Below this part of a momentum the work of half a step is let be."""


@ti.func
def spread(depth, speed, dt, force, mass):
    """Return the factor by which a force (N) is multiplied that jumps at depth 0 (m), in steps of dt (s), at
    a speed (m/s, >= 0) along the normal of two with this m* (kg)."""
    travel, share = speed * dt, force * dt
    within = (share < mass * speed) & (share > NEGLIGIBLE * (mass * speed)) & (depth < 2.0 * travel)
    steps = ti.max(depth, 0.0) / ti.select(within, travel, 1.0)
    return ti.select(within, ti.min(1.5 * steps, 2.0 - 0.5 * steps), 1.0)
