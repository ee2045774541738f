"""The guard of explicit steppers: a step of more than 0.45 of the critical step of a force stops its world.

A leapfrog follows a motion of angular frequency omega in steps below the critical one, 2/omega; in longer
ones it alternates and grows. From one step to the next such a motion changes the acceleration of a particle
by omega^2 times its displacement, whatever the law. So the guard needs no knowledge of laws: it compares the
two. The limit is below half of the critical step, 1/omega, because of forces that fall off with distance,
such as gravity. Such a force may throw a particle out of its reach in a single step. The displacement is then
that which the lost force made, so (omega dt)^2 comes out just below 1.

Laws that ask for their own critical step at each contact, such as those of grains, are not asked again. Their
forces are in the sum, though, and end from one step to the next where a contact does, as when a wall is drawn
away. So beside such laws a step counts as too long only where that is found twice in a row: a motion that
grows shows it in every step.

Source: M. P. Allen, D. J. Tildesley, Computer Simulation of Liquids (2017), section 3.2.
"""

from collections.abc import Sequence

from tisim.backend.taichi import ti
from tisim.effects.base import Effect, Force, PairForce
from tisim.forces.force_sum import turning
from tisim.state.fields import Field
from tisim.state.status import WorldStatus
from tisim.steppers.implicit.saved_state import FORCE_BEFORE, TORQUE_BEFORE

STEP_LIMIT = 0.8
"""(omega dt)^2 must be below this; a leapfrog is stable where it is below 4."""
HARDLY = 1e-2
"""A change of the force that moves a particle by less than this part of its radius in a step, or turns it by
less than this angle (rad), is let pass: where a particle hardly moves, others change the force on it."""
STRAINED = Field("strained", "", 1, "keep", scratch=True)
"""Whether the last step of a particle was beyond the limit, beside laws that guard themselves."""
STEP_EXCESS = "step_excess"
"""This quantity of a world is the largest (omega dt)^2 that has been found where it is above the limit."""


def guards(effects: Sequence[Effect]) -> bool:
    """Return whether a scene has a force that does not guard its own steps."""
    return any(isinstance(e, Force | PairForce) and not e.guards_steps for e in effects)


def guard_fields(effects: Sequence[Effect]) -> tuple[Field, ...]:
    """Return the fields that the guard reads in a scene of these effects."""
    if not guards(effects):
        return ()
    # Contacts and bonds; gravity guards its own steps too, as there is nothing to guard.
    laws = [e for e in effects if isinstance(e, Force | PairForce)]
    beside = any(e.guards_steps and e.leapfrog for e in laws)
    torques = (TORQUE_BEFORE,) if turning(effects) else ()
    return (FORCE_BEFORE, *torques, *((STRAINED,) if beside else ()))


@ti.func
def check_step(s, w, i, force, torque, turns: ti.template(), patient: ti.template()):  # type: ignore[valid-type]
    """Stop the world where dt is beyond 0.45 of the critical step of particle i, which has moved by dt v and,
    where it ``turns``, by dt spin since the last forces; ``force`` (N) and ``torque`` (N m) are the new
    ones.

    What the new force does in a step is let pass, too: a field that is switched on, or grows in time, changes
    the force on a particle at rest. patient : whether a single step beyond the limit is let pass.
    """
    dt, radius = ti.cast(s.dt[w], s.real), s.radius[w, i]
    per_force = dt * dt / s.mass[w, i]
    moved = dt * s.velocity[w, i].norm() + HARDLY * radius
    bent = per_force * (force - s.force_before[w, i]).norm()
    fails, excess = bent > STEP_LIMIT * moved + per_force * force.norm(), bent / moved
    if ti.static(turns):
        # Of grains of nanometres m R^2 is below f32.
        per_torque = per_force / 0.4 / radius
        turned = dt * s.spin[w, i].norm() + HARDLY
        twisted = per_torque * ((torque - s.torque_before[w, i]).norm() / radius)
        fails = fails or twisted > STEP_LIMIT * turned + per_torque * (torque.norm() / radius)
        excess = ti.max(excess, twisted / turned)
    if ti.static(patient):
        again = s.strained[w, i] > 0.0
        s.strained[w, i] = ti.select(fails, 1.0, 0.0)
        fails = fails and again
    if fails:
        s.fail_by_force(w, WorldStatus.STEP_TOO_LONG, i)
        ti.atomic_max(s.step_excess[w], ti.cast(excess, ti.f64))
