"""Grains under Hertz and Mindlin beside LAMMPS, pair_style granular: a table of the differences.

    python -m pip install ".[bench]"
    python tests/benchmarks/granular_lammps.py

512 grains of two sizes that overlap, move and spin, without walls and in a cell. The law is
``hertz/material`` with ``mindlin_rescale/force`` and ``coeff_restitution``; the tangential damping is the
normal one times xgammat = sqrt(S_t / S_n) = sqrt(2 (1 - nu) / (2 - nu)). LAMMPS of July 2025 differs in three
ways:

- LAMMPS turns tangential springs with the normal alone ("projected"). In tisim they also turn about the
  normal, and are stretched by the relative surface motion at mid-step.
- LAMMPS computes the surface velocity from the spin at R from the centre, but the torque with a lever arm of
  R - delta / 2 (at walls, R). So the power of its force differs from its energy loss. In tisim both are at
  R - delta / 2.
- LAMMPS drops the tangential force in the first step of a contact, if the damping alone exceeds Coulomb's
  limit. In tisim the force is then the limit.

All three are options of the NumPy reference. With them it agrees with LAMMPS to rounding, and without them
with the package. If none of them matters, the package agrees with LAMMPS to rounding.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.effects.contact.granular_reference import Grains, ReferenceLaw  # noqa: E402

if TYPE_CHECKING:
    from tisim import Scene
    from tisim.effects import Granular

SIDE, STEP = 8, 5e-4
"""Grains along an edge, which is also the edge's length in m; s."""
SOFT = {"young": 1e5, "poisson": 0.3, "restitution": 0.6, "friction": 0.3, "damping": 300.0}
LAW = ReferenceLaw((SOFT,))
"""Hertz and Mindlin."""
TSUJI = 0.5
"""Coefficient of restitution given to ``damping tsuji``."""


def as_tsuji(restitution: float) -> float:
    """Return the coefficient of restitution that gives the damping of ``damping tsuji`` in LAMMPS.

    Both dampings are alpha sqrt(4/3 E* a m*). Tsuji, Tanaka and Ishida (Powder Technol. 71 (1992) 239) fit
    alpha by a polynomial, for m in place of m*, which of two equal grains of mass m is m / 2; alpha is
    -sqrt(5) ln e / sqrt(ln^2 e + pi^2) (D. Antypov and J. A. Elliott, EPL 94 (2011) 50004).
    """
    alpha = np.polynomial.Polynomial([1.2728, -4.2783, 11.087, -22.348, 27.467, -18.022, 4.8218])
    share = alpha(restitution) / np.sqrt(5)
    return float(np.exp(-np.pi * share / np.sqrt(1 - share**2)))


ROLLS = {"rolling_stiffness": 4e3, "rolling_damping": 20.0, "rolling_friction": 0.2}
TWISTS = {"twisting_stiffness": 400.0, "twisting_damping": 5.0, "twisting_friction": 0.1}
LAWS = {
    "hertz, mindlin": LAW,
    "hooke, linear, rolling, twisting": ReferenceLaw(
        ({**SOFT, **ROLLS, **TWISTS, "stiffness": 1e4},),
        normal="hooke",
        tangential="linear_spring",
        rolling="rolling_sds",
        twisting="twisting_sds",
    ),
    "hertz, tsuji, mindlin": ReferenceLaw(
        ({**SOFT, "restitution": as_tsuji(TSUJI)},), options={"tsuji": TSUJI}
    ),
    "hertz, constant damping, mindlin's displacement": ReferenceLaw(
        (SOFT,), damping="constant_damping", tangential="mindlin_displacement"
    ),
    "hertz, no history": ReferenceLaw((SOFT,), tangential="viscous_friction"),
    "dmt, rolling": ReferenceLaw(
        ({**SOFT, **ROLLS, "surface_energy": 50.0},),
        damping="constant_damping",
        rolling="rolling_sds",
        cohesion="dmt",
    ),
    "jkr, twisting": ReferenceLaw(
        ({**SOFT, **TWISTS, "surface_energy": 50.0},),
        normal="jkr",
        damping="constant_damping",
        tangential="mindlin_displacement",
        twisting="twisting_sds",
    ),
}
"""The laws that both programs have, of one material."""
FIELDS = {"force": "f", "torque": "torque", "position": "x", "velocity": "v", "spin": "omega"}
"""The compared quantities, and their names in LAMMPS."""


def start(spinning: float = 3.0) -> dict[str, np.ndarray]:
    """Displaced grains on a lattice that is too narrow; ``spinning`` in rad/s."""
    draw = np.random.Generator(np.random.Philox(7))
    n = SIDE**3
    lattice = np.stack(np.meshgrid(*3 * [np.arange(SIDE)], indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    radius = draw.choice([0.48, 0.54], n)
    return {
        "position": lattice + draw.uniform(-0.03, 0.03, (n, 3)),
        "velocity": draw.normal(size=(n, 3)),
        "spin": spinning * draw.normal(size=(n, 3)),
        "radius": radius,
        "mass": 4000 * radius**3,
    }


def planes(walls: bool) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
    """Point and normal of each wall of the cell."""
    low = [((0.0, 0.0, 0.0), tuple(axis)) for axis in np.eye(3)]
    high = [((float(SIDE),) * 3, tuple(-axis)) for axis in np.eye(3)]
    return low + high if walls else []


def by_numpy(at: dict[str, np.ndarray], law: ReferenceLaw, walls: bool, steps: int) -> dict[str, np.ndarray]:
    """The state of the NumPy reference after some steps."""
    grains = Grains(law, *at.values(), planes=planes(walls))
    grains.run(steps, STEP)
    return dict(zip(FIELDS, (grains.force, grains.torque, grains.x, grains.v, grains.w), strict=True))


def end_of(scene: Scene, steps: int, schedule: str | None = None) -> dict[str, np.ndarray]:
    """The state of the package after some steps of a scene, in the order of ids."""
    from tisim import Simulation

    simulation = Simulation(scene, schedule=schedule)
    simulation.load(scene)
    simulation.run(steps=steps)
    order = np.argsort(simulation.s.read("id")[0])
    end = {name: simulation.s.read(name)[0][order] for name in FIELDS}
    simulation.close()
    return end


def composed(law: ReferenceLaw) -> Granular:
    """The law of the package."""
    from tisim.components import serialization
    from tisim.effects import Granular
    from tisim.scene import plugins

    parts = ("normal", "damping", "tangential", "rolling", "twisting", "cohesion")
    plugins.load_parts()
    given = {part: getattr(law, part) for part in parts if getattr(law, part)}
    return serialization.from_dict(Granular, {"kind": "granular", **given}, "law")


def by_package(
    at: dict[str, np.ndarray], law: ReferenceLaw, walls: bool, steps: int
) -> dict[str, np.ndarray]:
    """The state of the package."""
    from tisim import Material, Particles, Scene
    from tisim.effects import Walls
    from tisim.geometry import Plane
    from tisim.steppers import FixedStep, Verlet

    bounds = tuple(Plane(point=point, normal=normal) for point, normal in planes(walls))
    quantities = {"spin": at["spin"]}
    scene = Scene(
        particles=Particles(
            **{name: value for name, value in at.items() if name != "spin"}, quantities=quantities
        ),
        materials={"grain": Material(**law.materials[0])},
        effects=(composed(law), *((Walls(planes=bounds),) if walls else ())),
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=1.0,
    )
    return end_of(scene, steps, "particle")


def lammps_model(law: ReferenceLaw) -> str:
    """The text of a law for pair_style granular."""
    of = law.materials[0]
    damping = {"restitution_damping": "coeff_restitution", "constant_damping": "velocity"}[str(law.damping)]
    loss = of["restitution"] if damping == "coeff_restitution" else of["damping"]
    if "tsuji" in law.options:
        damping, loss = "tsuji", law.options["tsuji"]
    elastic = f"{of.get('young', 0):.17g} {loss:.17g} {of.get('poisson', 0):.17g}"
    normal = {
        "hooke": f"hooke {of.get('stiffness', 0):.17g} {loss:.17g}",
        "hertz_material": f"hertz/material {elastic}",
        "jkr": f"jkr {elastic} {of.get('surface_energy', 0):.17g}",
    }[law.normal]
    if law.cohesion == "dmt":
        normal = f"dmt {elastic} {of['surface_energy']:.17g}"
    nu, mu = of["poisson"], of.get("friction", 0.0)
    aside, shear = np.sqrt(2 * (1 - nu) / (2 - nu)), 2 / 7 * of.get("stiffness", 0)
    tangential = {
        "mindlin_force": f"mindlin_rescale/force NULL {aside:.17g} {mu:.17g}",
        "mindlin_displacement": f"mindlin NULL {aside:.17g} {mu:.17g}",
        "linear_spring": f"linear_history {shear:.17g} {np.sqrt(2 / 7):.17g} {mu:.17g}",
        "viscous_friction": f"linear_nohistory 1.0 {mu:.17g}",
        None: "linear_nohistory 0.0 0.0",
    }[law.tangential]
    text = f"{normal} tangential {tangential} damping {damping}"
    for what in ("rolling", "twisting"):
        part = getattr(law, what)
        if part and part.endswith("sds"):
            constants = (of[f"{what}_{name}"] for name in ("stiffness", "damping", "friction"))
            text += f" {what} sds " + " ".join(f"{value:.17g}" for value in constants)
        elif part:
            text += f" {what} marshall"
    return text


def by_lammps(at: dict[str, np.ndarray], law: ReferenceLaw, walls: bool, steps: int) -> dict[str, np.ndarray]:
    """The state of LAMMPS, from a separate process."""
    return lammps_peer.apart(__file__, law=lammps_model(law), walls=walls, steps=steps, **at)


def worker(folder: Path) -> None:
    """Run LAMMPS on in.npz of a folder, and write out.npz."""
    with np.load(folder / "in.npz") as given:
        at = dict(given)
    model = str(at["law"])
    n, m = len(at["radius"]), at["mass"]
    rows = np.column_stack([2 * at["radius"], m / (4 / 3 * np.pi * at["radius"] ** 3), at["position"]])
    moving = np.column_stack([at["velocity"], at["spin"]])
    lammps_peer.write_data(folder / "data", 3 * [(-2, SIDE + 2)], rows, moving)
    walls = [
        f"fix {axis} all wall/gran granular {model} {axis}plane 0 {SIDE}" for axis in "xyz" if at["walls"]
    ]
    machine = lammps_peer.begin()
    machine.commands_list(
        [
            "units si", "atom_style sphere", "boundary f f f", "atom_modify map array", "newton off",
            "comm_modify vel yes", f"read_data {folder / 'data'}", "pair_style granular",
            f"pair_coeff * * {model}", "neighbor 0.2 bin", "neigh_modify every 1 delay 0",
            f"timestep {STEP}", *walls, "fix move all nve/sphere", f"run {int(at['steps'])}",
        ]
    )  # fmt: skip
    found = {name: np.array(machine.gather_atoms(theirs, 1, 3)) for name, theirs in FIELDS.items()}
    np.savez(folder / "out.npz", **{name: values.reshape(n, 3) for name, values in found.items()})
    machine.close()


def apart(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> dict[str, float]:
    """The largest difference of each quantity, over its largest value."""
    return {name: float(np.abs(a[name] - b[name]).max() / (np.abs(b[name]).max() or 1.0)) for name in FIELDS}


def main() -> None:
    """Print the table."""
    theirs = replace(LAW, levers="radius")
    print(f"| | steps | {' | '.join(FIELDS)} |\n|---{'|---' * (1 + len(FIELDS))}|")
    for walls in (False, True):
        for steps in (1, 100):
            there = by_lammps(start(), LAW, walls, steps)
            here, reference = by_package(start(), LAW, walls, steps), by_numpy(start(), LAW, walls, steps)
            as_theirs = by_numpy(start(), theirs, walls, steps)
            for name, a, b in (
                ("package - LAMMPS", here, there),
                ("package - NumPy", here, reference),
                ("NumPy with LAMMPS's points - LAMMPS", as_theirs, there),
            ):
                row = " | ".join(f"{value:.1e}" for value in apart(a, b).values())
                print(f"| {name}{', walls' if walls else ''} | {steps} | {row} |")


if __name__ == "__main__":
    lammps_peer.start(main, worker)
