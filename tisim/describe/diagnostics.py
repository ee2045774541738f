"""A report of this machine: backend, processor, memory, versions, and the speed of the other backend.

A table says whether the LLVM of a backend supports this processor; timed steps of two scenes show the
consequence.
"""

import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tisim.backend import choice, runtime
from tisim.backend.processor import processor, support
from tisim.backend.taichi import BACKEND, ti
from tisim.effects import Granular, MindlinForce, NearField, RestitutionDamping
from tisim.engine.simulation import Simulation
from tisim.materials.materials import Material
from tisim.scene.initial_state import Particles
from tisim.scene.scene import Scene
from tisim.steppers import FixedStep, Verlet

DEPENDENCIES = ("tisim", "taichi", "quadrants", "numpy", "h5py", "deap", "pydantic", "matplotlib")
TIMED_SIDE = 10
"""Number of particles along each side of the cube in the timed scenes."""
BENCHMARK_SECONDS = 0.5
"""Wall time for which the steps of each scene are timed, s."""
WORTH_A_CHANGE = 1.1
"""A backend is reported as faster if the ratio of times exceeds this."""


@dataclass(frozen=True)
class Finding:
    """A line of the report. note : advice, or empty."""

    name: str
    value: str
    note: str = ""


def charges() -> Scene:
    """Return a scene of charges on a disturbed lattice in which every pair interacts."""
    return _lattice(NearField(alpha2=1.0, strength="charge"), radius=1e-3)


def grains() -> Scene:
    """Return a scene of grains on a lattice in which each touches its neighbours."""
    return _lattice(Granular(damping=RestitutionDamping(), tangential=MindlinForce()), radius=0.51)


TIMED_SCENES: dict[str, Callable[[], Scene]] = {"charges": charges, "grains in contact": grains}


def _lattice(law: object, radius: float) -> Scene:
    """Return a scene of particles 1 m apart, with steps so short that nothing moves."""
    draw = np.random.Generator(np.random.Philox(1))
    places = np.stack(np.meshgrid(*[np.arange(float(TIMED_SIDE))] * 3, indexing="ij"), -1).reshape(-1, 3)
    position = places + draw.uniform(-0.005, 0.005, places.shape)
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=radius,
            mass=1.0,
            quantities={"charge": draw.normal(size=len(position))},
        ),
        materials={"grain": Material(young=1e6, poisson=0.3, restitution=0.5, friction=0.5)},
        effects=(law,),
        stepper=Verlet(control=FixedStep(dt=1e-12)),
        duration=1.0,
    )


def step_times() -> dict[str, float]:
    """Return the time of a step of each of ``TIMED_SCENES``, s: f64, one core, the running backend."""
    runtime.init("cpu", "f64", 1)
    return {name: _step_time(make()) for name, make in TIMED_SCENES.items()}


def _step_time(scene: Scene) -> float:
    simulation = Simulation(scene)
    simulation.load(scene)
    # The first steps compile kernels and build lists.
    simulation.program.advance(2)
    steps, fastest = 1, float("inf")
    end = time.perf_counter() + BENCHMARK_SECONDS
    while (began := time.perf_counter()) < end:
        simulation.program.advance(steps)
        # The minimum is used, because other load on the machine can only slow a step.
        fastest = min(fastest, (time.perf_counter() - began) / steps)
        steps = max(1, int(BENCHMARK_SECONDS / 20 / fastest))
    simulation.close()
    return fastest


def step_times_of(backend: str) -> dict[str, float]:
    """Return the times of steps (s) with any backend, measured in a separate process; empty if it is not
    installed or fails."""
    if backend not in choice.installed():
        return {}
    code = "import json; from tisim.describe.diagnostics import step_times; print(json.dumps(step_times()))"
    benchmark = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, choice.VARIABLE: backend}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    lines = benchmark.stdout.splitlines()
    return json.loads(lines[-1]) if benchmark.returncode == 0 and lines else {}


def llvm_version() -> str:
    """Return the version of the LLVM in the backend, or "unknown"."""
    version = getattr(ti._lib.core, "get_llvm_target_support", None)
    return str(version()) if version else "unknown"


def findings() -> list[Finding]:
    """Return the report. It takes some seconds; in this process it only tests for CUDA and Vulkan."""
    cpu = processor()
    knows = support(choice.LLVM[BACKEND], cpu)
    report = [
        Finding("backend", runtime.backend(), f"LLVM {llvm_version()}; {_why()}"),
        Finding("processor", cpu.get("model name", "unknown"), knows),
        Finding("cores", str(runtime.cores()), f"{os.cpu_count()} in the machine"),
        Finding("memory", _memory()),
        Finding("cuda", "present" if _cuda() else "absent", "" if _cuda() else "no --device cuda"),
        Finding("vulkan", "present" if _vulkan() else "absent", "" if _vulkan() else "no --device vulkan"),
    ]
    times = {name: step_times_of(name) for name in choice.LLVM}
    report.append(Finding("steps timed", " and ".join(f"{TIMED_SIDE**3} {scene}" for scene in TIMED_SCENES)))
    for name, measured in times.items():
        text = " and ".join(f"{1e3 * seconds:.3g} ms" for seconds in measured.values()) or _missing(name)
        report.append(Finding(f"{name}, one core, f64", text, "in use" if name == BACKEND else ""))
    report.append(_advice(times))
    report += [Finding("python", f"{platform.python_version()}, {platform.system()} {platform.machine()}")]
    for package in DEPENDENCIES:
        try:
            report.append(Finding(package, importlib.metadata.version(package)))
        except importlib.metadata.PackageNotFoundError:
            report.append(Finding(package, "not installed"))
    return report


def _why() -> str:
    """Return the reason for the choice of this backend."""
    return f"named by {choice.VARIABLE}" if choice.named() else "chosen for this processor"


def _missing(name: str) -> str:
    return "could not be measured" if name in choice.installed() else "not installed"


def _advice(times: dict[str, dict[str, float]]) -> Finding:
    """Return the gain from the other backend: from its times, or from the table if it is not installed."""
    other = next(name for name in choice.LLVM if name != BACKEND)
    mine, theirs = times[BACKEND], times[other]
    if not mine or not theirs:
        lost = choice.lost(choice.installed(), processor())
        return Finding("other backend", "not compared", lost or f"{choice.INSTALL[other]} to compare")
    ratios = [mine[scene] / theirs[scene] for scene in mine]
    faster = np.prod(ratios) ** (1 / len(ratios)) > WORTH_A_CHANGE
    text = " and ".join(f"{ratio:.2f}" for ratio in ratios)
    advice = "no gain here from changing"
    if faster:
        unset = choice.named() and choice.automatic(choice.installed(), processor()) == other
        how = f"leave {choice.VARIABLE} out" if unset else f"set {choice.VARIABLE}={other}"
        advice = f"faster here: {how}"
    return Finding("other backend", f"{text} times as fast", advice)


def _cuda() -> bool:
    """Return whether there is a CUDA driver that could run a kernel."""
    return any(Path(device).exists() for device in ("/dev/nvidia0", "/dev/dxg")) and ti._lib.core.with_cuda()


def _vulkan() -> bool:
    """Return whether there is a Vulkan driver. Whether its loops work correctly is tested when it is
    started."""
    return bool(ti._lib.core.with_vulkan())


def _memory() -> str:
    there = runtime.memory()
    return f"{there / 2**30:.1f} GiB" if there < sys.maxsize else "unknown"
