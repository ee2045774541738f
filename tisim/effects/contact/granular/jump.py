"""Adhesive forces that jump where a contact begins or ends.

A stepper sees such a force in the first step that ends within the contact, and counts half a step of its
work, whatever part of the step was within the contact. A pair that meets at a speed v therefore gains or
loses up to F v dt / 2 at each jump, depending on when within a step it meets. The energy of an impact in 100
steps per oscillation has an error of up to 0.036 (tests/effects/contact/test_adhesive_jumps.py).

Here the force is ramped over two steps as the depth within the contact grows. With s the depth in steps at
the present speed, s = depth / (v dt), the force is multiplied by

    3 s / 2  for s < 1,    2 - s / 2  for 1 < s < 2,    1  beyond.

At s and s + 1, the two steps after the jump, these factors add up to s + 3/2. A leapfrog does half of the
work of a kick before a step and half after it, so the sum is the exact work of the force from the jump on,
for any s.

The full force acts in two cases: on a pair at rest or slowly separating, whose momentum m v along the normal
is less than F dt, and on a pair so heavy and fast that F dt is below a millionth of m v, for which the work
of half a step is negligible.
"""

from tisim.backend.taichi import ti

NEGLIGIBLE = 1e-6
"""Impulses of a step below this fraction of the momentum are not ramped."""


@ti.func
def spread(depth, speed, dt, force, mass):
    """Return the factor on a force (N) that jumps at depth 0 (m), for steps of dt (s), an approach or
    separation speed (m/s, >= 0) along the normal, and this m* (kg)."""
    travel, share = speed * dt, force * dt
    within = (share < mass * speed) & (share > NEGLIGIBLE * (mass * speed)) & (depth < 2.0 * travel)
    steps = ti.max(depth, 0.0) / ti.select(within, travel, 1.0)
    return ti.select(within, ti.min(1.5 * steps, 2.0 - 0.5 * steps), 1.0)
