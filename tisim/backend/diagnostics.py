"""What this machine is to tisim: backend, processor, memory, versions, and what the other backend would give.

Tables say whether the backend's LLVM has heard of this processor; the measured rates say what that costs.
"""

import importlib.metadata
import importlib.util
import os
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tisim.backend import runtime
from tisim.backend.taichi import BACKEND, ti
from tisim.backend.thread import in_taichi_thread

DEPENDENCIES = ("tisim", "taichi", "quadrants", "numpy", "h5py", "deap", "pydantic", "matplotlib")
BENCHMARK_PARTICLES = 2000
"""The measured rate is of the forces between so many particles."""
BENCHMARK_SECONDS = 0.5
"""The rate is measured for so long, wall seconds."""

# The first LLVM that knows an x86 processor newer than 2021, by (vendor, family, lowest and highest model).
# LLVM, llvm/lib/TargetParser/Host.cpp and release notes of 12 to 19.
FIRST_LLVM = {
    ("AuthenticAMD", 25, 0x10, 0x1F): ("znver4", 16),
    ("AuthenticAMD", 25, 0x60, 0x7F): ("znver4", 16),
    ("AuthenticAMD", 25, 0xA0, 0xAF): ("znver4", 16),
    ("AuthenticAMD", 26, 0x00, 0xFF): ("znver5", 19),
    ("GenuineIntel", 6, 143, 143): ("sapphirerapids", 12),
    ("GenuineIntel", 6, 207, 207): ("emeraldrapids", 16),
    ("GenuineIntel", 6, 173, 174): ("graniterapids", 16),
    ("GenuineIntel", 6, 170, 172): ("meteorlake", 16),
    ("GenuineIntel", 6, 197, 198): ("arrowlake", 17),
}


@dataclass(frozen=True)
class Finding:
    """A finding is a line of the report. note : what to make of it, or empty."""

    name: str
    value: str
    note: str = ""


@in_taichi_thread
@ti.kernel
def _pairs(
    x: ti.types.ndarray(),  # type: ignore[valid-type]
    y: ti.types.ndarray(),  # type: ignore[valid-type]
    z: ti.types.ndarray(),  # type: ignore[valid-type]
    f: ti.types.ndarray(),  # type: ignore[valid-type]
    n: ti.i32,
):
    ti.loop_config(serialize=True)
    for i in range(n):
        total = 0.0
        for j in range(n):
            dx, dy, dz = x[j] - x[i], y[j] - y[i], z[j] - z[i]
            d2 = dx * dx + dy * dy + dz * dz + 1e-4
            total += dx / (d2 * ti.sqrt(d2))
        f[i] = total


def pair_rate() -> float:
    """Return the pairs per second of a 1/r^2 force between all pairs: f64, one core, the running backend."""
    runtime.init("cpu", "f64", 1)
    x, y, z = np.random.Generator(np.random.Philox(1)).random((3, BENCHMARK_PARTICLES))
    f = np.zeros(BENCHMARK_PARTICLES)
    _pairs(x, y, z, f, BENCHMARK_PARTICLES)
    end, fastest = time.perf_counter() + BENCHMARK_SECONDS, float("inf")
    while (began := time.perf_counter()) < end:
        _pairs(x, y, z, f, BENCHMARK_PARTICLES)
        # The fastest, as the rest of the machine can only slow it down.
        fastest = min(fastest, time.perf_counter() - began)
    return BENCHMARK_PARTICLES**2 / fastest


def rate_of(backend: str) -> float | None:
    """Return the pairs per second of any backend, measured in a process of its own; None where it is not
    installed or fails."""
    if importlib.util.find_spec(backend) is None:
        return None
    command = [sys.executable, "-c", "from tisim.backend.diagnostics import pair_rate; print(pair_rate())"]
    benchmark = subprocess.run(
        command, env={**os.environ, "TISIM_BACKEND": backend}, capture_output=True, text=True, check=False
    )
    return (
        float(benchmark.stdout.split()[-1])
        if benchmark.returncode == 0 and benchmark.stdout.strip()
        else None
    )


def llvm_version() -> str:
    """Return the version of the LLVM inside the backend, or "unknown"."""
    version = getattr(ti._lib.core, "get_llvm_target_support", None)
    return str(version()) if version else "unknown"


def processor() -> dict[str, str]:
    """Return the first processor of /proc/cpuinfo; its name only where there is none."""
    info = Path("/proc/cpuinfo")
    if not info.is_file():
        return {"model name": platform.processor() or platform.machine()}
    first = info.read_text().split("\n\n")[0]
    pairs = (line.split(":", 1) for line in first.splitlines() if ":" in line)
    return {key.strip(): value.strip() for key, value in pairs}


def processor_support(cpu: dict[str, str], llvm: str) -> str:
    """Return whether an LLVM knows a processor, as a sentence."""
    try:
        vendor, family, model = cpu["vendor_id"], int(cpu["cpu family"]), int(cpu["model"])
        major = int(llvm.split(".")[0])
    except (KeyError, ValueError):
        return "not in the table; see the measured rates"
    for (maker, generation, low, high), (name, first) in FIRST_LLVM.items():
        if (vendor, family) == (maker, generation) and low <= model <= high:
            if major >= first:
                return f"known to LLVM {llvm} as {name}"
            return f"{name} is known from LLVM {first} on, not to {llvm}: see the measured rates"
    return "not among those that came after 2021; taken as known"


def findings() -> list[Finding]:
    """Return the report. This takes some seconds, and starts nothing in this process but looks at CUDA
    and Vulkan."""
    cpu, llvm = processor(), llvm_version()
    report = [
        Finding("backend", runtime.backend(), f"LLVM {llvm}"),
        Finding("processor", cpu.get("model name", "unknown"), processor_support(cpu, llvm)),
        Finding("cores", str(runtime.cores()), f"{os.cpu_count()} in the machine"),
        Finding("memory", _memory()),
        Finding("cuda", "present" if _cuda() else "absent", "" if _cuda() else "no --device cuda"),
        Finding("vulkan", "present" if _vulkan() else "absent", "" if _vulkan() else "no --device vulkan"),
    ]
    rates = {name: rate_of(name) for name in ("taichi", "quadrants")}
    for name, rate in rates.items():
        text = f"{rate:.2g} pairs/s" if rate else "not installed"
        report.append(Finding(f"{name}, one core, f64", text, "in use" if name == BACKEND else ""))
    report.append(_advice(rates))
    report += [Finding("python", f"{platform.python_version()}, {platform.system()} {platform.machine()}")]
    for package in DEPENDENCIES:
        try:
            report.append(Finding(package, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            report.append(Finding(package, "not installed"))
    return report


def _advice(rates: dict[str, float | None]) -> Finding:
    other = "quadrants" if BACKEND == "taichi" else "taichi"
    mine, theirs = rates[BACKEND], rates[other]
    if not mine or not theirs:
        return Finding("other backend", "not compared", "python -m pip install 'tisim[quadrants]' to compare")
    ratio = theirs / mine
    advice = f"faster here: set TISIM_BACKEND={other}" if ratio > 1.1 else "no gain here from changing"
    return Finding("other backend", f"{ratio:.2f} times as fast", advice)


def _cuda() -> bool:
    """Return whether a CUDA driver is there that a kernel could run on."""
    return any(Path(device).exists() for device in ("/dev/nvidia0", "/dev/dxg")) and ti._lib.core.with_cuda()


def _vulkan() -> bool:
    """Return whether a Vulkan driver is there; whether its loops end where they should, a start tells."""
    return bool(ti._lib.core.with_vulkan())


def _memory() -> str:
    there = runtime.memory()
    return f"{there / 2**30:.1f} GiB" if there < sys.maxsize else "unknown"
