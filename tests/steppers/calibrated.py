"""Scenes with known final states, for the ratio of the final error to the requested one.

A single particle under linear forces is solved in closed form, by a matrix exponential. Particles that
attract and repel each other are solved by SciPy's DOP853 with its tightest tolerance. Errors are errors of
position, relative to the size of the motion: the largest distances of particles from their starts. Each of
the two kinds has one structure of scenes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tests.scenes import scene, simulate
from tisim import Result
from tisim.effects import Lorentz, NearField, StokesDrag, Tether
from tisim.sources import ElectricField, MagneticField, UniformFlow
from tisim.steppers import Collocation, ErrorControl, StageControl, Stepper, Trapezoid

TURN = 2 * np.pi
"""rad/s: one rotation or oscillation a second."""
RADIUS = 0.01
"""Radius (m). Every particle has 1 kg and 1 C."""
LOOKS = 4000
"""Number of times at which the size of a motion is sampled."""


@dataclass(frozen=True)
class End:
    """Positions at the end (m), and the size of the motion (m, the sum over particles)."""

    position: np.ndarray
    size: float

    def error(self, result: Result) -> float:
        """Error of a run, relative to the size of the motion."""
        assert result.status.ok, result.status.reason
        order = np.argsort(result.state["id"])
        off = np.linalg.norm(result.state["position"][order] - self.position, axis=1)
        return float(off.sum() / self.size)


@dataclass(frozen=True)
class Single:
    """A particle of 1 kg and 1 C under linear forces.

    It is on a spring to the origin along x (N/m), under drag (kg/s) in a fluid that flows along x (m/s), in a
    field along x that is constant or sinusoidal in time (V/m, rad/s), and in a magnetic field along z (T).
    """

    duration: float
    place: tuple[float, float] = (0.0, 0.0)
    speed: tuple[float, float] = (0.0, 0.0)
    spring: float = 0.0
    drag: float = 1e-30
    flow: float = 0.0
    push: float = 0.0
    shake: float = 0.0
    omega: float = TURN
    flux: float = 0.0

    def scene(self, stepper: Stepper):
        effects = (
            Lorentz(),
            ElectricField(constant=(self.push, 0, 0), amplitude=(self.shake, 0, 0), omega=(self.omega, 0, 0)),
            MagneticField(constant=(0, 0, self.flux)),
            Tether(stiffness=(self.spring, 0, 0)),
            StokesDrag(viscosity=self.drag / (6 * np.pi * RADIUS)),
            UniformFlow(velocity=(self.flow, 0, 0)),
        )
        quantities = {"charge": 1.0, "anchor": np.zeros((1, 3))}
        more = {"mass": 1.0, "radius": RADIUS, "quantities": quantities, "duration": self.duration}
        return scene([[*self.place, 0.0]], [[*self.speed, 0.0]], effects, stepper=stepper, **more)

    @cached_property
    def end(self) -> End:
        """From the exponential of the matrix for (x, y, v_x, v_y, 1, sin, cos)."""
        m = np.zeros((7, 7))
        m[0, 2] = m[1, 3] = 1.0
        m[2] = -self.spring, 0, -self.drag, self.flux, self.push + self.drag * self.flow, self.shake, 0
        m[3] = 0, 0, -self.flux, -self.drag, 0, 0, 0
        m[5, 6], m[6, 5] = self.omega, -self.omega
        start = np.array([*self.place, *self.speed, 1.0, 0.0, 1.0])
        path, once = [start], expm(m * self.duration / LOOKS)
        for _ in range(LOOKS):
            path.append(once @ path[-1])
        last = (expm(m * self.duration) @ start)[:2]
        away = np.linalg.norm(np.array(path)[:, :2] - start[:2], axis=1)
        return End(np.array([[*last, 0.0]]), away.max())


@dataclass(frozen=True, eq=False)
class Several:
    """Particles of 1 kg that attract by alpha1 c_i c_j/d^2 and repel by alpha2 c_i c_j/d^3; c is +1 or -1."""

    duration: float
    place: np.ndarray
    speed: np.ndarray
    alpha1: float = 1.0
    alpha2: float = 0.0
    unlike: bool = False

    def polarity(self) -> np.ndarray:
        return np.array([1, -1]) if self.unlike else np.ones(len(self.place), int)

    def scene(self, stepper: Stepper):
        near = NearField(alpha1=self.alpha1, beta1=2, alpha2=self.alpha2, beta2=3, signed=True)
        more = {"radius": RADIUS, "mass": 1.0, "quantities": {"polarity": self.polarity()}}
        return scene(self.place, self.speed, (near,), stepper=stepper, duration=self.duration, **more)

    @cached_property
    def end(self) -> End:
        shape, c = self.place.shape, self.polarity()

        def rates(_, y):
            r, v = y.reshape(2, *shape)
            d = r[None] - r[:, None]
            distance = np.linalg.norm(d, axis=-1) + np.eye(len(r))
            pull = np.outer(c, c) * (self.alpha1 / distance**3 - self.alpha2 / distance**4)
            return np.concatenate([v.ravel(), (pull[..., None] * d).sum(axis=1).ravel()])

        start = np.concatenate([self.place, self.speed]).ravel()
        looks = np.linspace(0, self.duration, LOOKS)
        solution = solve_ivp(rates, (0, self.duration), start, "DOP853", looks, rtol=3e-14, atol=1e-16)
        path = solution.y[: self.place.size].reshape(*shape, -1)
        away = np.linalg.norm(path - path[..., :1], axis=1).max(axis=1)
        return End(path[..., -1], away.sum())


def orbit(eccentricity: float, turns: float, far: bool = False) -> Several:
    """Two bodies in orbit, starting at the pericentre or apocentre; the semi-major axis is 1 m."""
    side = -1 if far else 1
    distance = 1 - side * eccentricity
    # Both masses are 1 kg, so the relative motion has the attraction parameter 2 m^3/s^2.
    speed = np.sqrt(2 * (1 + side * eccentricity) / distance)
    place, velocity = np.zeros((2, 3)), np.zeros((2, 3))
    place[:, 0], velocity[:, 1] = [-distance / 2, distance / 2], [-speed / 2, speed / 2]
    return Several(turns * TURN / np.sqrt(2), place, velocity)


def crowd() -> Several:
    """Five particles in a cluster, whose neighbouring paths diverge."""
    rng = np.random.default_rng(3)
    return Several(6.0, rng.normal(size=(5, 3)), 0.3 * rng.normal(size=(5, 3)), 1.0, 0.1)


SINGLE = {
    "oscillator, 3 1/4 periods": Single(3.25, (1.0, 0.0), spring=TURN**2),
    "oscillator, 30 1/4 periods": Single(30.25, (1.0, 0.0), spring=TURN**2),
    "damped oscillator": Single(3.25, (1.0, 0.0), spring=TURN**2, drag=1.0),
    "oscillator at resonance": Single(5.25, spring=TURN**2, shake=1.0),
    "cyclotron, 5 turns": Single(5.3, speed=(0.0, 1.0), flux=TURN),
    "E x B drift": Single(5.3, push=1.0, flux=TURN),
    "drag in a flow": Single(2.0, speed=(0.0, 1.0), drag=5.0, flow=1.0),
}
SEVERAL = {
    "orbit, e = 0": orbit(0.0, 1.3),
    "orbit, e = 0.5": orbit(0.5, 1.3),
    "orbit, e = 0.5, 5 turns": orbit(0.5, 5.3),
    "orbit, e = 0.9, from the near end": orbit(0.9, 1.0),
    "orbit, e = 0.9, from the far end": orbit(0.9, 1.0, far=True),
    "scattering": Several(
        6.0, np.array([[-3.0, 0.3, 0], [3.0, -0.3, 0]]), np.array([[1.0, 0, 0], [-1.0, 0, 0]]), unlike=True
    ),
    "bound pair": Several(
        10.0, np.array([[-0.4, 0, 0], [0.4, 0, 0]]), np.array([[0.0, 0.4, 0], [0, -0.4, 0]]), 1.0, 0.2
    ),
}
CHAOTIC = "five bodies, chaotic"
KNOWN: dict[str, Single | Several] = {**SINGLE, **SEVERAL, CHAOTIC: crowd()}


def trapezoid(per: str) -> Callable[[float], Stepper]:
    limits = {"first": 1e-5, "longest": 10.0, "shortest": 1e-13}
    return lambda e: Trapezoid(control=ErrorControl(error=e, tolerance=1e-2 * e, per=per, **limits))


def collocation(per: str, first: float = 1e-4) -> Callable[[float], Stepper]:
    return lambda e: Collocation(control=StageControl(error=e, per=per, first=first, longest=10.0))


CONTROLS = {
    "Trapezoid, ErrorControl": (trapezoid("step"), 10.0 ** -np.arange(2, 7)),
    'Trapezoid, ErrorControl(per="run")': (trapezoid("run"), 10.0 ** -np.arange(2, 7)),
    "Collocation, StageControl": (collocation("step"), 10.0 ** -np.arange(2, 11)),
    'Collocation, StageControl(per="run")': (collocation("run"), 10.0 ** -np.arange(2, 11)),
}


def ratios(
    make: Callable[[float], Stepper], tolerances: Sequence[float], scenes=KNOWN
) -> dict[str, np.ndarray]:
    """The ratio of the final error to the requested one, for each scene and each requested error."""
    ratios_by_name = {}
    for kind in (Single, Several):
        names = [name for name in scenes if isinstance(scenes[name], kind)]
        runs = [scenes[name].scene(make(e)) for name in names for e in tolerances]
        if runs:
            results = iter(simulate(runs, worlds=len(runs), capacity=5 if kind is Several else 1))
            for name in names:
                ratios_by_name[name] = np.array(
                    [scenes[name].end.error(next(results)) / e for e in tolerances]
                )
    return ratios_by_name
