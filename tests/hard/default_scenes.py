"""Random small scenes that name no stepper, of every family, each with an exact reference. Six families are
hard cases (cases/hard/default_stepper.py).

A family is a function of a random number generator. It returns a scene and a function that returns the error
of a result against the reference, relative to the size of the motion or to the energy. Sizes, masses, forces
and times are drawn over decades.
"""

import numpy as np
from scipy.constants import G, mu_0

import tisim
from tisim import effects as laws
from tisim import sources
from tisim.cases.hard.default_stepper import (
    by_path,
    damped_grains,
    decades,
    direction,
    driven_charge,
    grains_of,
    impact,
    lorentz,
    permanent_magnet,
    tether,
)
from tisim.cases.hard.runs import given, kinetic
from tisim.geometry import Plane

FAMILIES = {}


def family(function):
    """Register a family by the name of its function."""
    FAMILIES[function.__name__] = function
    return function


for one in (tether, lorentz, driven_charge, permanent_magnet, damped_grains, impact):
    family(one)


@family
def stokes_drag(draw):
    radius, mu = decades(draw, 1e-7, 1e-2), decades(draw, 1e-5, 1e1)
    mass = decades(draw, 1e2, 1e4) * 4 / 3 * np.pi * radius**3
    rate = 6 * np.pi * mu * radius / mass
    duration, flow = draw.uniform(0.1, 20) / rate, decades(draw, 1e-4, 10) * direction(draw)
    v, g = decades(draw, 1e-4, 10) * direction(draw), np.array([0, 0, -9.81])
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], radius, mass),
        effects=(
            laws.StokesDrag(viscosity=mu),
            sources.UniformFlow(velocity=tuple(flow)),
            laws.Gravity(acceleration=tuple(g)),
        ),
        duration=duration,
    )
    end = flow + g / rate
    times = np.linspace(0, duration, 257)[:, None]
    paths = end * times + (v - end) / rate * (1 - np.exp(-rate * times))
    size = np.linalg.norm(paths, axis=1).max()
    return scene, lambda result: float(np.linalg.norm(result.state["position"][0] - paths[-1]) / size)


@family
def quadratic_drag(draw):
    """Quadratic drag by Reynolds number; the path crosses the jumps of the Schiller-Naumann and Chow laws."""
    law = laws.SchillerNaumannDrag
    radius, rho = decades(draw, 1e-4, 1e-1), decades(draw, 1.0, 1e3)
    mass = decades(draw, 1e2, 1e4) * 4 / 3 * np.pi * radius**3
    reynolds = decades(draw, 1e2, 1e5)
    speed = decades(draw, 1e-2, 50)
    mu = 2 * radius * rho * speed / reynolds
    time = mass / (0.5 * rho * 0.44 * np.pi * radius**2 * speed)
    duration, v = draw.uniform(0.3, 10) * time, speed * direction(draw)

    def acceleration(t, r, u):
        w = np.linalg.norm(u)
        re = 2 * radius * rho * w / mu
        drag = 0.44 * re if re > 1000 else 24 * (1 + 0.15 * re**0.687)
        return -0.25 * np.pi * mu * radius * drag * u / mass

    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], radius, mass),
        effects=(law(density=rho, viscosity=mu),),
        duration=duration,
    )
    start = {"position": np.zeros((1, 3)), "velocity": v[None]}
    return scene, by_path(acceleration, start, duration, max_step=duration / 2000)


@family
def self_gravity(draw):
    """Two bodies in orbits of eccentricity up to 0.9, and a light third body far out."""
    size, total = decades(draw, 1e-2, 1e6), decades(draw, 1e-3, 1e20)
    ratio, e = draw.uniform(0.05, 0.5), draw.uniform(0, 0.9)
    m = total * np.array([ratio, 1 - ratio])
    period = 2 * np.pi * np.sqrt(size**3 / (G * total))
    far, speed = size * (1 + e), np.sqrt(G * total / size * (1 - e) / (1 + e))
    r = np.array([[-m[1], 0, 0], [m[0], 0, 0]]) / total * far
    v = np.array([[0, -m[1], 0], [0, m[0], 0]]) / total * speed
    duration = draw.uniform(0.2, 6) * period
    scene = tisim.Scene(
        particles=given(r, v, 1e-3 * size, m), effects=(laws.SelfGravity(),), duration=duration
    )

    def acceleration(t, x, u):
        d = x[1] - x[0]
        pull = G * d / np.linalg.norm(d) ** 3
        return np.array([m[1] * pull, -m[0] * pull])

    return scene, by_path(acceleration, {"position": r, "velocity": v}, duration)


@family
def near_field(draw):
    """Like charges that fly apart, and particles that oscillate in the well of two power laws."""
    n, size, mass = 4, decades(draw, 1e-6, 1e1), decades(draw, 1e-12, 1.0)
    r = size * (np.indices((2, 2, 1)).reshape(3, -1).T + 0.2 * draw.uniform(-1, 1, (n, 3)))
    strength = decades(draw, 1e-12, 1e3)
    rate = np.sqrt(strength / (mass * size))
    v = 0.3 * size * rate * draw.uniform(-1, 1, (n, 3))
    alpha1, alpha2 = strength * size, strength * size**2
    duration = draw.uniform(0.5, 6) / rate
    scene = tisim.Scene(
        particles=given(r, v, 1e-3 * size, mass),
        effects=(laws.NearField(alpha1=alpha1, beta1=1, alpha2=alpha2, beta2=2),),
        duration=duration,
    )

    def acceleration(t, x, u):
        d = x[None] - x[:, None]
        q = np.linalg.norm(d, axis=2) + np.eye(n)
        pull = (alpha1 / q - alpha2 / q**2) / q
        np.fill_diagonal(pull, 0)
        return (pull[:, :, None] * d).sum(axis=1) / mass

    return scene, by_path(acceleration, {"position": r, "velocity": v}, duration)


@family
def mie(draw):
    """Two particles with a Mie potential collide, head-on or off centre, and part again."""
    radius, mass = decades(draw, 1e-9, 1e-2), decades(draw, 1e-20, 1e-3)
    sigma, well = 2 * radius, decades(draw, 0.1, 30.0)
    speed = decades(draw, 1e-3, 1e2)
    eps = 0.25 * mass * speed**2 * well
    c, cutoff = 4.0, 2 ** (1 / 15)
    half = sigma * draw.uniform(0.8, 1.5)
    r = np.array([[-half, 0, 0], [half, draw.uniform(0, 0.9) * sigma, 0]])
    v = np.array([[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]])
    duration = 4 * half / speed
    scene = tisim.Scene(
        particles=given(r, v, radius, mass), effects=(laws.Mie(epsilon=eps),), duration=duration
    )

    def acceleration(t, x, u):
        d = x[1] - x[0]
        q = np.linalg.norm(d)
        push = c * eps * (30 * (sigma / q) ** 30 - 15 * (sigma / q) ** 15) / q if q < cutoff * sigma else 0.0
        a = push / mass * d / q
        return np.array([-a, a])

    return scene, by_path(
        acceleration, {"position": r, "velocity": v}, duration, max_step=0.01 * sigma / speed
    )


@family
def morse(draw):
    """Two particles with a Morse potential collide, head-on or off centre, and part again."""
    radius, mass = decades(draw, 1e-9, 1e-2), decades(draw, 1e-20, 1e-3)
    sigma, well = 2 * radius, decades(draw, 0.1, 30.0)
    speed, alpha = decades(draw, 1e-3, 1e2), decades(draw, 5, 50) / sigma
    depth = 0.25 * mass * speed**2 * well
    half = sigma * draw.uniform(0.8, 1.5)
    r = np.array([[-half, 0, 0], [half, draw.uniform(0, 0.9) * sigma, 0]])
    v = np.array([[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]])
    duration = 4 * half / speed
    # Repulsion alone: a cut-off at the bottom of the well.
    law = laws.Morse(depth=depth, alpha=alpha, cutoff=1.0)
    scene = tisim.Scene(particles=given(r, v, radius, mass), effects=(law,), duration=duration)

    def acceleration(t, x, u):
        d = x[1] - x[0]
        q = np.linalg.norm(d)
        e = np.exp(alpha * (sigma - q))
        push = 2 * alpha * depth * e * (e - 1) if q < sigma else 0.0
        a = push / mass * d / q
        return np.array([-a, a])

    return scene, by_path(
        acceleration, {"position": r, "velocity": v}, duration, max_step=0.01 * sigma / speed
    )


@family
def elastic_grains(draw):
    """Two elastic Hertzian grains collide off centre without friction; the energy is conserved."""
    radius, rho, mass, young = grains_of(draw)
    # Overlaps reach a few hundredths of a radius.
    speed = decades(draw, 1e-4, 3e-2) * np.sqrt(young / rho)
    r = np.array([[-1.1 * radius, 0, 0], [1.1 * radius, draw.uniform(0, 1.5) * radius, 0]])
    v = np.array([[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]])
    scene = tisim.Scene(
        particles=given(r, v, radius, mass),
        materials={"grain": tisim.Material(young=young, poisson=0.25)},
        effects=(laws.Granular(),),
        duration=8 * radius / speed,
    )
    return scene, lambda result: float(abs(kinetic(result.state) / kinetic(result.start) - 1))


@family
def adhesive_grains(draw):
    """Two elastic, adhesive grains (DMT or JKR) collide head-on and part.

    With DMT the energy is conserved. With JKR the pair loses the work of separating the surfaces beyond the
    point of first touch.
    """
    radius, _, mass, _ = grains_of(draw)
    young, energy = decades(draw, 1e6, 1e8), decades(draw, 1e-4, 3e-2) * radius / 1e-4
    reduced, mean, soft = mass / 2, radius / 2, 0.5 * young / (1 - 0.25**2)
    # The JKR curve from zero overlap to separation, parametrised by the contact radius.
    ratio = np.pi * energy / soft
    circle = np.geomspace((mean**2 * ratio / 4) ** (1 / 3), (4 * mean**2 * ratio) ** (1 / 3), 20_001)
    gap = 2 * np.sqrt(ratio * circle) - circle**2 / mean
    pull = 4 * soft * np.sqrt(ratio * circle**3) - 4 / 3 * soft * circle**3 / mean
    parting = float(np.sum(0.5 * (pull[1:] + pull[:-1]) * -np.diff(gap)))
    jkr = draw.uniform() < 0.5
    lost = parting if jkr else 0.0
    adhesion = 4 * np.pi * energy * mean * (3 * np.pi * energy / (soft * mean)) ** (2 / 3) * mean
    before = max(adhesion * decades(draw, 0.1, 1e3), 1.3 * lost)
    speed = np.sqrt(2 * before / reduced)
    law = laws.Granular(normal=laws.JKR()) if jkr else laws.Granular(cohesion=laws.DMT())
    # Long enough for the remaining speed after the impact, and for some oscillations.
    slowest = speed * np.sqrt(1 - lost / before)
    scene = tisim.Scene(
        particles=given(
            [[-1.02 * radius, 0, 0], [1.02 * radius, 0, 0]], [[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]],
            radius, mass,
        ),
        materials={"grain": tisim.Material(young=young, poisson=0.25, surface_energy=energy)},
        effects=(law,),
        duration=0.04 * radius / speed + 0.1 * radius / slowest + 30 * np.sqrt(mass / (young * radius)),
    )  # fmt: skip

    def error(result):
        return float(abs(kinetic(result.state) - (before - lost)) / max(before, adhesion))

    return scene, error


@family
def grain_on_floor(draw):
    """An elastic grain bounces on a floor under gravity; the energy is conserved."""
    radius, rho, mass, young = grains_of(draw)
    g = 9.81
    height = min(decades(draw, 0.1, 20) * radius, 1e-4 * young / (rho * g))
    speed = np.sqrt(2 * g * height)
    scene = tisim.Scene(
        particles=given([(0, 0, radius + height)], [(0.3 * speed, 0, 0)], radius, mass),
        materials={"grain": tisim.Material(young=young, poisson=0.25)},
        effects=(laws.Granular(), laws.Walls(planes=[Plane()]), laws.Gravity(acceleration=(0, 0, -g))),
        duration=2.5 * speed / g,
    )

    def energy(state):
        above = float((state["position"][:, 2] - radius).sum())
        # Soft grains may still be in contact with the floor and store energy there.
        pressed = 8 / 15 * young / (2 * (1 - 0.25**2)) * np.sqrt(radius) * max(0.0, -above) ** 2.5
        return kinetic(state) + mass * g * above + pressed

    return scene, lambda result: float(abs(energy(result.state) / energy(result.start) - 1))


def bonded(draw, velocities):
    """Return a scene of a free bonded pair, its stiffness along the bond (N/m) and its velocities (m/s, shape
    (2, 3)).

    velocities : function that turns random numbers between -1 and 1 into the velocities.
    """
    radius, rho, mass, young = grains_of(draw)
    speed = decades(draw, 1e-6, 1e-4) * np.sqrt(young / rho)
    r, v = [[-radius, 0, 0], [radius, 0, 0]], velocities(speed * draw.uniform(-1, 1, (2, 3)))
    stiffness = young / (2 * radius) * np.pi * radius**2
    period = 2 * np.pi * np.sqrt(0.5 * mass / stiffness)
    law = laws.ParallelBond(gap=1e-6 * radius, young=young, tensile_strength=1e30, shear_strength=1e30)
    scene = tisim.Scene(
        particles=given(r, v, radius, mass), effects=(law,), duration=draw.uniform(1, 30) * period
    )
    return scene, stiffness, v


@family
def bonded_pair(draw):
    """A free bonded pair oscillates along and across its bond; its energy stays bounded."""
    scene, _, v = bonded(draw, lambda drawn: drawn)

    def error(result):
        # The energy must not exceed its initial value, and the centre of mass must follow a straight line.
        more = kinetic(result.state) / kinetic(result.start) - 1
        centre = result.state["position"].mean(axis=0) - v.mean(axis=0) * result.time
        path = np.linalg.norm(v.mean(axis=0)) * result.time
        return float(max(more, np.linalg.norm(centre) / max(path, 1e-3 * result.start["radius"][0])))

    return scene, error


@family
def bond_along_itself(draw):
    """A free bonded pair oscillates along its bond as a spring; the energy, including the bond, is
    conserved."""

    def along(drawn):
        return np.column_stack([drawn[:, 0], drawn[[0, 0], 1:]])

    scene, stiffness, _ = bonded(draw, along)

    def energy(state):
        stretch = state["position"][1, 0] - state["position"][0, 0] - state["radius"].sum()
        along = (state["velocity"][:, 0] - state["velocity"][:, 0].mean()) ** 2
        return 0.5 * state["mass"][0] * along.sum() + 0.5 * stiffness * stretch**2

    return scene, lambda result: float(abs(energy(result.state) / energy(result.start) - 1))


@family
def zohdi_contact(draw):
    """Two soft spheres of Z16 collide; the energy is conserved."""
    radius, rho = decades(draw, 1e-5, 1e-1), decades(draw, 5e2, 8e3)
    mass, young = rho * 4 / 3 * np.pi * radius**3, decades(draw, 1e5, 1e10)
    speed = decades(draw, 1e-4, 1e-2) * np.sqrt(young / rho)
    law = laws.Hertz(young=young, poisson=0.3)
    r, v = [[-1.1 * radius, 0, 0], [1.1 * radius, 0, 0]], [[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]]
    scene = tisim.Scene(particles=given(r, v, radius, mass), effects=(law,), duration=3 * radius / speed)
    return scene, lambda result: float(abs(kinetic(result.state) / kinetic(result.start) - 1))


@family
def free_clump(draw):
    """A rigid body of unequal spheres rotates freely; energy and angular momentum are conserved."""
    size, rho = decades(draw, 1e-5, 1e-1), decades(draw, 5e2, 8e3)
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    centres = size * (0.6 * corners + 0.3 * draw.uniform(-1, 1, (4, 3)))
    clump = tisim.Clump(centres=centres, radii=size * draw.uniform(0.3, 0.6, 4), density=rho)
    rate = decades(draw, 1e-2, 1e3)
    spin = rate * draw.normal(size=3)
    bodies = tisim.Particles.of_clumps(clump, position=[(0, 0, 0)], angular_velocity=[spin])
    scene = tisim.Scene(
        particles=bodies,
        effects=(laws.RigidClumps(),),
        duration=decades(draw, 0.5, 300) / rate,
    )

    def error(result):
        before, after = (tisim.analysis.clump_bodies(s) for s in (result.start, result.state))
        return float(abs(np.sum(after.energy) / np.sum(before.energy) - 1))

    return scene, error


@family
def charged_grains(draw):
    """Two elastic grains with like or unlike charges meet (Coulomb and Hertz); the energy is conserved."""
    radius, rho, mass, young = grains_of(draw)
    speed = decades(draw, 1e-3, 1e-2) * np.sqrt(young / rho)
    # The Coulomb energy at contact ranges from nearly zero to half of the kinetic energy.
    charge = draw.choice([-1, 1]) * decades(draw, 1e-2, 0.5) * 0.25 * mass * speed**2 * 2 * radius
    r = np.array([[-1.5 * radius, 0, 0], [1.5 * radius, draw.uniform(0, 1.0) * radius, 0]])
    v = np.array([[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]])
    signs = [1, int(np.sign(charge))]
    scene = tisim.Scene(
        particles=given(r, v, radius, mass, polarity=signs),
        materials={"grain": tisim.Material(young=young, poisson=0.25)},
        effects=(laws.Granular(), laws.NearField(alpha2=abs(charge), beta2=2, signed=True)),
        duration=8 * radius / speed,
    )

    def energy(state):
        d = np.linalg.norm(state["position"][1] - state["position"][0])
        overlap = max(0.0, 2 * radius - d)
        modulus = young / (2 * (1 - 0.25**2))
        return kinetic(state) + charge / d + 8 / 15 * modulus * np.sqrt(radius / 2) * overlap**2.5

    return scene, lambda result: float(abs(energy(result.state) / energy(result.start) - 1))


@family
def grains_in_magnetic_field(draw):
    """Charged elastic grains gyrate in a magnetic field and hit a floor; the kinetic energy is conserved."""
    radius, rho, mass, young = grains_of(draw)
    speed = decades(draw, 1e-4, 1e-2) * np.sqrt(young / rho)
    orbit = radius * decades(draw, 1, 20)
    rate = speed / orbit
    scene = tisim.Scene(
        particles=given(
            [(0, 0, 1.3 * radius)], [(0.1 * speed, 0, -speed)], radius, mass, charge=[mass * rate]
        ),
        materials={"grain": tisim.Material(young=young, poisson=0.25)},
        effects=(
            laws.Granular(), laws.Walls(planes=[Plane()]), laws.Lorentz(),
            sources.MagneticField(constant=(0, 1.0, 0)),
        ),
        duration=draw.uniform(0.1, 1) * 2 * np.pi / rate,
    )  # fmt: skip

    def error(result):
        if result.state["position"][0, 2] < radius:
            return 0.0
        return float(abs(kinetic(result.state) / kinetic(result.start) - 1))

    return scene, error


def dipole_force(a, b, d):
    """Return the force (N) on dipole a from dipole b, which is at the displacement d (m) from a."""
    size = np.linalg.norm(d)
    n = d / size
    factor = -3 * mu_0 / (4 * np.pi * size**4)
    return factor * ((a @ n) * b + (b @ n) * a + (a @ b) * n - 5 * (a @ n) * (b @ n) * n)


@family
def dipoles(draw):
    """Two dipoles with fixed moments pass each other."""
    radius, mass = decades(draw, 1e-7, 1e-2), decades(draw, 1e-15, 1e-3)
    moment = decades(draw, 1e-15, 1e-3) * direction(draw)
    r = radius * np.array([[-3, 0, 0], [3, 4 + draw.uniform(0, 2), 0]])
    force = mu_0 * 3 * (moment @ moment) / (4 * np.pi * (6 * radius) ** 4)
    speed = np.sqrt(force / mass * radius) * draw.uniform(4, 10)
    v = np.array([[speed, 0, 0], [-speed, 0, 0]])
    duration, size = 4 * radius / speed, np.linalg.norm(moment)
    scene = tisim.Scene(
        particles=given(r, v, radius, mass, saturation_moment=[size, size]),
        effects=(
            sources.MagneticField(constant=tuple(moment / size)),
            laws.FixedMoment(),
            laws.DipoleDipole(),
        ),
        duration=duration,
    )

    def acceleration(t, x, u):
        f = dipole_force(moment, moment, x[1] - x[0])
        return np.array([f, -f]) / mass

    return scene, by_path(acceleration, {"position": r, "velocity": v}, duration)


@family
def moment_past_magnet(draw):
    """A saturated grain is attracted past a magnetised ball, whose external field is a dipole field."""
    size, mass = decades(draw, 1e-5, 1e-1), decades(draw, 1e-15, 1e-3)
    magnetisation = 1e5 * direction(draw)
    ball = 4 / 3 * np.pi * size**3 * magnetisation
    moment = decades(draw, 1e-15, 1e-6)
    force = moment * mu_0 * np.linalg.norm(magnetisation) / size
    speed = np.sqrt(force * size / mass) * draw.uniform(1.5, 5)
    r = size * np.array([[-4, 2.5, draw.uniform(-1, 1)]])
    v, duration = np.array([[speed, 0, 0]]), 8 * size / speed
    scene = tisim.Scene(
        particles=given(r, v, 1e-3 * size, mass, saturation_moment=[moment]),
        effects=(
            laws.FixedMoment(),
            sources.MagneticSpheres(
                spheres=[sources.Sphere(radius=size, magnetisation=tuple(magnetisation))]
            ),
            laws.Magnetophoresis(),
        ),
        duration=duration,
    )
    start = {"position": r, "velocity": v}

    def acceleration(t, x, u):
        n = x[0] / np.linalg.norm(x[0])
        field = 3 * (ball @ n) * n - ball
        along = moment * field / np.linalg.norm(field)
        return dipole_force(along, ball, -x[0])[None] / mass

    return scene, by_path(acceleration, start, duration)


@family
def drag_in_constriction(draw):
    """A sphere is dragged along the axis of a constriction; the flow has four kinks along the path."""
    radius, mu = 5e-3, 1e-2 * decades(draw, 0.1, 10)
    mass = 500.0 * 4 / 3 * np.pi * radius**3
    rate, speed = 6 * np.pi * mu * radius / mass, draw.uniform(0.5, 2)
    size = decades(draw, 0.1, 100)
    flow = sources.ConstrictionFlow(
        centre=(0, 0, 0.3 * size), speed=1.0, throat_radius=0.05 * size, duct_radius=0.15 * size,
        length=0.1 * size, transition=0.05 * size,
    )  # fmt: skip
    duration = 0.4 * size
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [(0, 0, speed)], radius, mass),
        effects=(flow, laws.StokesDrag(viscosity=mu)),
        duration=duration,
    )

    def acceleration(t, x, u):
        inside = 1 - (abs(x[0, 2] / size - 0.3) - 0.05) / 0.05
        along = 1 + 8 * min(1.0, max(0.0, inside))
        return rate * (np.array([[0, 0, along]]) - u)

    start = {"position": np.zeros((1, 3)), "velocity": np.array([[0, 0, speed]])}
    return scene, by_path(acceleration, start, duration, max_step=duration / 2000)


@family
def drag_in_couette(draw):
    """A sphere crosses a shear flow that starts later."""
    radius, mu = decades(draw, 1e-5, 1e-2), decades(draw, 1e-4, 1e0)
    mass = 1e3 * 4 / 3 * np.pi * radius**3
    rate = 6 * np.pi * mu * radius / mass
    duration, gap = draw.uniform(0.3, 8) / rate, decades(draw, 1e1, 1e4) * radius
    begin, wall = float(draw.uniform(0.1, 0.6) * duration), decades(draw, 1e-3, 1.0)
    v = np.array([0.0, 0.0, 0.3 * gap * rate])
    flow = sources.CouetteFlow(
        first=-gap, second=gap, first_velocity=(-wall, 0, 0), second_velocity=(wall, 0, 0), begin=begin
    )
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], radius, mass),
        effects=(flow, laws.StokesDrag(viscosity=mu)),
        duration=duration,
    )

    def acceleration(t, x, u):
        moving = wall * np.clip(x[0, 2] / gap, -1, 1) if t >= begin else 0.0
        return rate * (np.array([[moving, 0, 0]]) - u)

    start = {"position": np.zeros((1, 3)), "velocity": v[None]}
    return scene, by_path(acceleration, start, duration, max_step=duration / 2000)
