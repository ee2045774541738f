"""The implicit equations of a step for one particle, given the force on it (Z13 appendix, Z16 section 8).

The velocity is the exact unknown of a step: the displacement is dt (phi v' + (1 - phi) v). Two iterates are
therefore compared by their velocities, and positions may be wrapped into a box in between.
"""

from tisim.backend.taichi import ti
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.saved_state import SavedState


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
