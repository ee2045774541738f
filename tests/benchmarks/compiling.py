"""Seconds to the first result of a scene, in processes one after another that share compiled kernels on disk.

    python tests/benchmarks/compiling.py

cold : with nothing on the disk. warm : with what the cold one has left there: without LLVM, but with the
front end of Taichi, which reads every kernel in each process. kept : the second run in one process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = """
import json, time
import tisim
from tests.scenes import flow, head_on
from tisim.backend import runtime
runtime.init(threads=2)
scene = {scene}
seconds = []
for _ in range(2):
    began = time.perf_counter()
    assert tisim.run(scene).status.ok
    seconds.append(time.perf_counter() - began)
print(json.dumps(seconds))
"""
SCENES = {"two grains": "head_on(1.0, ())", "60 that collide, merge and break": "flow(grains=60)"}


def seconds(scene: str, folder: str) -> list[float]:
    """Of the first run and the second, in a process of its own."""
    place = {f"{prefix}_OFFLINE_CACHE_FILE_PATH": folder for prefix in ("TI", "QD")}
    completed = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(scene=scene)],
        env={**os.environ, **place}, cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return [float(value) for value in json.loads(completed.stdout.splitlines()[-1])]


def main() -> None:
    print(f"{'':36s}{'cold':>8s}{'warm':>8s}{'kept':>8s}")
    for name, scene in SCENES.items():
        with tempfile.TemporaryDirectory() as folder:
            (cold, _), (warm, second) = seconds(scene, folder), seconds(scene, folder)
        print(f"{name:36s}{cold:8.2f}{warm:8.2f}{second:8.3f}")


if __name__ == "__main__":
    main()
