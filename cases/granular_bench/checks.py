"""Standard tests of single contacts in discrete element codes, each compared with its expected value."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from tisim import Scene, run
from tisim.cases.case import Check
from tisim.cases.common.runs import sound
from tisim.cases.common.two_spheres import hertz_depth, hertz_force
from tisim.cases.granular_bench import adhesion, beams, closed_forms, motions, particle_tests
from tisim.cases.granular_bench.impacts import ParticleImpact, Rebound, by_id, force_curves, rebound
from tisim.cases.granular_bench.mindlin_impact import oblique_impacts
from tisim.cases.granular_bench.shear_cell import expected_ratio, sheared_beds

BOUND = 1e-3
"""Largest error of an impact in 800 steps, relative to the approach speed."""
HALVES = (0.25, 0.5)
"""Two times after release at which the speed is sampled, s; the springs are fully loaded by the first."""
SHEARED_FRACTIONS, RATIO_BOUND = (0.52, 0.56, 0.58), 0.07
"""Solid fractions of the sheared cells, and the largest difference between their mu and that of glass
beads."""
RISE_BOUND = 0.5
"""Largest shortfall of the rise of mu from the slowest to the fastest cell, as a fraction of the rise for
glass beads. A constant mu has no rise. In three starts the rise was 1.4, 1.6 and 2.0 times as large, so there
is no upper limit."""
COARSE = 4000
"""Number of steps of an impact in the NumPy reference."""


def rebounds(impacts: Sequence[ParticleImpact]) -> list[Rebound]:
    """Return the rebounds of several impacts, run as one batch."""
    results = sound(run([impact.scene() for impact in impacts]))
    return [rebound(impact, result) for impact, result in zip(impacts, results, strict=True)]


def check() -> Iterator[Check]:
    """Yield the tests of Chung and Ooi (2011), friction, rolling and rest, adhesion, a beam, and a shear
    cell."""
    everything = [impact for test in particle_tests.TESTS.values() for impact in test]
    found = dict(zip(everything, rebounds(everything), strict=True))
    yield from normal_impacts(found)
    yield from oblique_checks(found)
    yield from friction_and_rest()
    yield from pull_offs()
    yield from beam_checks()
    yield from shear_checks()


def normal_impacts(found: dict[ParticleImpact, Rebound]) -> Iterator[Check]:
    """Yield tests 1 to 3: Hertz's force, depth and duration, the rebound, and coefficients of restitution."""
    elastic = particle_tests.ELASTIC + particle_tests.ELASTIC_PLANE
    for impact, curve in zip(elastic, force_curves(elastic), strict=True):
        what = f"{impact.substance}, {'two spheres' if impact.partner == 'equal' else 'at a plane'}"
        _, radius, _, modulus = impact.hertz
        depth = float(hertz_depth(*impact.hertz))
        peak = float(hertz_force(depth, radius, modulus))
        yield Check(f"1, 2: largest force, {what} (N)", float(curve.force.max()), peak, BOUND * peak)
        yield Check(f"1, 2: largest overlap, {what} (m)", float(curve.overlap.max()), depth, BOUND * depth)
        duration = impact.duration
        yield Check(f"1, 2: duration, {what} (s)", curve.lasted, duration, BOUND * duration)
        off = np.abs(curve.force - hertz_force(curve.overlap, radius, modulus)).max() / peak
        yield Check(f"1, 2: force against overlap, {what}: largest deviation", float(off), 0.0, 1e-9)
        yield Check(f"1, 2: speed of rebound over approach, {what}", found[impact].restitution, 1.0, BOUND)
    for impact in particle_tests.DAMPED:
        name = f"3: restitution, {impact.substance}, e = {impact.restitution:g}"
        yield Check(name, found[impact].restitution, impact.restitution, BOUND)


def slides_throughout(impact: ParticleImpact) -> bool:
    """Return whether the surface slides throughout an impact, with a margin for an elastic sphere."""
    speed = abs(impact.sideways - impact.radius * impact.spin) / impact.speed
    return bool(speed > 1.15 * closed_forms.sliding_limit(impact.friction, impact.restitution))


def oblique_checks(found: dict[ParticleImpact, Rebound]) -> Iterator[Check]:
    """Yield tests 4 to 8: comparisons with the closed form and with the NumPy reference.

    The closed form holds for rigid spheres whose surface slides throughout; deviations up to half of the
    depth over the radius are allowed. The reference covers all angles and spins.
    """
    for number in (4, 5, 6, 7, 8):
        impacts = particle_tests.TESTS[number]
        velocity, spin = oblique_impacts(impacts, COARSE)
        scale = np.array([impact.approach for impact in impacts])
        radius = np.array([impact.radius for impact in impacts])
        along = np.array([found[impact].velocity[0] for impact in impacts])
        turning = np.array([found[impact].spin[1] for impact in impacts])
        off = float((np.abs(along - velocity) / scale).max())
        yield Check(
            f"{number}: tangential velocity, {len(impacts)} impacts: deviation from NumPy", off, 0.0, BOUND
        )
        off = float((np.abs(turning - spin) * radius / scale).max())
        yield Check(f"{number}: R times spin, same impacts: deviation from NumPy", off, 0.0, BOUND)
        for substance in dict.fromkeys(impact.substance for impact in impacts):
            some = [one for one in impacts if one.substance == substance and slides_throughout(one)]
            yield from sliding_checks(number, [found[impact] for impact in some])


def sliding_checks(number: int, sliding: Sequence[Rebound]) -> Iterator[Check]:
    """Yield the velocity and spin changes of sliding spheres, divided by mu (1 + e) v and 5/2 of that over
    R."""
    gains = []
    for one in sliding:
        impact = one.impact
        args = (impact.approach, impact.friction, impact.restitution, impact.radius, impact.share)
        change, turn = closed_forms.sliding_impact(*args)
        pushed, turned = abs(one.velocity[0] - impact.sideways), abs(one.spin[1] - impact.spin)
        gains.append((pushed / change, turned / turn))
    (pushed, turned), impact = np.mean(gains, axis=0), sliding[0].impact
    what = f"{number}: {len(gains)} impacts of {impact.substance} with sliding"
    excess = friction_excess(impact.restitution)
    yield Check(f"{what}: velocity loss over mu (1 + e) v", pushed, excess, BOUND)
    lever = impact.depth / impact.radius
    yield Check(f"{what}: spin over 5/2 mu (1 + e) v/R", turned, excess, BOUND + lever / 2 * excess)


def friction_excess(restitution: float) -> float:
    """Return the ratio of the sums of |N| and N over an impact, from the NumPy reference, at a plane.

    Damping pulls before the surfaces separate, and Coulomb's limit uses the magnitude of the force, so the
    ratio exceeds 1. It is 1 without damping.
    """
    one = ParticleImpact("glass", 1.0, 1e-3, restitution, 0.01, sideways=1.0)
    ((velocity,), _) = oblique_impacts([one], COARSE)
    return float((1.0 - velocity) / closed_forms.sliding_impact(1e-3, 0.01, restitution, 1.0)[0])


def last_states(*scenes: Scene) -> list[dict[str, np.ndarray]]:
    """Return the final states of several scenes."""
    return [by_id(result) for result in sound(run(list(scenes)))]


def friction_and_rest() -> Iterator[Check]:
    """Yield the motions of a sphere and a column at rest.

    The sphere slides and begins to roll, rolls and stops, lies on a slope, and lies between two planes.
    """
    m = motions
    steep = [m.on_slope(part * 3.5 * m.FRICTION) for part in m.SLOPES]
    rough = [m.on_slope(part * m.ROLLING_FRICTION, m.ROLLING_FRICTION, t) for part in m.HOLDS for t in HALVES]
    gripped = [m.held(part, t / 2) for part in m.HOLDS for t in HALVES]
    halfway = replace(m.rolls(), duration=m.stops_after() / 2)
    everything = [m.slides(), halfway, m.rolls(), m.column(), *steep, *rough, *gripped]
    results = sound(run([one.scene() for one in everything]))
    rolling, slowed, stopped, lying, *others = map(by_id, results)

    lever = m.SPHERE_RADIUS - m.sunk() / 2
    speed = m.SPEED / (1 + 0.4 * m.SPHERE_RADIUS**2 / lever**2)
    yield Check("sliding, then rolling: final over initial speed (5/7)", rolling["velocity"][0, 0] / m.SPEED,
                speed / m.SPEED, BOUND)  # fmt: skip
    slip = rolling["velocity"][0, 0] - lever * rolling["spin"][0, 1]
    yield Check("sliding, then rolling: surface velocity, m/s", float(slip), 0.0, BOUND)
    away = sliding_way(lever)
    yield Check("sliding, then rolling: distance, m", rolling["position"][0, 0], away, BOUND * away)
    held_back = m.ROLLING_FRICTION * m.G / (lever / m.SPHERE_RADIUS + 0.4 * m.SPHERE_RADIUS / lever)
    expected = m.ROLL_SPEED - held_back * m.stops_after() / 2
    yield Check("rolling against mu_r R m g: speed at half time, m/s", slowed["velocity"][0, 0], expected,
                BOUND * m.ROLL_SPEED)  # fmt: skip
    yield Check(
        "rolling against mu_r R m g: final speed, m/s", float(np.abs(stopped["velocity"]).max()), 0.0, BOUND
    )
    way = m.ROLL_SPEED**2 / (2 * held_back)
    yield Check("rolling against mu_r R m g: distance, m", stopped["position"][0, 0], way, 3 * BOUND * way)

    weight = results[3].measures["walls_force_z"]
    yield Check("a column at rest: force on the floor, N", weight, -m.COLUMN * m.WEIGHT, 1e-6 * m.WEIGHT)
    height = m.column_height()
    sunk = (2 * m.COLUMN - 1) * m.SPHERE_RADIUS - height
    yield Check(
        "a column at rest: height of the top sphere, m", lying["position"][-1, 2], height, BOUND * sunk
    )
    yield Check("a column at rest: largest speed, m/s", float(np.abs(lying["velocity"]).max()), 0.0, 1e-6)

    for part, one, state in zip(m.SLOPES, steep, others[:4], strict=True):
        gx, _, gz = one.gravity
        rolls_down = part < 1
        pull = gx / (1 + 0.4) if rolls_down else gx + m.FRICTION * gz
        name = f"on a slope of {part:g} times 7/2 mu: speed, {'5/7 g sin' if rolls_down else 'sliding'}"
        yield Check(f"{name}, m/s", state["velocity"][0, 0], pull * one.duration, 3 * BOUND * gx)
    ends = [
        (state["velocity"][0, 0], result.time) for state, result in zip(others[4:], results[8:], strict=True)
    ]
    weight_along = m.G * m.ROLLING_FRICTION / np.hypot(1, m.ROLLING_FRICTION)
    grip = 2 * m.FRICTION * m.PUSH / m.SPHERE_MASS
    for name, limit, sign, four in (
        ("on a slope of {:g} times mu_r", weight_along / 1.4, 1, ends[:4]),
        ("between two planes, pulled with {:g} of 2 mu N", grip, -1, ends[4:]),
    ):
        for part, (early, late) in zip(m.HOLDS, (four[:2], four[2:]), strict=True):
            what = name.format(part)
            if part < 1:
                yield Check(f"{what}: speed after {late[1]:g} s, m/s", late[0], 0.0, BOUND * limit * late[1])
            else:
                gained = (late[0] - early[0]) / (late[1] - early[1])
                expected = sign * (part - 1) * limit
                yield Check(f"{what}: acceleration, m/s^2", gained, expected, BOUND * limit)


def sliding_way(lever: float) -> float:
    """Return the distance (m) of a sphere that first slides and then rolls, after twice the time until it
    rolls."""
    m = motions
    slows = m.FRICTION * m.G
    until = m.SPEED / (slows * (1 + 2.5 * lever**2 / m.SPHERE_RADIUS**2))
    rolls = m.SPEED - slows * until
    return m.SPEED * until - slows * until**2 / 2 + rolls * (2 * m.roll_begins() - until)


def pull_offs() -> Iterator[Check]:
    """Yield the adhesion of two spheres that are drawn apart: DMT and a liquid bridge, then JKR."""
    a = adhesion
    radius, rupture = a.STICKY_RADIUS / 2, closed_forms.bridge_rupture(a.ANGLE, a.VOLUME)
    stretch = closed_forms.jkr_stretch(a.ENERGY, radius, a.STICKY_MODULUS)
    touching, bridge = a.pulls([a.drawn("dmt", 1e-6, 1e-6), a.drawn("bridge", 1e-6, 1.2 * rupture)])
    (jkr,) = a.pulls([a.drawn("jkr", stretch, 1.2 * stretch)])
    expected = closed_forms.dmt_pull_off(a.ENERGY, radius)
    yield Check("pull-off, DMT: 4 pi gamma R* (N)", touching.largest, expected, BOUND * expected)
    expected = closed_forms.jkr_pull_off(a.ENERGY, radius)
    yield Check("pull-off, JKR: 3 pi gamma R* (N)", jkr.largest, expected, BOUND * expected)
    yield Check("JKR: gap at which the contact ends (m)", jkr.ends, stretch, 5e-3 * stretch)
    curve = np.array(
        [closed_forms.jkr_force(x, a.ENERGY, radius, a.STICKY_MODULUS) for x in jkr.overlap[jkr.force != 0]]
    )
    off = float(np.abs(jkr.force[jkr.force != 0] - curve).max() / expected)
    yield Check("JKR: force against overlap: largest deviation", off, 0.0, 1e-6)
    wet = closed_forms.bridge_force(-bridge.overlap, 2 * radius, a.TENSION, a.ANGLE, a.VOLUME)
    gaps = (bridge.overlap < 0) & (bridge.force != 0)
    off = float(np.abs(bridge.force[gaps] + wet[gaps]).max() / wet.max())
    yield Check("liquid bridge: force against gap, Willett et al.: deviation", off, 0.0, 1e-9)
    yield Check("liquid bridge: gap at rupture (m)", bridge.ends, rupture, 5e-3 * rupture)


def beam_checks() -> Iterator[Check]:
    """Yield the deflection of a row of cemented spheres, and whether it breaks below and above its breaking
    load."""
    most = beams.breaking_load()
    scenes = [beams.beam(beams.LOAD), *(beams.beam(part * most, rises=True) for part in (0.97, 1.03))]
    bent, whole, broken = last_states(*scenes)
    smooth, discrete = beams.bends(beams.LOAD)
    end = bent["position"][-1, 1]
    yield Check("cantilever of 6 spheres: deflection by bending and shear (m)", end, discrete,
                3e-3 * discrete)  # fmt: skip
    yield Check("cantilever: deflection over Euler and Bernoulli's P l^3/(3 E I)", end / smooth, 1.0, 0.08)
    for part, state, bonds in ((0.97, whole, beams.SPHERES), (1.03, broken, beams.SPHERES - 1)):
        count = (state["parallel_bond_past"] != 0).any(axis=1).sum()
        yield Check(f"cantilever at {part:g} of its breaking load: number of bonds", float(count), bonds, 0.0)


def shear_checks() -> Iterator[Check]:
    """Yield the stress ratio of sheared cells and its rise with I, compared with glass beads."""
    beds = sheared_beds(SHEARED_FRACTIONS)
    expected = expected_ratio(np.array([bed.inertial_number for bed in beds]))
    for bed, ratio in zip(beds, expected, strict=True):
        name = f"plane shear: mu at I = {bed.inertial_number:.2f}, Jop et al."
        yield Check(name, bed.ratio, float(ratio), RATIO_BOUND)
    rise, line = beds[0].ratio - beds[-1].ratio, float(expected[0] - expected[-1])
    yield Check(
        "plane shear: shortfall of the rise of mu, Jop et al.", max(0.0, line - rise), 0.0, RISE_BOUND * line
    )
