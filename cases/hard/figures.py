"""Pictures of hard cases: tisim beside the methods and formulas that do not stand them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from scipy.constants import e as elementary_charge
from scipy.constants import electron_mass

from tisim import run
from tisim.cases.common.runs import sound
from tisim.cases.hard.gyration import GYRATION, charges, equal_steps
from tisim.cases.hard.moments import TO_ROUNDING, in_line, magnetised
from tisim.cases.hard.reactions import across_the_threshold, restitution, z04_iteration
from tisim.cases.hard.runs import by_id, solved
from tisim.cases.hard.singular import COULOMB_CONSTANT, electron_stepper, electrons
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain

LEAST_DRAWN = 1e-16
"""Errors below this are drawn at it."""


def released() -> Figure:
    """Draw the energy error of two electrons that are released 1 nm apart, against time: the adaptive
    trapezoidal rule, and steps of one length with the same number of force evaluations."""
    gap = 1e-9
    scene, swiftest = electrons(electron_stepper(1e-18), gap)
    times = np.geomspace(1e-16, scene.duration, 80)
    results = sound(run([scene.model_copy(update={"duration": float(time)}) for time in times]))
    distance = np.array([np.linalg.norm(np.diff(by_id(one.state)["position"], axis=0)) for one in results])
    speed = np.array([np.abs(one.state["velocity"]).max() for one in results])
    forces = results[-1].work["force_evaluations"]
    figure = empty(6.4, 3.6)
    axis = figure.subplots()

    def draw(time: np.ndarray, d: np.ndarray, v: np.ndarray, label: str, colour: str) -> None:
        error = np.abs((v / swiftest) ** 2 + gap / d - 1)
        axis.loglog(time, np.maximum(error, LEAST_DRAWN), color=colour, label=f"{label}: {forces} forces")

    draw(times, distance, speed, "tisim, adaptive steps", AXIS_COLOURS[0])
    for (name, step), colour in zip(
        (("Verlet", _verlet), ("explicit Euler", _euler)), AXIS_COLOURS[1:], strict=True
    ):
        draw(*_equal_steps(step, gap, scene.duration, forces), f"{name}, equal steps", colour)
    axis.set_xlabel("time (s)")
    axis.set_ylabel("error of the energy / energy")
    legend_above(axis, columns=1)
    plain(axis)
    return figure


Step = Callable[[float, float, float, float], tuple[float, float]]
"""A step of length dt (s): the distance (m) and the speed of each electron (m/s) after it, from those before
it and the constant of their acceleration (m^3/s^2)."""


def _euler(d: float, v: float, strength: float, dt: float) -> tuple[float, float]:
    return d + 2 * dt * v, v + dt * strength / d**2


def _verlet(d: float, v: float, strength: float, dt: float) -> tuple[float, float]:
    half = v + 0.5 * dt * strength / d**2
    d += 2 * dt * half
    return d, half + 0.5 * dt * strength / d**2


def _equal_steps(
    step: Step, gap: float, duration: float, number: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the times (s), distances (m) and speeds (m/s) after each of some steps from rest."""
    strength = COULOMB_CONSTANT * elementary_charge**2 / electron_mass
    series = [(gap, 0.0)]
    for _ in range(number):
        series.append(step(*series[-1], strength, duration / number))
    distance, speed = np.array(series[1:]).T
    return duration / number * np.arange(1, number + 1), distance, speed


def gyrations() -> Figure:
    """Draw the error of the speed of a charge in a magnetic field against the number of periods, for Boris'
    method in steps of 0.3 rad and of 300 periods, and for explicit Euler and Runge-Kutta in closed form."""
    figure = empty(6.4, 3.6)
    axis = figure.subplots()
    for z, colour in ((0.3, AXIS_COLOURS[0]), (2e3, AXIS_COLOURS[2])):
        periods = np.geomspace(max(1.0, z / 6), 1e4 if z < 1 else 3e6, 60)
        steps = np.unique(np.round(2 * np.pi * periods / z))
        scenes = [
            charges([0, 0, 0], [0.6, -0.8, 0.5], equal_steps("boris", z / GYRATION), n * z / GYRATION)
            for n in steps
        ]
        speed = np.array(
            [np.linalg.norm(one.state["velocity"][0, :2]) for one in sound(run(scenes))]
        )  # fmt: skip
        length = f"{z:g} rad" if z < 1 else f"{z / (2 * np.pi):.0f} periods"
        error = np.maximum(np.abs(speed - 1), LEAST_DRAWN)
        axis.loglog(steps * z / (2 * np.pi), error, color=colour, label=f"tisim, Boris, steps of {length}")
    z = 0.3
    steps = np.unique(np.round(np.geomspace(1, 1e4 * 2 * np.pi / z, 300)))
    powers = np.array([1, 1j * z, (1j * z) ** 2 / 2, (1j * z) ** 3 / 6, (1j * z) ** 4 / 24])
    for name, order, style in (("explicit Euler", 1, "--"), ("Runge-Kutta of order 4", 4, ":")):
        factor = np.log(np.abs(powers[: order + 1].sum()))
        error = np.abs(np.expm1(np.minimum(steps * factor, 30)))
        axis.loglog(
            steps * z / (2 * np.pi), error, style, color=AXIS_COLOURS[1], label=f"{name}, steps of {z} rad"
        )
    axis.set_ylim(LEAST_DRAWN / 2, 1e4)
    axis.set_xlabel("periods")
    axis.set_ylabel("error of the speed / speed")
    legend_above(axis, columns=2)
    plain(axis)
    return figure


def divergence() -> Figure:
    """Draw the moments of two spheres in line with the field against their distance: closed form, tisim, and
    the distances at which tisim stops because no finite moments exist."""
    least = 2 ** (1 / 3)
    distances = np.concatenate([
        np.geomspace(0.5, 0.98, 8), np.linspace(1.02, 1.258, 10), least + np.geomspace(1e-3, 3 - least, 28),
    ])  # fmt: skip
    results = solved([magnetised([[0, 0, 0], [0, 0, d]], **TO_ROUNDING) for d in distances])
    alone = in_line([0.0])[0]
    there = [one.status.reason == "running" for one in results]
    figure = empty(6.4, 3.6)
    axis = figure.subplots()
    curve = least + np.geomspace(3e-4, 3 - least, 400)
    axis.semilogy(
        curve, [in_line([0, d])[0] / alone for d in curve], color="0.6", label="closed form", zorder=1
    )
    moments = [by_id(one.state)["moment"][0, 2] / alone for one, ok in zip(results, there, strict=True) if ok]
    axis.semilogy(distances[there], moments, "o", ms=4, color=AXIS_COLOURS[0], label="tisim")
    stopped = distances[np.logical_not(there)]
    axis.axvspan(0.45, least, color=AXIS_COLOURS[1], alpha=0.12, lw=0)
    axis.semilogy(
        stopped, np.full(len(stopped), 1.3), "x", color=AXIS_COLOURS[1], label="tisim stops, says why"
    )
    axis.set_xlim(0.45, 3.0)
    axis.set_ylim(1.0, 2e3)
    axis.set_xlabel("distance / radius")
    axis.set_ylabel("moment / moment of one sphere alone")
    legend_above(axis)
    plain(axis)
    return figure


def threshold() -> Figure:
    """Draw the restitution in each iteration of Z04 beside the one that tisim finds, and the restitution of
    strongly coupled impacts against their speed."""
    figure = empty(7.2, 3.2)
    iteration, scan = axes = figure.subplots(1, 2)
    history = z04_iteration(iterations=20)
    iteration.plot(
        np.arange(1, 21), history, "o-", ms=3, lw=0.8, color=AXIS_COLOURS[1], label="as printed in Z04"
    )
    iteration.axhline(1 - np.sqrt(0.5), color=AXIS_COLOURS[0], label="tisim")
    iteration.set_ylim(-0.03, 0.68)
    iteration.set_xlabel("iteration")
    iteration.set_ylabel("restitution")
    iteration.legend(frameon=False, fontsize=8, loc="upper right", ncols=2)
    speeds, results = across_the_threshold()
    bonded = np.array([one.work["bonds"] > 0 for one in results])
    e = np.array([restitution(one, v) for v, one in zip(speeds, results, strict=True)])
    for which, label, colour in ((~bonded, "rebound", AXIS_COLOURS[0]), (bonded, "bond", AXIS_COLOURS[1])):
        scan.plot(speeds[which], e[which], ".", ms=3, color=colour, label=label)
    scan.set_xlabel("speed of each grain (m/s)")
    scan.set_ylabel("restitution")
    scan.legend(frameon=False, fontsize=8)
    for axis in axes:
        plain(axis)
    letters(axes)
    return figure
