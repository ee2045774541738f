"""The implicit equations of a step for one particle, given the force on it (Z13 appendix, Z16 section 8).

The velocity is the exact unknown of a step: the displacement is dt (phi v' + (1 - phi) v). Two iterates are
therefore compared by their velocities, and positions may be wrapped into a box in between.

Particles that do not interact take their own implicit steps by these equations, many in one launch. There is
no norm over all particles, and a particle waits only for the end of an interval (see intervals.py). The
number of intervals or attempts in a launch does not affect the motion.
"""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import compensated_sum, infinity
from tisim.program.phases import PerParticle
from tisim.steppers.common import SavedState, saved_fields
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.attempts import ACCEPTED, HOPELESS, RETRY, SHORTER, relative, verdict_on
from tisim.steppers.implicit.step_control import note_excursion
from tisim.steppers.intervals import LITTLE, beginning, duration
from tisim.steppers.registers import Registers


def with_jacobian(forces):
    """Return the forces that define their derivative by velocity."""
    return tuple(force for force in forces if force.data.offers("velocity_jacobian"))


@ti.func
def summed_jacobian(forces: ti.template(), s, w, i, t):  # type: ignore[valid-type]
    """Return the sum (N s/m) of the derivatives of forces on particle i by its velocity."""
    total = ti.Matrix.zero(s.real, 3, 3)
    for force in ti.static(forces):
        total += force.velocity_jacobian(s, w, i, t)
    return total


@ti.func
def solved(a, b):
    """Return x of a x = b, by Cramer's rule; the division comes last, so that other operations need not wait
    for it."""
    x, y, z = a[:, 0], a[:, 1], a[:, 2]
    yz = y.cross(z)
    return 1.0 / x.dot(yz) * ti.Vector([b.dot(yz), x.dot(b.cross(z)), x.dot(y.cross(b))])


@ti.data_oriented
class Solve(SavedState):
    """The next iterate of a particle, given the force at the last one."""

    def __init__(self, context: StepContext, phi) -> None:
        super().__init__(context)
        self.phi = phi
        self.linear = with_jacobian(context.single_forces)

    @ti.func
    def displacement(self, w, i, v, dt):
        """Return the displacement dt (phi v' + (1 - phi) v) (m)."""
        return dt * (self.phi(w) * v + (1.0 - self.phi(w)) * self.s.velocity_before[w, i])

    @ti.func
    def step_displacement(self, w, i, dt):
        """Return the displacement (m) in an accepted step."""
        return self.displacement(w, i, self.s.velocity[w, i], dt)

    @ti.func
    def jacobian(self, w, i, t):
        """Return J (N s/m), the sum of the derivatives of forces by velocity that effects define, at the
        present v."""
        return summed_jacobian(self.linear, self.s, w, i, t)

    @ti.func
    def velocity(self, w, i, dt, jacobian):
        """Return v' (m/s) of m v' = m v + dt (phi (F' + J (v' - v_K)) + (1 - phi) F), with F' and J at
        v_K."""
        s, phi, over_mass = self.s, self.phi(w), dt / self.s.mass[w, i]
        v, total = s.velocity_before[w, i], phi * s.force[w, i] + (1.0 - phi) * s.force_before[w, i]
        new = v + over_mass * total
        if ti.static(len(self.linear) > 0):
            # Divided by the mass, because a determinant in kg^3 would underflow in f32.
            matrix = ti.Matrix.identity(s.real, 3) - phi * over_mass * jacobian
            new = solved(matrix, v + over_mass * (total - phi * (jacobian @ s.velocity[w, i])))
            s.force[w, i] = s.force[w, i] + jacobian @ (new - s.velocity[w, i])
        return new

    @ti.func
    def turn(self, w, i, dt):
        """Set spin' = spin + dt/I (phi M' + (1 - phi) M), I = 2/5 m R^2; return the change of the surface
        displacement (m)."""
        s, phi, radius = self.s, self.phi(w), self.s.radius[w, i]
        torque = phi * s.torque[w, i] + (1.0 - phi) * s.torque_before[w, i]
        new = s.spin_before[w, i] + dt / (0.4 * s.mass[w, i] * radius * radius) * torque
        change = phi * dt * radius * (new - s.spin[w, i]).norm()
        s.spin[w, i] = new
        return change

    @ti.func
    def advance(self, w, i, v, dt):
        """Put a particle at the place reached with v'; return the additional displacement of its surface by
        rotation (m)."""
        s = self.s
        s.velocity[w, i] = v
        r = s.position_before[w, i] + self.displacement(w, i, v, dt)
        s.position[w, i] = self.domain.wrap(w, r, s.time[w])
        turned = ti.cast(0.0, s.real)
        if ti.static(self.turning):
            turned = self.turn(w, i, dt)
        return turned

    @ti.func
    def error(self, w, i, dt):
        """Return the error (m) of a step, to leading order: (phi - 1/2) dt^2 a + (phi^2 - 1/6) dt^3 da/dt."""
        a, b, phi = self.s.force_before[w, i], self.s.force[w, i], self.phi(w)
        total = (phi - 0.5) * (phi * b + (1.0 - phi) * a) + (phi * phi - 1.0 / 6.0) * (b - a)
        return dt * dt / self.s.mass[w, i] * total.norm()

    @ti.func
    def reachable(self, w, i, v, dt):
        """Return whether the place that a particle with v' reaches is finite and can be represented."""
        return self.sound(w, self.s.position_before[w, i] + self.displacement(w, i, v, dt))

    @ti.func
    def predict(self, w, i, dt, t):
        """Compute the first iterate, K = 1, with the force at the beginning of the step; t : time (s) at its
        end. Return v' (m/s)."""
        v = self.velocity(w, i, dt, self.jacobian(w, i, t))
        if not self.reachable(w, i, v, dt):
            v = self.s.velocity_before[w, i]
        self.advance(w, i, v, dt)
        return v

    @ti.func
    def correct(self, w, i, last, dt, jacobian):
        """Compute the next iterate from the last one, v_K = ``last`` (m/s), and the force at it. Return v'
        (m/s) and the displacement of the surface by rotation (m).

        If the new place cannot be reached, the particle stays and the displacement is infinite.
        """
        v = self.velocity(w, i, dt, jacobian)
        turned = ti.cast(infinity(self.s.count[w]), self.s.real)
        if self.reachable(w, i, v, dt):
            turned = self.advance(w, i, v, dt)
        else:
            v = last
        return v, turned

    @ti.func
    def lengths(self, control: ti.template(), w, i, v, dt):  # type: ignore[valid-type]
        """Return the displacement in the step, its error, and the scale of this error (m)."""
        moved = self.displacement(w, i, v, dt).norm()
        return moved, self.error(w, i, dt), control.scale(self.s, w, i, moved, dt)


class IndependentSteps(PerParticle):
    """This phase takes each particle through the intervals of a launch."""

    long = True

    def __init__(self, context: StepContext, solve) -> None:
        super().__init__(context.s)
        moving = tuple(field.name.removesuffix("_before") for field in saved_fields(context.turning))
        before = tuple(field.name for field in saved_fields(context.turning))
        self.registers = Registers(context.s, ("own_dt", *moving), before)
        self.own, self.control = self.registers.state, context.control
        self.solve = self.registers.with_registers(solve)
        self.force_sum = self.registers.with_registers(context.force_sum)

    @ti.func
    def run(self, w, i):
        s = self.s
        self.registers.load(w, i)
        interval, end = s.own_interval[w, i], s.intervals[w] + s.launch_intervals[w]
        elapsed, carry = s.own_elapsed[w, i], s.own_carry[w, i]
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        aim, attempt_limit = self.control.aim(w), ti.cast(s.attempt_limit[w], ti.i64)
        going = ti.select(interval < end, 1, 0)
        while going > 0:
            begin = beginning(s, self.control, w, interval)
            length = duration(s, self.control, w, interval, begin)
            elapsed, carry, verdict, more_steps, more_tries, more_iterations = self.interval(
                w, i, begin, length, elapsed, carry, attempt_limit - tries, aim
            )
            steps += more_steps
            tries += more_tries
            iterations += more_iterations
            if elapsed < length:
                going = 0
                if verdict == HOPELESS:
                    ti.atomic_max(s.halted[w], 1)
                else:
                    ti.atomic_add(s.underway[w], 1)
            elif s.cut[w] > 0.0:
                going = 0
            else:
                interval, elapsed, carry = interval + 1.0, 0.0, 0.0
                if interval >= end:
                    going = 0
        self.registers.store(w, i)
        s.own_interval[w, i], s.own_elapsed[w, i], s.own_carry[w, i] = interval, elapsed, carry
        ti.atomic_add(s.particle_steps[w], steps)
        ti.atomic_add(s.rejections[w], tries - steps)
        ti.atomic_add(s.solver_iterations[w], iterations)
        ti.atomic_add(s.force_evaluations[w], iterations)

    @ti.func
    def interval(self, w, i, begin, length, start, rounding, attempt_limit, aim):
        """Take a particle through an interval from ``start`` (s) on. Return the time it reaches (s), the end
        unless it is stuck or has used up its attempts; the rounding error of this time; its last verdict; and
        the numbers of its steps, attempts and iterations."""
        s = self.own
        elapsed, carry = start, rounding
        steps, tries, iterations, verdict = ti.i64(0), ti.i64(0), ti.i64(0), ACCEPTED
        while elapsed < length and verdict != HOPELESS and tries < attempt_limit:
            self.solve.save(w, i)
            verdict = RETRY
            while verdict == RETRY:
                speed = ti.cast(s.velocity_before[w, i].norm(), ti.f64)
                target = self.control.step(s, w, s.own_dt[w, i], speed)
                last = target * (1.0 + LITTLE) >= length - elapsed
                dt = ti.select(last, length - elapsed, target)
                verdict, k = self.attempt(w, i, begin + elapsed, dt, aim)
                iterations += k
                tries += 1
                if verdict == ACCEPTED:
                    total, carry = compensated_sum(elapsed, dt, carry, s.count[w])
                    elapsed = ti.select(last, length, total)
                    steps += 1
                    if ti.static(self.control.at_end):
                        note_excursion(s, w, i, self.solve.step_displacement(w, i, ti.cast(dt, s.real)))
                    # A last step that was cut short gives no information about the next one.
                    s.own_dt[w, i] = ti.max(s.own_dt[w, i], ti.cast(ti.select(last, target, 0.0), s.real))
        return elapsed, carry, verdict, steps, tries, iterations

    @ti.func
    def attempt(self, w, i, t, dt, aim):
        """Attempt one step of this length (s). Return the verdict, and the number of iterations."""
        s, solve = self.own, self.solve
        step, end = ti.cast(dt, s.real), t + dt
        v = solve.predict(w, i, step, end)
        k, verdict, iterating = 1, RETRY, 1
        while iterating > 0:
            # Before the force is written, so that common subexpressions are computed once.
            jacobian = solve.jacobian(w, i, end)
            self.force_sum.single_particle(w, i, end)
            new, turned = solve.correct(w, i, v, step, jacobian)
            change = solve.phi(w) * step * (new - v).norm() + turned
            v = new
            k += 1
            moved, error, scale = solve.lengths(self.control, w, i, v, step)
            ratio, off = ti.cast(relative(change, moved), ti.f64), ti.cast(relative(error, scale), ti.f64)
            if self.control.ends(w, ratio, k):
                iterating = 0
                accepted = self.control.solved(w, ratio) and self.control.accepts(w, off)
                target = dt
                # If the longest step stays, this branch spares the next step the wait for the factor.
                if not (accepted and self.control.stays(w, dt, aim, ratio, k, off)):
                    target *= self.control.factor(w, aim, ratio, ti.cast(k, ti.f64), off)
                verdict = verdict_on(self.control, s, w, dt, accepted)
                if verdict != ACCEPTED:
                    target = ti.min(target, SHORTER * dt)
                    solve.restore(w, i)
                s.own_dt[w, i] = ti.cast(target, s.real)
        return verdict, k - 1
