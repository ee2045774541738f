"""Magnetic dipoles in a periodic box: Ewald sums, cut-offs and nearest images; errors and wave vectors.

    python tests/benchmarks/ewald_dipoles.py [--number 500] [--precision f64]

Iron grains of one size in a field of 0.3 T along z, with mutually induced moments (Froehlich, Kennelly). They
lie at random, at a volume fraction of 0.3, by random sequential addition; or in touching chains along z at
random lateral positions, at a volume fraction of 0.1. The sample is a ball, with demagnetising factors of
1/3, as implied by a spherical cut-off. Errors of moments and of forces are root mean squares over the
particles, relative to the root mean square in an Ewald sum with an accuracy of 1e-6. ``asked`` is the
requested accuracy: the error of forces in units of F_ref (tisim/effects/magnetic/ewald_accuracy.py), relative
to the same root mean square.
"""

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.backend import runtime
from tisim.effects import (
    CARBONYL_IRON,
    DipoleDipole,
    EwaldDipoleDipole,
    EwaldFroehlichMoment,
    Magnetophoresis,
    MutualFroehlichMoment,
    TruncatedDipoleDipole,
    ewald_settings,
)
from tisim.effects.magnetic.ewald_accuracy import force_scale
from tisim.sources import MagneticField
from tisim.steppers import FixedStep, Verlet

RADIUS = 3.35e-6
"""m."""
FIELD = 0.3
"""T."""
ACCURACIES = (1e-6, 1e-3, 1e-2)
"""The first one is the reference."""
CUTOFFS = (4.0, 2 + 8e-6 / RADIUS, 6.0, 8.0)
"""Radii; the second is L21's, a gap of 8 um (section 2.4.3)."""
TRIES = 100_000


def side_for(number: int, fraction: float) -> float:
    """The side (m) of the box that holds ``number`` grains at a volume fraction."""
    return float(RADIUS * (number * 4 / 3 * np.pi / fraction) ** (1 / 3))


def added(draw: np.random.Generator, number: int, side: float, least: float, axes: int) -> np.ndarray:
    """Random positions along the first ``axes``, added one after the other; none is nearer to another one, or
    to its images, than ``least`` (m)."""
    place = np.zeros((0, axes))
    for _ in range(TRIES):
        if len(place) == number:
            return place
        new = draw.uniform(0, side, axes)
        d = place - new
        if not ((d - side * np.round(d / side)) ** 2).sum(axis=1).min(initial=np.inf) < least**2:
            place = np.concatenate([place, new[None]])
    raise SystemExit(f"{number} grains find no room")


def at_random(draw: np.random.Generator, number: int) -> tuple[np.ndarray, float]:
    """Positions, and the side of the box; m."""
    side = side_for(number, 0.3)
    return added(draw, number, side, 2 * RADIUS, 3), side


def chains(draw: np.random.Generator, number: int) -> tuple[np.ndarray, float]:
    """Positions, and the side of the box; m. Each chain closes on its own image."""
    side = side_for(number, 0.1)
    length = int(side / (2 * RADIUS))
    feet = added(draw, number // length, side, 2 * RADIUS, 2)
    up = side / length * (np.arange(length) + draw.uniform(0, 1, (len(feet), 1)))
    across = np.repeat(feet[:, None], length, axis=1)
    return np.concatenate([across, up[..., None]], axis=2).reshape(-1, 3), side


def scene(place: np.ndarray, side: float, moment, force) -> tisim.Scene:
    """Iron grains in the field, with a law for moments and one for forces."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=place % side, velocity=0 * place, radius=RADIUS, density=CARBONYL_IRON.density
        ),
        effects=(MagneticField(constant=(0.0, 0.0, FIELD)), moment, Magnetophoresis(), force),
        domain=tisim.Box(low=(0, 0, 0), high=(side,) * 3),
        stepper=Verlet(control=FixedStep(dt=1e-12)),
        duration=1e-12,
    )


def methods(place: np.ndarray, side: float) -> dict[str, tisim.Scene]:
    """Scenes by the method that sums the dipoles."""
    iron, box = CARBONYL_IRON.parameters(), tisim.Box(low=(0, 0, 0), high=(side,) * 3)
    settings = {a: ewald_settings(box, len(place), a) for a in ACCURACIES}
    # Worlds of a batch have the same capacity for wave vectors.
    most = {"waves": settings[ACCURACIES[0]]["waves"]}
    scenes = {}
    for accuracy, own in settings.items():
        ball = {**own, **most, "demagnetising_factors": (1 / 3,) * 3}
        laws = EwaldFroehlichMoment(**iron, **ball), EwaldDipoleDipole(**ball)
        count = "x".join(str(n) for n in own["waves"])
        name = f"Ewald sum, accuracy {accuracy:.0e}: {own['cutoff'] / RADIUS:.1f} radii, {count} waves"
        scenes[name] = scene(place, side, *laws)
    for shifted in (False, True):
        for cutoff in CUTOFFS:
            cut = {"cutoff": cutoff, "shifted": shifted}
            name = f"cut-off of {cutoff:.3g} radii, {'shifted' if shifted else 'plain'}"
            scenes[name] = scene(
                place, side, MutualFroehlichMoment(**iron, **cut), TruncatedDipoleDipole(**cut)
            )
    scenes["nearest images of all"] = scene(place, side, MutualFroehlichMoment(**iron), DipoleDipole())
    poleless = {**settings[1e-3], **most}
    name = "Ewald sum, accuracy 1e-03, no poles"
    scenes[name] = scene(place, side, EwaldFroehlichMoment(**iron, **poleless), EwaldDipoleDipole(**poleless))
    return scenes


def size(values: np.ndarray) -> float:
    """Root mean square of vectors."""
    return math.sqrt(float((values**2).sum()) / len(values))


def main() -> None:
    """Print errors of moments and forces, by every method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--number", type=int, default=500)
    parser.add_argument("--precision", default="f64")
    options = parser.parse_args()
    runtime.init(precision=options.precision)
    draw = np.random.default_rng(1)
    for title, start in {"at random": at_random, "chains": chains}.items():
        place, side = start(draw, options.number)
        scenes = methods(place, side)
        print(f"\n{title}: {len(place)} grains in {side / RADIUS:.1f} radii\n")
        print("| dipoles by | error of moments | error of forces | asked |")
        print("|---|---|---|---|", flush=True)
        states = [result.state for result in tisim.run(list(scenes.values()))]
        orders = [np.argsort(state["id"]) for state in states]
        values = [
            {name: state[name][order] for name in ("moment", "force")}
            for state, order in zip(states, orders, strict=True)
        ]
        exact = values[0]
        for (name, one), found in zip(scenes.items(), values, strict=True):
            errors = [size(found[key] - exact[key]) / size(exact[key]) for key in ("moment", "force")]
            law, asked = one.effects[-1], ""
            if isinstance(law, EwaldDipoleDipole):
                scale = force_scale(exact["moment"], side**3, law.cutoff) / size(exact["force"])
                asked = f"{law.accuracy * scale:.1e}"
            print(f"| {name} | {errors[0]:.1e} | {errors[1]:.1e} | {asked} |")


if __name__ == "__main__":
    main()
