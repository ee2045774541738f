"""Seconds to the first result of a scene, in processes one after another that share compiled kernels on disk.

    python tests/benchmarks/compiling.py [--repeats 3]

The first rows time whole processes, which import tisim or run the script of README.md. The other rows time
scenes in processes that have already imported tisim. Values are medians of repeats, with the smallest and the
largest.

cold : with an empty disk cache. warm : with the cache that the cold process has left: without LLVM, but with
the front end of Taichi, which reads every kernel in each process. kept : the second run in one process.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
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


IMPORT = "import tisim"


def python(code: str, folder: str) -> str:
    """The output of this code in a separate process, with the kernel cache in a folder."""
    place = {f"{prefix}_OFFLINE_CACHE_FILE_PATH": folder for prefix in ("TI", "QD")}
    completed = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **place}, cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return completed.stdout


def whole(code: str, folder: str) -> float:
    """Seconds of a process."""
    began = time.perf_counter()
    python(code, folder)
    return time.perf_counter() - began


def readme() -> str:
    """The script of README.md."""
    (script,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    return script


def spread(values: list[float]) -> str:
    """Median, smallest and largest."""
    return f"{statistics.median(values):7.2f} ({min(values):.2f} .. {max(values):.2f})"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    rows: dict[str, list[tuple[float, ...]]] = {}
    for _ in range(repeats):
        for name, code in (("python", "pass"), (IMPORT, IMPORT), ("README's script", readme())):
            with tempfile.TemporaryDirectory() as folder:
                rows.setdefault(name, []).append((whole(code, folder), whole(code, folder)))
        for name, scene in SCENES.items():
            with tempfile.TemporaryDirectory() as folder:
                (cold, _), (warm, kept) = (
                    json.loads(python(SCRIPT.format(scene=scene), folder).splitlines()[-1]) for _ in range(2)
                )
            rows.setdefault(name, []).append((cold, warm, kept))
    print(f"{'':36s}{'cold, s':>24s}{'warm, s':>24s}{'kept, s':>24s}")
    for name, values in rows.items():
        print(f"{name:36s}" + "".join(f"{spread(list(each)):>24s}" for each in zip(*values, strict=True)))


if __name__ == "__main__":
    main()
