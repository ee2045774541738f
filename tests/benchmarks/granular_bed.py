"""Time of a step of a settled bed of grains within five walls, beside LAMMPS or other settings of tisim.

    python tests/benchmarks/granular_bed.py [--numbers 8000 32000] [--threads 1] [--steps 100] [--repeats 9]
        [--beside hertz/history granular] [--laws "jkr, twisting"] [--cpu] [--beds FOLDER]

Spheres of diameter 1 and density 1 fall into a box 20 wide under tilted gravity, and come to rest (once for
each number; about a minute for 8000; ``--beds`` keeps the beds for the next time). Then all programs continue
from there in turns, lists and walls included; ratios are medians of the ratios of each turn, with the
smallest and the largest. TISIM_BACKEND names the kernel compiler. tisim with its defaults is compared with:

- hertz/history, granular: LAMMPS's gran/hertz/history, which has two roots fewer per contact because of its
  simpler damping, and its granular style with the same law (python -m pip install ".[bench]");
- skin=0.1: lists with this skin, in diameters;
- schedule=world, team or particle: see tisim/program/program.py;
- order=random: grains in random order, which the package sorts; order=unsorted: it does not;
- lanes=1: the number of pairs computed at once.

``--laws`` continues the bed under other laws that LAMMPS's granular style also has (LAWS of
granular_lammps.py; ``all`` for each of them), and compares with LAMMPS.
"""

import argparse
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tests.benchmarks import granular_lammps, lammps_peer
from tests.benchmarks.turns import rest
from tisim.backend import runtime
from tisim.effects import Granular, Gravity, MindlinForce, RestitutionDamping, Walls
from tisim.geometry import Plane
from tisim.pairs import listed_pairs
from tisim.population import spatial_sort
from tisim.steppers import FixedStep, Verlet

WIDTH, STEP, YOUNG, POISSON, RESTITUTION, FRICTION = 20.0, 1e-4, 1e6, 0.3, 0.5, 0.5
LAW = Granular(damping=RestitutionDamping(), tangential=MindlinForce())
MATERIALS = {
    "grain": tisim.Material(young=YOUNG, poisson=POISSON, restitution=RESTITUTION, friction=FRICTION)
}
OF_BED = {
    **{"young": YOUNG, "poisson": POISSON, "restitution": RESTITUTION, "friction": FRICTION, "damping": 50.0},
    **{"stiffness": 2e4, "surface_energy": 0.1},
    **{"rolling_stiffness": 2e3, "rolling_damping": 1.0, "rolling_friction": 0.1},
    **{"twisting_stiffness": 200.0, "twisting_damping": 0.5, "twisting_friction": 0.1},
}
"""Material values for the laws: as stiff as the bed, which therefore stays at rest."""
LAWS = {
    name: replace(law, materials=({key: OF_BED[key] for key in law.materials[0]},))
    for name, law in granular_lammps.LAWS.items()
}
GRAVITY = (0.4383711, 0.0, -0.8987940)
MASS = np.pi / 6
STYLES = ("hertz/history", "granular")
"""Styles of LAMMPS."""
SETTINGS = ("skin", "schedule", "order", "lanes")
Steps = Callable[[int], None]


def scene(
    position: np.ndarray, velocity: np.ndarray, width: float, skin: float | None = None, law: str = ""
) -> tisim.Scene:
    """Grains in a box without a lid; ``law`` of LAWS, or else the law of the bed."""
    materials, contacts = MATERIALS, LAW
    if law:
        materials = {"grain": tisim.Material(**LAWS[law].materials[0])}
        contacts = granular_lammps.composed(LAWS[law])
    walls = (((0, 0, 0), (1, 0, 0)), ((width, 0, 0), (-1, 0, 0)), ((0, 0, 0), (0, 1, 0)))
    walls += (((0, width, 0), (0, -1, 0)), ((0, 0, 0), (0, 0, 1)))
    return tisim.Scene(
        particles=tisim.Particles(position=position, velocity=velocity, radius=0.5, mass=MASS),
        materials=materials,
        effects=(
            contacts,
            Walls(planes=tuple(Plane(point=point, normal=normal) for point, normal in walls)),
            Gravity(acceleration=GRAVITY),
        ),
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=1e3,
        seed=1,
        skin=skin,
    )


def lattice(n: int, width: float) -> np.ndarray:
    """Positions about 1.2 apart, row by row."""
    across = int(width / 1.2)
    grid = np.stack(np.meshgrid(*[np.arange(k) for k in (-(-n // across**2), across, across)], indexing="ij"))
    noise = np.random.default_rng(0).uniform(-0.09, 0.09, (n, 3))
    return 0.6 + 1.2 * grid.reshape(3, -1).T[:n, ::-1] + noise


def settled(n: int, width: float) -> np.ndarray:
    """Positions of grains that have come to rest; neighbours are near each other in memory."""
    position, velocity = lattice(n, width), np.zeros((n, 3))
    simulation = tisim.Simulation(scene(position, velocity, width))
    simulation.load(scene(position, velocity, width))
    speed = 1.0
    while speed > 2e-2:
        simulation.run(steps=5000)
        speed = float(np.sqrt((simulation.state["velocity"] ** 2).sum(axis=1).mean()))
        print(f"  settling: {speed:.3f} at {simulation.s.read('time')[0]:.1f}", file=sys.stderr)
    position = simulation.state["position"]
    simulation.close()
    return position[np.lexsort(np.floor(position[:, ::-1] / 4).T)]


def kept(n: int, width: float, folder: Path) -> np.ndarray:
    """The settled bed of a folder; made and saved there if it is absent."""
    file = folder / f"bed_{n}.npy"
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        np.save(file, settled(n, width))
    return np.load(file)


def by_tisim(position: np.ndarray, width: float, setting: str = "", law: str = "") -> Steps:
    """tisim with its defaults, or with a setting, such as ``skin=0.1``, or under another law."""
    name, _, value = setting.partition("=")
    if name == "order":
        position = np.random.default_rng(0).permutation(position)
    bed = scene(position, np.zeros_like(position), width, float(value) if name == "skin" else None, law)
    sorted_from, lanes = spatial_sort.SORTED_FROM, listed_pairs.LANES
    if value == "unsorted":
        spatial_sort.SORTED_FROM = len(position) + 1
    if name == "lanes":
        listed_pairs.LANES = int(value)
    simulation = tisim.Simulation(bed, schedule=value if name == "schedule" else None)
    simulation.load(bed)
    print(f"  {len(position)} {setting}: schedule {simulation.schedule}", file=sys.stderr)
    spatial_sort.SORTED_FROM, listed_pairs.LANES = sorted_from, lanes
    return lambda steps: simulation.run(steps=steps)


def by_lammps(position: np.ndarray, width: float, style: str, threads: int, of: str = "") -> Steps:
    """LAMMPS with a style, under the law ``of`` LAWS or else the law of the bed."""
    peer = lammps_peer.begin(threads)
    height, gravity = position[:, 2].max() + 5, np.array(GRAVITY) / np.linalg.norm(GRAVITY)
    with tempfile.NamedTemporaryFile("w", suffix=".data") as file:
        file.write(f"bed\n\n{len(position)} atoms\n1 atom types\n\n")
        file.write(f"0 {width} xlo xhi\n0 {width} ylo yhi\n-1 {height} zlo zhi\n\nAtoms\n\n")
        for k, place in enumerate(position):
            file.write(f"{k + 1} 1 1.0 1.0 {' '.join(format(float(r), '.16g') for r in place)}\n")
        file.flush()
        peer.commands_string(f"""units lj
atom_style sphere
boundary f f f
newton off
comm_modify vel yes
read_data {file.name}
""")
    simple = f"gran/hertz/history {2 / 3 * YOUNG / (1 - POISSON**2)} NULL 500.0 NULL {FRICTION} 1"
    law = {"hertz/history": simple, "granular": "granular"}[style]
    terms = (
        f"hertz/material {YOUNG} {RESTITUTION} {POISSON} tangential mindlin_rescale/force NULL 1.0 "
        f"{FRICTION} damping coeff_restitution"
    )
    terms = granular_lammps.lammps_model(LAWS[of]) if of else terms
    pair = "* *" + (f" {terms}" if style == "granular" else "")
    wall = law.removeprefix("gran/") if style != "granular" else f"granular {terms}"
    planes = {"x": f"0 {width}", "y": f"0 {width}", "z": "0 NULL"}
    peer.commands_string(
        f"pair_style {law}\npair_coeff {pair}\nneighbor 0.1 bin\nneigh_modify every 1 delay 0\n"
        f"fix g all gravity 1.0 vector {' '.join(map(str, gravity))}\nfix n all nve/sphere\ntimestep {STEP}\n"
        + "".join(f"fix w{axis} all wall/gran {wall} {axis}plane {at}\n" for axis, at in planes.items())
        + "run 1\n"
    )
    return lambda steps: peer.command(f"run {steps} pre no post no")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--numbers", type=int, nargs="+", default=[8000, 32000])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--beside", nargs="*", default=list(STYLES), metavar="WHAT", help="see above")
    parser.add_argument("--laws", nargs="+", default=[], metavar="LAW", choices=[*LAWS, "all"])
    parser.add_argument("--cpu", action="store_true", help="CPU time of all threads, not wall time")
    parser.add_argument("--beds", type=Path, metavar="FOLDER", help="settled beds are kept here")
    options = parser.parse_args()
    for what in options.beside:
        if what not in STYLES and what.partition("=")[0] not in SETTINGS:
            parser.error(f"--beside must be one of {', '.join(STYLES)} or of the settings; received {what}")
    clock = time.process_time if options.cpu else time.perf_counter
    tisim.init(threads=options.threads)
    print(f"{runtime.backend()}, {options.threads} threads, {platform.processor() or platform.machine()}")
    for n in options.numbers:
        width = WIDTH * (n / 8000) ** 0.5
        position = kept(n, width, options.beds) if options.beds else settled(n, width)
        for law in LAWS if "all" in options.laws else options.laws or [""]:
            runs = {"tisim": by_tisim(position, width, law=law)}
            for what in ["granular"] if law else options.beside:
                if what in STYLES:
                    runs[f"LAMMPS {what}"] = by_lammps(position, width, what, options.threads, law)
                else:
                    runs[what] = by_tisim(position, width, what)
            print(f"{n} {law}" if law else n)
            compare(runs, n, options.steps, options.repeats, clock)


def compare(runs: dict[str, Steps], n: int, steps: int, repeats: int, clock: Callable[[], float]) -> None:
    """Take turns, and print the time of a step of each run."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(repeats):
        for name, take in runs.items():
            rest()
            take(steps // 10)
            began = clock()
            take(steps)
            times[name].append((clock() - began) / steps / n)
    for name, seconds in times.items():
        ratio = np.array(seconds) / np.array(times["tisim"])
        print(
            f"  {name:22s} {1e9 * np.median(seconds):7.1f} ns a particle and step; over tisim "
            f"{np.median(ratio):5.2f} ({ratio.min():.2f} .. {ratio.max():.2f})"
        )


if __name__ == "__main__":
    main()
