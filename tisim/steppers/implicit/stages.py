"""The rates of motion at the stages of a step, and the coefficients that turn them into positions and
velocities.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), section IV.5, Lobatto IIIA:
the stages are the zeros of d^(s-2)/dx^(s-2) (x^(s-1) (x-1)^(s-1)), the first at the beginning of the step and
the last at its end; a quantity at each stage follows from the polynomial through its rates at all of them.
With two stages this is the trapezoidal rule.
"""

from itertools import pairwise
from math import factorial

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.state.fields import Field
from tisim.steppers.common import SavedState
from tisim.steppers.context import StepContext
from tisim.steppers.implicit.one_particle import solved, summed_jacobian, with_jacobian


@ti.data_oriented
class Stages(SavedState):
    """The rates at the stages: ``acceleration[w, i, 3 j + k]`` of stage j along axis k, and with torques
    ``turning`` likewise.

    ``c[j]`` is the time of stage j over the step length. ``speeds[i, j]``, ``places[i, j]`` and
    ``estimate[j]`` are the coefficients of v_i, of r_i and of the error. For each world, ``predict[w, i, j]``
    are the coefficients of the rates at stage i extrapolated by the polynomial of the last step, and
    ``shape[w, i]`` is its error at stage i, relative to the other stages.
    """

    def __init__(self, context: StepContext, number: int) -> None:
        super().__init__(context)
        s, self.number, self.leading = self.s, number, leading(number)
        self.linear = with_jacobian(context.single_forces)
        rates = [(s.stage_acceleration, s.last_acceleration)]
        if self.turning:
            rates.append((s.stage_turning, s.last_turning))
        self.rates = tuple(rates)
        self.c, self.estimate = ti.field(ti.f64), ti.field(ti.f64)
        self.speeds, self.places = ti.field(ti.f64), ti.field(ti.f64)
        self.predict, self.shape = ti.field(ti.f64), ti.field(ti.f64)
        builder = Builder()
        builder.dense(ti.i, number).place(self.c, self.estimate)
        builder.dense(ti.i, number).dense(ti.j, number).place(self.speeds, self.places)
        builder.dense(ti.i, s.worlds).dense(ti.j, number).dense(ti.k, number).place(self.predict)
        builder.dense(ti.i, s.worlds).dense(ti.j, number).place(self.shape)
        self.tree = Tree(builder)
        once = integrals(number)
        for column, values in (
            (self.c, nodes(number)),
            (self.estimate, highest(number)),
            (self.speeds, once),
            (self.places, once @ once),
        ):
            column.from_numpy(np.ascontiguousarray(values))

    @staticmethod
    def fields(number: int, turning: bool) -> tuple[Field, ...]:
        """Return the fields of the rates of this step and of the last one."""
        names = [("acceleration", "m/s^2"), *([("turning", "rad/s^2")] if turning else [])]
        return tuple(
            Field(f"{when}_{name}", unit, merge="keep", slots=3 * number, scratch=True)
            for name, unit in names
            for when in ("stage", "last")
        )

    def bytes(self) -> int:
        """Return the device memory of the coefficients, in bytes."""
        return self.tree.bytes

    @ti.func
    def extrapolate(self, w, ratio):
        """Prepare the prediction of a step ``ratio`` times as long as the last one; ratio 0 if there was
        none."""
        for i in range(self.number):
            at = 1.0 + ratio * self.c[i]
            off = ti.cast(1.0, ti.f64)
            for j in range(self.number):
                weight = ti.cast(1.0, ti.f64)
                for k in range(self.number):
                    if k != j:
                        weight *= (at - self.c[k]) / (self.c[j] - self.c[k])
                # Without a last step the rates at all stages are taken from the first stage.
                self.predict[w, i, j] = ti.select(ratio > 0.0, weight, ti.cast(j == 0, ti.f64))
                off *= at - self.c[j]
            self.shape[w, i] = ti.select(ratio > 0.0, off, self.c[i])

    @ti.func
    def at(self, rate: ti.template(), w, i, j):  # type: ignore[valid-type]
        """Return a rate at stage j."""
        return ti.Vector([rate[w, i, 3 * j], rate[w, i, 3 * j + 1], rate[w, i, 3 * j + 2]])

    @ti.func
    def put(self, rate: ti.template(), w, i, j, value):  # type: ignore[valid-type]
        for k in ti.static(range(3)):
            rate[w, i, 3 * j + k] = value[k]

    @ti.func
    def sum(self, weights: ti.template(), stage, rate: ti.template(), w, i):  # type: ignore[valid-type]
        """Return sum_j weights[stage, j] rate_j."""
        total = ti.Vector.zero(self.s.real, 3)
        for j in range(self.number):
            total += ti.cast(weights[stage, j], self.s.real) * self.at(rate, w, i, j)
        return total

    @ti.func
    def velocity(self, w, i, stage, dt):
        """Return the velocity at a stage, v_i = v + dt sum_j a_ij v'_j (m/s)."""
        s = self.s
        return s.velocity_before[w, i] + dt * self.sum(self.speeds, stage, s.stage_acceleration, w, i)

    @ti.func
    def displacement(self, w, i, stage, dt):
        """Return the displacement up to a stage, r_i - r = c_i dt v + dt^2 sum_jk a_ij a_jk v'_k (m)."""
        s = self.s
        moved = dt * ti.cast(self.c[stage], s.real) * s.velocity_before[w, i]
        return moved + dt * dt * self.sum(self.places, stage, s.stage_acceleration, w, i)

    @ti.func
    def step_displacement(self, w, i, dt):
        """Return the displacement (m) in an accepted step."""
        return self.displacement(w, i, self.number - 1, dt)

    @ti.func
    def spin(self, w, i, stage, dt):
        """Return the spin (rad/s) at a stage, computed from the rates like the velocity."""
        return self.s.spin_before[w, i] + dt * self.sum(self.speeds, stage, self.s.stage_turning, w, i)

    @ti.func
    def inertia(self, w, i):
        """Return the moment of inertia 2/5 m R^2 (kg m^2) of a solid sphere (Z16 7.8)."""
        return 0.4 * self.s.mass[w, i] * self.s.radius[w, i] ** 2

    @ti.func
    def newest(self, w, i, stage, dt, t):
        """Return the acceleration (m/s^2) due to the force at a stage; the part linear in velocity is solved
        exactly: m v' = F + J dt a_ii (v' - v'_last)."""
        s = self.s
        m = s.mass[w, i]
        new = s.force[w, i] / m
        if ti.static(len(self.linear) > 0):
            rate = summed_jacobian(self.linear, s, w, i, t) / m
            implicit = dt * ti.cast(self.speeds[stage, stage], s.real) * rate
            last = self.at(s.stage_acceleration, w, i, stage)
            new = solved(ti.Matrix.identity(s.real, 3) - implicit, new - implicit @ last)
            s.force[w, i] = m * new
        return new


def nodes(stages: int) -> np.ndarray:
    """Return the times of the stages over the step length, from 0 to 1."""
    inner = np.sort(Legendre.basis(stages - 1).deriv().roots().real)
    return np.concatenate([[0.0], (inner + 1.0) / 2.0, [1.0]])


def lagrange(c: np.ndarray) -> list[Polynomial]:
    """Return the polynomials that are 1 at one node and 0 at all others."""
    polynomials = []
    for j, here in enumerate(c):
        others = np.delete(c, j)
        polynomials.append(Polynomial.fromroots(others) / np.prod(here - others))
    return polynomials


def integrals(stages: int) -> np.ndarray:
    """Return a_ij: a quantity at stage i is its value at stage 0 plus dt sum_j a_ij rate_j (Hairer and Wanner
    IV.5)."""
    c = nodes(stages)
    return np.array([[basis.integ()(here) for basis in lagrange(c)] for here in c])


def highest(stages: int) -> np.ndarray:
    """Return the coefficients d_j of an error estimate for the position, dt^2 |sum_j d_j acceleration_j|.

    sum_j acceleration_j prod_k 1/(c_j - c_k) is the coefficient of the highest power in the polynomial of the
    acceleration. A polynomial through all nodes but the last lacks this power; its error is the coefficient
    times prod_(k<s-1) (c - c_k). In the position at the end the error is at most the coefficient times the
    integral of (1 - c) |prod|.
    """
    c = nodes(stages)
    return bound(c) * np.array([1.0 / np.prod(here - np.delete(c, j)) for j, here in enumerate(c)])


def bound(c: np.ndarray) -> float:
    """Return the integral of (1 - x) |prod_(k<s-1) (x - c_k)| from 0 to 1."""
    rest = Polynomial.fromroots(c[:-1]) * Polynomial([1.0, -1.0])
    # |rest| has no sign changes between nodes.
    return float(sum(abs(rest.integ()(b) - rest.integ()(a)) for a, b in pairwise(c)))


def leading(stages: int) -> tuple[float, float]:
    """Return l and p of the leading term of the error, which in position is dt^2 a (l e)^p; e is the estimate
    by ``highest`` over dt^2 a, and a the largest acceleration.

    The method multiplies a motion of rate k by the (s - 1, s - 1) approximant of Pade to exp(k dt). Its error
    is c (k dt)^(2s - 1), c = ((s - 1)!)^2/((2s - 2)! (2s - 1)!) (Hairer and Wanner, section IV.3); the error
    in position is a/k^2 times as large. The estimate measures the derivative of order s - 1: e = m (k dt)^(s
    - 1)/ (s - 1)! with m = ``bound``.
    """
    n = stages - 1
    pade, power = factorial(n) ** 2 / (factorial(2 * n) * factorial(2 * n + 1)), (2 * n - 1) / n
    return float(factorial(n) / bound(nodes(stages)) * pade ** (1 / power)), power
