"""The guard of explicit steppers: a step above 0.45 of the critical step of a force stops its world.

A leapfrog follows a motion of angular frequency omega if its steps are below the critical step, 2/omega. With
longer steps the motion alternates and grows. From one step to the next, such a motion changes the
acceleration of a particle by omega^2 times its displacement, for any force law. The guard therefore needs no
knowledge of the laws: it compares the two. The limit is below half of the critical step, 1/omega, because of
forces that decrease with distance, such as gravity. Such a force may throw a particle out of its range in a
single step. The displacement is then due to the force that has vanished, so that (omega dt)^2 comes out just
below 1.

Laws that check their own critical step at each contact, such as contact laws of grains, are not checked
again. Their forces are in the sum, however, and vanish within a step when a contact ends, for example when a
wall is drawn away. In a scene with such laws, a step therefore counts as too long only if the limit is
exceeded twice in a row: a growing motion exceeds it in every step.

Source: M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids (2017), section 3.2.
"""

from collections.abc import Sequence

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.state.fields import Field, WorldField
from tisim.state.status import WorldStatus
from tisim.steppers.common import FORCE_BEFORE, TORQUE_BEFORE

STEP_LIMIT = 0.8
"""Limit of (omega dt)^2; a leapfrog is stable below 4."""
HARDLY = 1e-2
"""A change of the force is ignored if it moves a particle by less than this part of its radius in a step, or
turns it by less than this angle (rad): the force on a particle that hardly moves is changed by the others."""
STRAINED = Field("strained", "", 1, "keep", scratch=True)
"""Whether the last step of a particle was beyond the limit, in a scene with laws that guard themselves."""
STEP_EXCESS = WorldField("step_excess", "real")
"""This quantity of a world is the largest (omega dt)^2 above the limit."""


def guards(effects: Sequence[Effect]) -> bool:
    """Return whether a scene has a force that does not guard its own steps."""
    return any(isinstance(e, Force | PairForce) and not e.guards_steps for e in effects)


def guard_fields(effects: Sequence[Effect]) -> tuple[Field, ...]:
    """Return the fields that the guard reads in a scene of these effects."""
    if not guards(effects):
        return ()
    # Contacts and bonds. Gravity counts as guarding its own steps, because it needs no guard.
    laws = [e for e in effects if isinstance(e, Force | PairForce)]
    beside = any(e.guards_steps and e.leapfrog for e in laws)
    torques = (TORQUE_BEFORE,) if turning(effects) else ()
    return (FORCE_BEFORE, *torques, *((STRAINED,) if beside else ()))


@ti.func
def check_step(s, w, i, dt, path, force, torque, turns: ti.template(), patient: ti.template()):  # type: ignore[valid-type]
    """Stop the world if dt (s) is beyond 0.45 of the critical step of particle i. The particle has moved by a
    ``path`` of this length (m) and, if it ``turns``, rotated by dt spin since the last forces; ``force`` (N)
    and ``torque`` (N m) are the new ones.

    The displacement by the new force itself in a step is allowed too, because a field that is switched on, or
    grows in time, changes the force on a particle at rest. patient : whether a single step beyond the limit
    is allowed.
    """
    radius = s.radius[w, i]
    per_force = dt * dt / s.mass[w, i]
    moved = path + HARDLY * radius
    bent = per_force * (force - s.force_before[w, i]).norm()
    fails, excess = bent > STEP_LIMIT * moved + per_force * force.norm(), bent / moved
    if ti.static(turns):
        # For grains of nanometres, m R^2 underflows in f32.
        per_torque = per_force / 0.4 / radius
        turned = dt * s.spin[w, i].norm() + HARDLY
        twisted = per_torque * ((torque - s.torque_before[w, i]).norm() / radius)
        fails = fails or twisted > STEP_LIMIT * turned + per_torque * (torque.norm() / radius)
        excess = ti.max(excess, twisted / turned)
    if ti.static(hasattr(s, "fixed")):
        # An operator may have fixed it in this step, which ends all force on it.
        fails = fails and s.fixed[w, i] == 0
    if ti.static(patient):
        again = s.strained[w, i] > 0.0
        s.strained[w, i] = ti.select(fails, 1.0, 0.0)
        fails = fails and again
    if fails:
        s.fail_by_force(w, WorldStatus.STEP_TOO_LONG, i)
        ti.atomic_max(s.step_excess[w], ti.cast(excess, ti.f64))
