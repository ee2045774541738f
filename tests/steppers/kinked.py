"""Scenes with kinks or jumps in the forces along the path, and final states known to 1e-12.

A kind of scene is a function of a random number generator. It returns a scene, without a stepper, and the
final positions (m, shape (n, 3)), from SciPy's DOP853 with its tightest tolerance, stopped at every kink.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp

import tisim
from tisim import effects as laws
from tisim import sources

KINDS: dict[str, Callable[[np.random.Generator], tuple[tisim.Scene, np.ndarray]]] = {}
RADIUS, VISCOSITY = 5e-3, 1e-2
MASS = 500.0 * 4 / 3 * np.pi * RADIUS**3
RATE = 6 * np.pi * VISCOSITY * RADIUS / MASS
"""Rate of Stokes drag, 1/s."""
DRAG = laws.StokesDrag(viscosity=VISCOSITY)


def kind(function):
    """Register a kind of scene by the name of its function."""
    KINDS[function.__name__] = function
    return function


def exact(acceleration, place, velocity, duration, switches: Sequence[Callable] = ()) -> np.ndarray:
    """Return the final positions of a motion.

    acceleration : function of (t, r, v, sides). sides are the signs of the switches, each a function of
    (t, r, v): a piece of the motion ends at a sign change of one of them.
    """
    n = np.size(place)

    def split(y):
        return y[:n].reshape(np.shape(place)), y[n:].reshape(np.shape(place))

    t, y = 0.0, np.concatenate([np.ravel(place), np.ravel(velocity)]).astype(float)
    sides = [np.sign(switch(t, *split(y))) for switch in switches]
    while t < duration:

        def rates(t, y):
            r, v = split(y)
            return np.concatenate([np.ravel(v), np.ravel(acceleration(t, r, v, sides))])

        events = []
        for k, switch in enumerate(switches):

            def event(t, y, switch=switch):
                return switch(t, *split(y))

            # Offset to the present side, so that the switch itself does not stop the next piece.
            event.terminal, event.direction = True, -sides[k]
            events.append(event)
        piece = solve_ivp(
            rates, (t, duration), y, method="DOP853", rtol=1e-13, atol=1e-18, events=events or None,
            max_step=duration / 50,
        )  # fmt: skip
        t, y = piece.t[-1], piece.y[:, -1]
        if piece.status == 1:
            for k, found in enumerate(piece.t_events):
                if len(found):
                    sides[k] = -sides[k]
    return split(y)[0]


def alone(velocity, effects, duration, place=(0.0, 0.0, 0.0), **quantities):
    """Return a scene of one sphere."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=[place], velocity=[velocity], radius=RADIUS, mass=MASS, quantities=quantities
        ),
        effects=effects,
        duration=duration,
    )


@kind
def flow_that_begins(draw):
    begin, v = float(draw.uniform(0.02, 0.15)), draw.normal(size=3)
    flow = sources.CouetteFlow(
        first=-10.0, second=10.0, first_velocity=(-9, 0, 0), second_velocity=(11, 0, 0), begin=begin
    )

    def acceleration(t, r, u, sides):
        return RATE * ((sides[0] > 0) * np.array([1 + r[2], 0, 0]) - u)

    end = exact(acceleration, np.zeros(3), v, 0.2, [lambda t, r, u: t - begin])
    return alone(v, (flow, DRAG), 0.2), end[None]


@kind
def field_that_begins(draw):
    omega, begin, v = draw.uniform(20, 200), float(draw.uniform(0.02, 0.15)), draw.normal(size=3)
    field = sources.ElectricField(
        constant=(3e3, 0, 0), amplitude=(0, 2e3, 0), omega=(0, omega, 0), begin=begin
    )
    scene = alone(v, (laws.Lorentz(), field), 0.2, charge=[1e-5])
    late = 0.2 - begin
    a, b = 1e-5 * 3e3 / MASS, 1e-5 * 2e3 / MASS
    phase, last = omega * begin, omega * 0.2
    along = b / omega**2 * (omega * late * np.cos(phase) - np.sin(last) + np.sin(phase))
    return scene, (0.2 * v + np.array([0.5 * a * late**2, along, 0]))[None]


def slowed(law, speed, duration, jump, above, below):
    """Return a sphere in air that slows down through a jump of its drag coefficient, and its final position.

    above, below : functions of the Reynolds number on either side of the jump.
    """
    rho, mu, v = 1.2, 1.8e-5, np.array([speed, 0, 0])
    per_speed = 2 * RADIUS * rho / mu

    def acceleration(t, r, u, sides):
        size = np.linalg.norm(u)
        drag = (above if sides[0] > 0 else below)(per_speed * size)
        return -0.5 * rho * drag * np.pi * RADIUS**2 * size * u / MASS

    passes = [lambda t, r, u: per_speed * np.linalg.norm(u) - jump]
    scene = alone(v, (law(density=rho, viscosity=mu),), duration)
    return scene, exact(acceleration, np.zeros(3), v, duration, passes)[None]


@kind
def schiller_naumann_past_its_jump(draw):
    def below(re):
        return 24 / re * (1 + 0.15 * re**0.687)

    return slowed(laws.SchillerNaumannDrag, draw.uniform(2, 6), 4.0, 1000, lambda re: 0.44, below)


@kind
def chow_past_its_jump(draw):
    return slowed(laws.ChowDrag, draw.uniform(0.7, 2), 10.0, 400, lambda re: 0.5, lambda re: 24 / re**0.646)


@kind
def constriction(draw):
    v = np.array([0, 0, draw.uniform(0.5, 2)])
    flow = sources.ConstrictionFlow(
        centre=(0, 0, 0.3), speed=1.0, throat_radius=0.05, duct_radius=0.15, length=0.1, transition=0.05
    )

    def acceleration(t, r, u, sides):
        before, within, past, after = (side > 0 for side in sides)
        rise, fall = 1 + 8 * (r[2] - 0.2) / 0.05, 1 + 8 * (0.4 - r[2]) / 0.05
        along = 1.0 if not before or after else fall if past else 9.0 if within else rise
        return RATE * (np.array([0, 0, along]) - u)

    places = [lambda t, r, u, z=z: r[2] - z for z in (0.2, 0.25, 0.35, 0.4)]
    return alone(v, (flow, DRAG), 0.4), exact(acceleration, np.zeros(3), v, 0.4, places)[None]


@kind
def out_of_a_shear_flow(draw):
    v = np.array([0.0, 0.0, draw.uniform(1, 3)])
    gap = float(draw.uniform(0.02, 0.08))
    flow = sources.CouetteFlow(first=-gap, second=gap, first_velocity=(-1, 0, 0), second_velocity=(1, 0, 0))

    def acceleration(t, r, u, sides):
        return RATE * (np.array([1.0 if sides[0] > 0 else r[2] / gap, 0, 0]) - u)

    leaves = [lambda t, r, u: r[2] - gap]
    return alone(v, (flow, DRAG), 0.15), exact(acceleration, np.zeros(3), v, 0.15, leaves)[None]


def pair(speed, effects, duration, mass=1.0):
    """Return a scene of two spheres of 0.05 m that approach along x from 0.3 m."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=[(-0.15, 0, 0), (0.15, 0, 0)], velocity=[(speed / 2, 0, 0), (-speed / 2, 0, 0)],
            radius=0.05, mass=mass,
        ),
        effects=effects,
        duration=duration,
    )  # fmt: skip


def met(push, cutoff, speed, duration):
    """Return the final positions of two particles of 1 kg that repel each other within a cut-off."""

    def acceleration(t, r, u, sides):
        return 2 * push(r) if sides[0] < 0 else 0.0

    apart = exact(acceleration, np.array(0.3), np.array(-speed), duration, [lambda t, r, u: r - cutoff])
    return np.array([[-apart / 2, 0, 0], [apart / 2, 0, 0]])


@kind
def mie_at_its_cutoff(draw):
    speed, sigma = float(draw.uniform(0.1, 2)), 0.1
    duration = 0.5 / speed

    def push(d):
        return 4 * (12 * sigma**12 / d**13 - 6 * sigma**6 / d**7)

    scene = pair(speed, (laws.Mie(epsilon=1.0, n=12, m=6),), duration)
    return scene, met(push, sigma * 2 ** (1 / 6), speed, duration)


@kind
def powers_with_a_cutoff(draw):
    speed, cutoff = float(draw.uniform(0.5, 1.5)), float(draw.uniform(0.15, 0.25))
    duration, alpha = 0.5 / speed, 0.02
    law = laws.TruncatedNearField(alpha1=0.0, beta1=1, alpha2=alpha, beta2=2, cutoff=cutoff)
    return pair(speed, (law,), duration), met(lambda d: alpha / d**2, cutoff, speed, duration)


def error(scene: tisim.Scene, end: np.ndarray, result: tisim.Result) -> float:
    """Return the largest error of a final position, relative to the distance from the start."""
    result.check()
    order = np.argsort(result.state["id"])
    moved = np.linalg.norm(end - result.start["position"], axis=1)
    return float((np.linalg.norm(result.state["position"][order] - end, axis=1) / moved).max())
