"""Stored values of fitness functions: what they are made of, and the tool that makes them anew on purpose.

python tests/regression/fitness_record.py          compare this machine's values with the stored ones
python tests/regression/fitness_record.py --write  store this machine's values (after a change of physics)
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np

FILE = Path(__file__).with_name("fitness.json")
STARTS = 64
GRAINS = 80
ROUNDING = 1e-5
"""What f32 may shift every fitness by the same way, no start having gone elsewhere."""

BASE = {
    "relative_velocity": 184.7, "length_ratio": 0.79, "density": 6652.7, "hardness": 2.655e5,
    "heat_capacity": 1796.0, "friction": 0.013, "temperature": 502.0, "activation_energy": 352.0,
    "reaction": 1.7765e6, "surface_energy": 1e16,
}  # fmt: skip
DESIGNS: dict[str, dict[str, float]] = {
    "published": BASE,
    "soft": {**BASE, "hardness": 1e5},
    "hard and slow": {**BASE, "hardness": 1e6, "relative_velocity": 40.0},
    "dilute": {**BASE, "length_ratio": 0.45},
    "cold and reactive": {**BASE, "temperature": 100.0, "activation_energy": 1e3, "reaction": 1e7},
    "fragile": {**BASE, "surface_energy": 1e3},
}


def fingerprint() -> str:
    """What may change the last bits of exp and pow, and so of a chaotic trajectory, on the same settings."""
    return " ".join((platform.system(), platform.machine(), *platform.libc_ver()))


def measure() -> dict[str, list[float]]:
    """Fitness of every design from every start, with the settings of the runtime. Shape (designs, starts)."""
    import tisim
    from cases.agglomeration.problem import cost
    from cases.agglomeration.scene import scene

    scenes = [scene(d, seed, grains=GRAINS) for d in DESIGNS.values() for seed in range(STARTS)]
    values = [cost(result) for result in tisim.run(scenes)]
    return {name: values[k * STARTS : (k + 1) * STARTS] for k, name in enumerate(DESIGNS)}


def stored() -> dict[str, Any]:
    """The record: settings, fingerprint and values."""
    record: dict[str, Any] = json.loads(FILE.read_text())
    return record


def deviations(values: dict[str, list[float]], record: dict[str, Any]) -> dict[str, float]:
    """Mean over starts of the difference now less then, in its standard errors, design by design.

    Rounding that differs sends single starts elsewhere, as collisions are chaotic; the mean stays. Start by
    start, as most starts are the same in both, so that few differ and the error is small.
    """
    found = {}
    for name, now in values.items():
        change = np.subtract(now, record["values"][name])
        error = np.hypot(np.std(change, ddof=1) / np.sqrt(len(change)), ROUNDING)
        found[name] = float(abs(np.mean(change)) / error)
    return found


def main() -> int:
    """Compare, or store."""
    from tisim.backend import runtime
    from tisim.scene.scene import PHYSICS_VERSION

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--write", action="store_true", help="store this machine's values")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--json", action="store_true", help="print the values and nothing else")
    options = parser.parse_args()
    runtime.init(options.device, options.precision, options.threads)
    values = measure()
    if options.json:
        print(json.dumps(values))
        return 0
    if options.write:
        record = {
            "settings": runtime.current().settings, "fingerprint": fingerprint(),
            "physics": PHYSICS_VERSION, "values": values,
        }  # fmt: skip
        FILE.write_text(json.dumps(record, indent=1) + "\n")
        print(f"stored {FILE.name}")
        return 0
    record = stored()
    for name, deviation in deviations(values, record).items():
        same = (
            "same bits"
            if values[name] == record["values"][name]
            else f"{deviation:.2f} standard errors apart"
        )
        print(
            f"{name:20s} {np.mean(values[name]):.6f} (stored {np.mean(record['values'][name]):.6f}): {same}"
        )
    return 0


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))
    sys.exit(main())
