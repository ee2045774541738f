"""The figure of the tests of single contacts: runs as points, expected values as lines."""

from collections.abc import Iterable, Mapping
from contextlib import closing
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import run
from tisim.cases.common.runs import sound
from tisim.cases.common.two_spheres import hertz_force
from tisim.cases.granular_bench import adhesion, beams, closed_forms, motions, particle_tests
from tisim.cases.granular_bench.checks import rebounds
from tisim.cases.granular_bench.impacts import ParticleImpact, Rebound, by_id, force_curves, simulation_of
from tisim.cases.granular_bench.mindlin_impact import oblique_impacts
from tisim.plotting.style import empty, letters, plain

PANEL_COLOURS = ("#4477aa", "#cc6677", "#228833", "#aa7733", "#882255")
RIGID: dict[str, Any] = {"color": "0.55", "ls": "--", "lw": 1.1}
LAW_LINE: dict[str, Any] = {"color": "0.2", "ls": "-", "lw": 0.9}
"""Line styles of rigid spheres, and of the NumPy reference or its closed form."""
Found = Mapping[ParticleImpact, Rebound]
"""Rebounds by impact."""
CURVE_POINTS = 1000
"""Number of steps of an impact in the curves."""


def contact_figure() -> Figure:
    """Run the tests of single contacts, and draw them with the expected values."""
    figure = empty(11.6, 10.6)
    panels = figure.subplots(3, 3)
    (force, damped, tangential), (spin, fine, spinning), (rolling, pull, beam) = panels
    everything = [impact for test in particle_tests.TESTS.values() for impact in test]
    found = dict(zip(everything, rebounds(everything), strict=True))
    force_against_overlap(force)
    restitution(damped, found)
    oblique(tangential, spin, found)
    tangential_speeds(fine, found)
    spins(spinning, found)
    slide_to_roll(rolling)
    pull_against_gap(pull)
    deflection(beam)
    for axis in panels.flat:
        plain(axis)
        axis.legend(frameon=False, fontsize=7)
    tangential.legend(frameon=False, fontsize=7, loc="lower right")
    spin.legend(frameon=False, fontsize=7, loc="lower center")
    letters(panels.flat)
    return figure


def force_against_overlap(axis: Axes) -> None:
    """Draw tests 1 and 2, with Hertz's law."""
    elastic = particle_tests.ELASTIC + particle_tests.ELASTIC_PLANE
    for k, (impact, curve) in enumerate(zip(elastic, force_curves(elastic, 24), strict=True)):
        overlap = np.linspace(0, impact.depth, 200)
        _, radius, _, modulus = impact.hertz
        force = hertz_force(overlap, radius, modulus)
        axis.plot(1e6 * overlap, 1e-3 * force, **LAW_LINE, label="Hertz" if k == 0 else None)
        inside = curve.overlap > 0
        axis.plot(1e6 * curve.overlap[inside], 1e-3 * curve.force[inside], "o", ms=3, mfc="none",
                  color=PANEL_COLOURS[k], label=impact.substance)  # fmt: skip
    axis.set(xlabel="overlap (µm)", ylabel="force (kN)", title="1, 2: elastic impacts")


def by_substance(impacts: Iterable[ParticleImpact], found: Found) -> dict[str, list[Rebound]]:
    """Return the rebounds of several impacts by the substance of the spheres."""
    groups: dict[str, list[Rebound]] = {}
    for impact in impacts:
        groups.setdefault(impact.substance.removesuffix(" 2"), []).append(found[impact])
    return groups


def restitution(axis: Axes, found: Found) -> None:
    """Draw test 3."""
    axis.plot([0, 1], [0, 1], **LAW_LINE, label="as asked for")
    for k, (substance, group) in enumerate(by_substance(particle_tests.DAMPED, found).items()):
        axis.plot([one.impact.restitution for one in group], [one.restitution for one in group], "ox"[k],
                  ms=6, mfc="none", color=PANEL_COLOURS[k], label=substance)  # fmt: skip
    axis.set(xlabel="coefficient of restitution", ylabel="speed after over before", title="3: rebounds")


def oblique(tangential: Axes, spin: Axes, found: Found) -> None:
    """Draw test 4: the fraction of the tangential velocity that remains, and the spin, by the angle of
    incidence."""
    angles = np.linspace(1.0, 89.0, 89)
    tangent, mu = np.tan(np.radians(angles)), particle_tests.OBLIQUE["friction"]
    e, radius = particle_tests.OBLIQUE["restitution"], particle_tests.OBLIQUE["radius"]
    # Without tangential elasticity a surface slides throughout, or its final speed is 0.
    loss = np.minimum(mu * (1 + e), 2 / 7 * tangent)
    tangential.plot(angles, 1 - loss / tangent, **RIGID, label="rigid spheres")
    down = particle_tests.OBLIQUE_SPEED * np.cos(np.radians(angles))
    spin.plot(angles, 2.5 * loss * down / radius, **RIGID, label="rigid spheres")
    for k, (substance, group) in enumerate(by_substance(particle_tests.OBLIQUES, found).items()):
        curve = [particle_tests.oblique(group[0].impact.substance, a) for a in angles]
        velocity, turning = oblique_impacts(curve, CURVE_POINTS)
        line = {**LAW_LINE, "ls": ("-", ":")[k]}
        label = f"law in NumPy, {substance}"
        tangential.plot(angles, velocity / [one.sideways for one in curve], **line, label=label)
        spin.plot(angles, turning, **line, label=label)
        at = [np.degrees(np.arctan2(one.impact.sideways, one.impact.speed)) for one in group]
        point: dict[str, Any] = {
            "marker": "ox"[k],
            "ms": 5,
            "mfc": "none",
            "ls": "none",
            "color": PANEL_COLOURS[k],
        }
        tangential.plot(at, [one.tangential_restitution for one in group], **point, label=substance)
        spin.plot(at, [one.spin[1] for one in group], **point, label=substance)
    tangential.set(xlabel="angle of incidence (degrees)", ylabel="tangential velocity after over before",
                   title="4: oblique impacts")  # fmt: skip
    spin.set(xlabel="angle of incidence (degrees)", ylabel="spin after (rad/s)", title="4: their spin")


def tangential_speeds(axis: Axes, found: Found) -> None:
    """Draw test 5: the surface's speed after the impact against its speed before, over mu times the normal
    speed."""
    slide = np.linspace(0.1, 14, 100)
    unit = particle_tests.FINE_FRICTION * particle_tests.FINE_SPEED
    axis.plot(slide, np.maximum(slide - 7, 0), **RIGID, label="rigid spheres")
    for k, (substance, group) in enumerate(by_substance(particle_tests.SIDEWAYS, found).items()):
        curve = [particle_tests.sideways(substance, s) for s in slide]
        velocity, turning = oblique_impacts(curve, CURVE_POINTS)
        line = {**LAW_LINE, "ls": ("-", ":")[k]}
        surface = velocity - curve[0].radius * turning
        axis.plot(slide, surface / unit, **line, label=f"law in NumPy, {substance}")
        axis.plot([one.impact.sideways / unit for one in group], [one.surface_speed / unit for one in group],
                  "ox"[k], ms=5, mfc="none", color=PANEL_COLOURS[k], label=substance)  # fmt: skip
    axis.set(xlabel=r"surface before, over $\mu v_n$", ylabel=r"surface after, over $\mu v_n$",
             title="5: tangential velocities")  # fmt: skip


def spins(axis: Axes, found: Found) -> None:
    """Draw tests 6 to 8: the tangential velocity that results from a spin, over the normal speed."""
    tests = particle_tests.SPINNING_PLANE + particle_tests.SPINNING_EQUAL + particle_tests.UNEQUAL
    e, mu = particle_tests.SPINNING["restitution"], particle_tests.SPINNING["friction"]
    speed, radius = particle_tests.SPINNING["speed"], particle_tests.SPINNING["radius"]
    before = np.linspace(0.0, 11.0, 100)
    axis.plot(before, np.minimum(mu * (1 + e), 2 / 7 * before), **RIGID, label="rigid spheres")
    curve = [particle_tests.spinning("nylon", v * speed / radius, "plane") for v in before]
    axis.plot(
        before, oblique_impacts(curve, CURVE_POINTS)[0] / speed, **LAW_LINE, label="law in NumPy, e = 0.5"
    )
    label = {"plane": "6: at a plane", "equal": "7: equal spheres", "large": "8: 1 to 5",
             "large rigid": "8: 1 to 5, rigid"}  # fmt: skip
    for k, partner in enumerate(label):
        group = [found[one] for one in tests if one.partner == partner]
        axis.plot([one.impact.spin * radius / speed for one in group],
                  [one.velocity[0] / speed for one in group], "ox+s"[k], ms=4 + k, mfc="none",
                  color=PANEL_COLOURS[k], label=label[partner])  # fmt: skip
    axis.set(xlabel=r"$R\,\omega$ before, over $v_n$", ylabel="tangential velocity after, over $v_n$",
             title="6, 7, 8: spheres that spin")  # fmt: skip


def slide_to_roll(axis: Axes) -> None:
    """Draw the speeds of a sphere that slides until it rolls."""
    one, end = motions.slides(), motions.roll_begins()
    rows = []
    with closing(simulation_of([one.scene()])) as simulation:
        for time in np.linspace(0, one.duration, 41)[1:]:
            simulation.run(until=time)
            state = by_id(sound(simulation.results())[0])
            rows.append((time, state["velocity"][0, 0], motions.SPHERE_RADIUS * state["spin"][0, 1]))
    time, speed, surface = np.array(rows).T
    slowed = motions.FRICTION * motions.G
    exact = np.array([0.0, end, one.duration])
    axis.plot(1e3 * exact, [1.0, 5 / 7, 5 / 7], **LAW_LINE, label=r"$v - \mu g t$, and 5/7 v")
    axis.plot(1e3 * exact, [0.0, 2.5 * slowed * end, 5 / 7], **LAW_LINE)
    axis.plot(1e3 * time, speed, "o", ms=4, mfc="none", color=PANEL_COLOURS[0], label="speed")
    axis.plot(1e3 * time, surface, "x", ms=4, color=PANEL_COLOURS[1], label="R times spin")
    axis.set(xlabel="time (ms)", ylabel="speed (m/s)", title="from sliding to rolling")


def pull_against_gap(axis: Axes) -> None:
    """Draw the forces between two spheres that are drawn apart."""
    a = adhesion
    radius, rupture = a.STICKY_RADIUS / 2, closed_forms.bridge_rupture(a.ANGLE, a.VOLUME)
    stretch = closed_forms.jkr_stretch(a.ENERGY, radius, a.STICKY_MODULUS)
    seen = a.pulls([a.drawn("dmt", 2 * stretch, 2 * stretch), a.drawn("bridge", 2 * stretch, 2 * stretch)])
    found = dict(zip(("DMT", "liquid bridge"), seen, strict=True))
    (found["JKR"],) = a.pulls([a.drawn("jkr", 2 * stretch, 2 * stretch)])
    gap = np.linspace(-2 * stretch, 2 * stretch, 400)
    push = hertz_force(-gap, radius, a.STICKY_MODULUS)
    wet = closed_forms.bridge_force(gap, 2 * radius, a.TENSION, a.ANGLE, a.VOLUME) * (gap < rupture)
    bound = gap[gap < stretch]
    curves = (
        (gap, push - closed_forms.dmt_pull_off(a.ENERGY, radius) * (gap <= 0)),
        (gap, push - wet),
        (bound, np.array([closed_forms.jkr_force(-x, a.ENERGY, radius, a.STICKY_MODULUS) for x in bound])),
    )
    for x, y in curves:
        axis.plot(1e6 * x, 1e3 * y, **LAW_LINE)
    for k, (name, one) in enumerate(found.items()):
        axis.plot(-1e6 * one.overlap[::8], 1e3 * one.force[::8], "ox+"[k], ms=4, mfc="none",
                  color=PANEL_COLOURS[k], label=name)  # fmt: skip
    axis.set(xlabel="gap (µm)", ylabel="force, below 0 a pull (mN)", title="drawn apart")


def deflection(axis: Axes) -> None:
    """Draw a row of cemented spheres under a load at its end."""
    (state,) = map(by_id, sound(run([beams.beam(beams.LOAD)])))
    length = beams.SPHERES * beams.BEAM_SIDE
    x = np.linspace(0, length, 100)
    bent = beams.LOAD * x**2 * (3 * length - x) / (6 * beams.BEAD_YOUNG * beams.SECOND)
    axis.plot(1e3 * x, 1e3 * bent, **LAW_LINE, label="Euler and Bernoulli")
    axis.plot(1e3 * state["position"][:, 0], 1e3 * state["position"][:, 1], "o", ms=8, mfc="none",
              color=PANEL_COLOURS[0], label="cemented spheres")  # fmt: skip
    axis.set(xlabel="along the row (mm)", ylabel="deflection (mm)", title="a cantilever")
