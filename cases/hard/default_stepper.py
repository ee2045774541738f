"""Random scenes that name no stepper.

Each family is a function of a random number generator. It returns a scene and a function that returns the
error of a result against an exact reference, relative to the size of the motion or to the energy. Sizes,
masses, forces and times are drawn over decades.
"""

import zlib

import numpy as np
from scipy.integrate import solve_ivp

import tisim
from tisim import effects as laws
from tisim import sources
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import given, kinetic
from tisim.steppers.choice import ACCURACY

SCENES_EACH = 12
"""Random scenes of each hard case."""


def decades(draw, low, high):
    """Return a random number between two bounds, uniform in its logarithm."""
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def direction(draw):
    """Return a random unit vector."""
    v = draw.normal(size=3)
    return v / np.linalg.norm(v)


def by_path(acceleration, start, duration, **tolerances):
    """Return the error of a result against an integration to 1e-11, over the largest distance from the start.

    acceleration : function of (t, r, v), which are arrays of shape (n, 3).
    """
    r, v = start["position"], start["velocity"]
    n = len(r)

    def rates(t, y):
        y = y.reshape(2, n, 3)
        return np.concatenate([y[1], acceleration(t, y[0], y[1])]).ravel()

    speed = np.abs(v).max() + 1e-3 * duration * np.abs(acceleration(0.0, r, v)).max()
    resolved = 1e-12 * np.repeat([speed * duration, speed], 3 * n)
    exact = solve_ivp(
        rates, (0, duration), np.concatenate([r, v]).ravel(), method="DOP853", rtol=1e-10, atol=resolved,
        t_eval=np.linspace(0, duration, 65), **tolerances,
    )  # fmt: skip
    paths = exact.y.reshape(2, n, 3, -1)[0]
    sizes = np.linalg.norm(paths - r[:, :, None], axis=1).max(axis=1)

    def error(result):
        off = np.linalg.norm(result.state["position"] - paths[..., -1], axis=1)
        return float((off / sizes).max())

    return error


def grains_of(draw, number=2):
    """Return radius (m), density (kg/m^3), mass (kg) and material of grains, from soft to hard."""
    radius, rho = decades(draw, 1e-5, 1e-1), decades(draw, 5e2, 8e3)
    young = decades(draw, 1e6, 1e11)
    return radius, rho, rho * 4 / 3 * np.pi * radius**3, young


def tether(draw):
    mass, omega = decades(draw, 1e-15, 1.0), draw.uniform(0.3, 1, 3) * decades(draw, 1e-2, 1e8)
    speed, duration = decades(draw, 1e-6, 1e2), draw.uniform(0.3, 50) / omega.max()
    v = speed * direction(draw)
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], 0.1 * speed / omega.max(), mass),
        effects=(laws.Tether(stiffness=tuple(mass * omega**2)),),
        duration=duration,
    )

    def error(result):
        exact = v / omega * np.sin(omega * duration)
        size = np.abs(v / omega).max()
        return float(np.linalg.norm(result.state["position"][0] - exact) / size)

    return scene, error


def lorentz(draw):
    rate, speed = decades(draw, 1e-2, 1e9), decades(draw, 1e-3, 1e3)
    mass, b = decades(draw, 1e-18, 1e-3), direction(draw)
    e = draw.uniform(-0.3, 0.3, 3) * speed
    v, duration = speed * direction(draw), draw.uniform(0.5, 60) / rate
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], 1e-6, mass, charge=[mass * rate]),
        effects=(
            laws.Lorentz(),
            sources.MagneticField(constant=tuple(b)),
            sources.ElectricField(constant=tuple(e)),
        ),
        duration=duration,
    )
    start = {"position": np.zeros((1, 3)), "velocity": v[None]}
    return scene, by_path(lambda t, r, u: rate * (e + np.cross(u, b)), start, duration)


def driven_charge(draw):
    """A charge in an oscillating field, which may be switched on later."""
    omega, specific = decades(draw, 1e-1, 1e6), decades(draw, 1e-3, 1e3)
    amplitude, phase = direction(draw), draw.uniform(0, 6, 3)
    periods = draw.uniform(0.3, 8)
    duration, begin = periods * 2 * np.pi / omega, 0.0
    if draw.uniform() < 0.5:
        begin = float(draw.uniform(0, 0.5) * duration)
    speed = specific / omega * draw.uniform(0.1, 3)
    v = speed * direction(draw)
    field = sources.ElectricField(
        amplitude=tuple(amplitude), omega=(omega,) * 3, phase=tuple(phase), begin=begin
    )
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [v], 1e-3 * speed / omega, 1e-9, charge=[1e-9 * specific]),
        effects=(laws.Lorentz(), field),
        duration=duration,
    )

    def at(t):
        """Position a time t after the field is switched on, for a charge then at rest."""
        a, b = omega * begin + phase, omega * (begin + t) + phase
        return specific * amplitude / omega**2 * (omega * t * np.cos(a) - np.sin(b) + np.sin(a))

    times = np.linspace(0, duration, 257)
    paths = np.array([v * t + (at(t - begin) if t > begin else 0) for t in times])
    size = np.linalg.norm(paths, axis=1).max()
    return scene, lambda result: float(np.linalg.norm(result.state["position"][0] - paths[-1]) / size)


def permanent_magnet(draw):
    """A magnet swings in a uniform field; its energy is conserved."""
    radius, rho = decades(draw, 1e-7, 1e-1), decades(draw, 1e3, 8e3)
    magnetisation, b = decades(draw, 1e3, 1e6), decades(draw, 1e-5, 5.0) * direction(draw)
    mass, volume = rho * 4 / 3 * np.pi * radius**3, 4 / 3 * np.pi * radius**3
    moment = magnetisation * volume * direction(draw)
    inertia = 0.4 * mass * radius**2
    rate = np.sqrt(magnetisation * volume * np.linalg.norm(b) / inertia)
    spin = draw.uniform(0, 2) * rate * direction(draw)
    scene = tisim.Scene(
        particles=given([(0, 0, 0)], [(0, 0, 0)], radius, mass, moment=[moment], spin=[spin]),
        effects=(laws.PermanentMoment(), sources.MagneticField(constant=tuple(b)), laws.Magnetophoresis()),
        duration=draw.uniform(1, 200) / rate,
    )

    def energy(state):
        return kinetic(state) - (state["moment"] @ b).sum()

    scale = np.linalg.norm(moment) * np.linalg.norm(b)
    return scene, lambda result: float(abs(energy(result.state) - energy(result.start)) / scale)


def damped_grains(draw):
    """Two damped grains collide head-on; the restitution must equal the restitution of the material."""
    radius, rho, mass, young = grains_of(draw)
    speed = decades(draw, 1e-4, 1e-2) * np.sqrt(young / rho)
    restitution = draw.uniform(0.3, 0.95)
    r, v = [[-1.1 * radius, 0, 0], [1.1 * radius, 0, 0]], [[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]]
    scene = tisim.Scene(
        particles=given(r, v, radius, mass),
        materials={"grain": tisim.Material(young=young, poisson=0.25, restitution=restitution, friction=0.5)},
        effects=(laws.Granular(damping=laws.RestitutionDamping(), tangential=laws.MindlinForce()),),
        duration=3 * radius / speed,
    )

    def error(result):
        u = result.state["velocity"][:, 0]
        return float(abs((u[1] - u[0]) / speed - restitution))

    return scene, error


def impact(draw):
    """Two hard spheres collide off centre, without friction or loss; their final positions are compared."""
    radius, speed = decades(draw, 1e-7, 1e2), decades(draw, 1e-6, 1e3)
    mass = decades(draw, 1e-15, 1e3) * draw.uniform(0.5, 1, 2)
    offset, gap = draw.uniform(0, 1.2) * radius, draw.uniform(1.5, 4)
    r = np.array([[-gap * radius, 0, 0], [gap * radius, offset, 0]])
    v = np.array([[0.5 * speed, 0, 0], [-0.5 * speed, 0, 0]])
    duration = 3 * gap * radius / speed
    scene = tisim.Scene(
        particles=given(r, v, radius, mass), effects=(laws.Impact(hardness=1e30),), duration=duration
    )
    d, u = r[1] - r[0], v[1] - v[0]
    b, c = d @ u, d @ d - 4 * radius**2
    meet = (-b - np.sqrt(b * b - u @ u * c)) / (u @ u)
    n = (d + meet * u) / (2 * radius)
    pulse = 2 / (1 / mass).sum() * (u @ n) * n
    after = v + np.array([pulse / mass[0], -pulse / mass[1]])
    exact = r + meet * v + (duration - meet) * after
    size = speed * duration
    return scene, lambda result: float(np.linalg.norm(result.state["position"] - exact, axis=1).max() / size)


def drawn(family, number):
    """Return random scenes of a family with the functions that return their errors, and the number of scenes
    that were refused."""
    scenes, refused = [], 0
    for k in range(number):
        draw = np.random.Generator(np.random.Philox(key=[k, zlib.crc32(family.__name__.encode())]))
        try:
            scenes.append(family(draw))
        except tisim.InputError:
            refused += 1
    return scenes, refused


BOUNDS = (
    Criterion(f"largest error of {SCENES_EACH} scenes over the motion or the energy", ACCURACY),
    Criterion("scenes refused", 0, 0),
)


def largest_error(family):
    """Return the largest error of random scenes of a family, and the number of refused ones."""
    scenes, refused = drawn(family, SCENES_EACH)
    results = sound(tisim.run([scene for scene, _ in scenes]))
    return max(error(result) for (_, error), result in zip(scenes, results, strict=True)), refused


@hard_case("Particles on springs of 0.01 to 1e8 rad/s, unequal along the axes, of 1e-15 to 1 kg.", *BOUNDS)
def random_springs():
    return largest_error(tether)


@hard_case("Charges in crossed fields that gyrate at 0.01 to 1e9 rad/s for up to ten periods.", *BOUNDS)
def random_gyrations():
    return largest_error(lorentz)


@hard_case("Charges in fields that oscillate at 0.1 to 1e6 rad/s, some switched on later.", *BOUNDS)
def random_driven_charges():
    return largest_error(driven_charge)


@hard_case("Magnets of 100 nm to 10 cm that swing in fields of 1e-5 to 5 T.", *BOUNDS)
def random_magnets():
    return largest_error(permanent_magnet)


@hard_case("Damped grains of 10 um to 10 cm, of rubber to diamond, that collide.", *BOUNDS)
def random_damped_grains():
    return largest_error(damped_grains)


@hard_case("Hard spheres of 100 nm to 100 m that collide off centre at 1e-6 to 1000 m/s.", *BOUNDS)
def random_impacts():
    return largest_error(impact)
