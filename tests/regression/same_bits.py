"""Checks that two versions of the code give the same bits, by fingerprints of a trajectory of each case.

python tests/regression/same_bits.py --write FILE [--check]     with one version python
tests/regression/same_bits.py --compare FILE [--check]   with the other: exit code 1 on a difference

A fingerprint is a SHA-256 hash of every frame (names, shapes and bytes of all its arrays), of the final state
and of the work counters. With --check, every number computed by ``tisim check`` is compared too (an hour).
Bits depend on the machine, not on the backend: TISIM_BACKEND may differ in the second command. The fitness
record has its own tool, fitness_record.py.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

FRAMES = 5
RUNS = (
    ("agglomeration", "small", 1.0),
    ("blast", "small", 1.0),
    ("blast", "contact", 0.02),
    ("blast", "clumps", 0.02),
    ("capture", "default", 0.05),
    ("cascade", "default", 0.2),
    ("concentration", "flow", 0.05),
    ("vibration", "alone", 0.2),
    ("vibration", "default", 0.05),
)
"""Cases and sizes, and the part of their duration that is run."""


def fingerprint(name: str, size: str, part: float) -> str:
    """SHA-256 (hexadecimal) of the output of one case with seed number 1."""
    import tisim
    from tisim.cases.case import every
    from tisim.io.reader import frames

    scene = every()[name].scene(size, 1)
    scene = scene.model_copy(update={"duration": part * scene.duration})
    digest = hashlib.sha256()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trajectory.h5"
        result = tisim.run(scene, record=tisim.Recording(path, frames=FRAMES))
        with frames(path) as sequence:
            for frame in sequence:
                _add(digest, {"time": np.asarray(frame.time), **frame.arrays})
    _add(digest, result.state)
    digest.update(json.dumps([result.time, result.work, result.measures], sort_keys=True).encode())
    return digest.hexdigest()


def _add(digest: Any, arrays: dict[str, np.ndarray]) -> None:
    """Add names, shapes and bytes of arrays to a hash."""
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.shape} {values.dtype}".encode())
        digest.update(values.tobytes())


def checked(name: str) -> dict[str, str]:
    """All numbers from the checks of a case, by name, bit by bit."""
    from tisim.cases.case import every

    return {item.name: repr(item) for item in every()[name].check()}


def measure(check: bool) -> dict[str, Any]:
    """Fingerprints of all runs, and the numbers of all checks if requested."""
    fingerprints: dict[str, Any] = {}
    for name, size, part in RUNS:
        fingerprints[f"{name}, {size}"] = fingerprint(name, size, part)
        print(f"{name}, {size}: {fingerprints[f'{name}, {size}'][:16]}", flush=True)
    for name in dict.fromkeys(name for name, _, _ in RUNS if check):
        fingerprints[f"check {name}"] = checked(name)
        print(f"check {name}: {len(fingerprints[f'check {name}'])} numbers", flush=True)
    return fingerprints


def main() -> int:
    """Write the fingerprints, or compare them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--write", type=Path, metavar="FILE")
    action.add_argument("--compare", type=Path, metavar="FILE")
    parser.add_argument("--check", action="store_true", help="also the numbers of tisim check")
    options = parser.parse_args()
    fingerprints = measure(options.check)
    if options.write:
        options.write.write_text(json.dumps(fingerprints, indent=1) + "\n")
        return 0
    before = json.loads(options.compare.read_text())
    different = [name for name in fingerprints if fingerprints[name] != before.get(name)]
    for name in different:
        print(f"{name}: different bits")
    if not different:
        print(f"all {len(fingerprints)} have the same bits")
    return 1 if different else 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    sys.exit(main())
