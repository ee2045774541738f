"""One runtime for the whole suite: cpu, f64 and strict arithmetic, unless TISIM_DEVICE, TISIM_TEST_PRECISION
or TISIM_TEST_ARITHMETIC is set."""

import gc
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests import scenes
from tests.browser import browser  # noqa: F401
from tisim.backend import choice, memory, runtime
from tisim.backend.taichi import BACKEND
from tisim.errors import InputError
from tisim.files import pictures, python_file

ON_DEVICES = (
    *("numerics/test_elementary.py", "numerics/test_philox.py", "pairs/test_half_list.py"),
    *("effects/contact/test_hertz_mindlin.py", "effects/contact/test_granular_impacts.py"),
    *("effects/contact/test_walls.py", "effects/contact/test_contact.py", "effects/pair/test_near_field.py"),
    *("effects/pair/test_mie.py", "effects/external/test_drag.py", "effects/impact/test_impact.py"),
    *("effects/magnetic/test_dipole_dipole.py", "effects/magnetic/test_cutoff.py"),
    *("effects/magnetic/test_ewald.py", "effects/magnetic/test_sweeps.py"),
    *("steppers/test_verlet.py", "steppers/test_conservation.py", "pairs/test_beyond_contact.py"),
    *("effects/test_contract.py", "operators/test_contract.py", "steppers/test_contract.py"),
    *("operators/test_passage.py", "operators/test_peak_displacement.py", "test_testing.py"),
    *("population/test_vacated_slots.py", "effects/gravitation/test_cell_tree.py"),
    *("effects/gravitation/test_tree_gravity.py", "effects/pair/test_virial.py"),
    *("effects/magnetic/test_moment.py", "effects/magnetic/test_froehlich.py"),
    *("effects/magnetic/test_permanent_moment.py", "effects/constraint/test_prescribed_motion.py"),
    *("steppers/implicit/test_one_particle.py", "steppers/implicit/test_trapezoid.py"),
    *("steppers/implicit/test_collocation.py", "steppers/brownian/test_brownian.py"),
    "packing/test_random_sequential.py",
)
"""Tests that must pass on every device: the contracts, and the physics of each kind of law.
docs/measurements/devices.md lists the devices on which they passed. Insertions and clumps, whose steps take
longest to compile, are left out."""

RENDERED = (
    "optimize/report/",
    "optimize/test_several.py",
    "cli/test_optimize_command.py",
    "cli/test_inspect_commands.py",
)
"""Tests of the command line and the search that read the images."""


def pytest_collection_modifyitems(items):
    """Mark tests that must also pass on devices; TISIM_DEVICE names the device."""
    folder = Path(__file__).parent
    for item in items:
        if item.path.relative_to(folder).as_posix() in ON_DEVICES:
            item.add_marker(pytest.mark.gpu)


def pytest_configure(config):
    """Set signals and environment variables for the suite.

    A shell starts background jobs with Ctrl-C ignored, and nohup starts them with SIGHUP ignored; tisim keeps
    ignored signals ignored.

    With Taichi, tests take two thirds of the time, nearly all of which is compilation, without the compiler's
    passes ahead of LLVM. No bit depends on these passes: the process of ``elsewhere`` uses them. Quadrants
    1.3.3 and 1.4.0 are not faster without these passes, and compile wrongly: the oscillator of
    CONTRIBUTING.md does not move.

    The processes of xdist, one for each core, inherit the environment of this one. Otherwise the linear
    algebra of NumPy and SciPy would start one thread per core in each of them, which wait for each other.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        # Programs started by tests have the default handler again; the tests themselves continue.
        signal.signal(signal.SIGHUP, lambda *_: None)
    os.environ.setdefault("TI_ADVANCED_OPTIMIZATION", "0")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collectstart():
    """Collect tests without searches for garbage, which took a third of the time of the collection."""
    gc.disable()


def pytest_collection_finish():
    """Search for garbage again, except among the tests and modules."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session", autouse=True)
def the_runtime():
    """The settings under which every test in this process runs."""
    try:
        return runtime.init(
            device=os.environ.get("TISIM_DEVICE", "cpu"),
            precision=os.environ.get("TISIM_TEST_PRECISION", "f64"),
            arithmetic=os.environ.get("TISIM_TEST_ARITHMETIC", "strict"),
        )
    except InputError as absent:
        pytest.skip(str(absent))


@pytest.fixture(scope="module", autouse=True)
def memory_for_the_next_module():
    """Restart Taichi after a module in which it has grown: the kernels of all slow tests do not fit in one
    process, and compilation becomes slower and slower."""
    yield
    if memory.needs_restart():
        scenes.close_compiled()
        memory.reclaim()
        memory.renew()


@pytest.fixture(scope="module", autouse=True)
def unrendered(request):
    """Draw figures without rendering them in tests of commands and searches, because rendering takes a
    quarter of a second for each of the four images of a search. The files in RENDERED test the images, and
    render them."""
    file = request.path.relative_to(Path(__file__).parent).as_posix()
    if not file.startswith(("cli/", "optimize/")) or file.startswith(RENDERED):
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pictures, "image", lambda figure, kind="png", dpi=0.0: f"a picture, {kind}".encode())
        yield


@pytest.fixture
def rng():
    """A generator that gives a test the same numbers in every run."""
    return np.random.Generator(np.random.Philox(20040101))


@pytest.fixture
def own_file(tmp_path, monkeypatch):
    """Write a file into a fresh folder, which is the working folder; loaded files are unloaded at the end."""
    monkeypatch.chdir(tmp_path)

    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path.relative_to(tmp_path)

    yield write
    for file in python_file.loaded_files():
        python_file.unload(file.name)


ELSEWHERE = """
import json, sys
import numpy as np
from tests import scenes
from tests.effects.test_contract import kicked
from tests.engine.test_schedules import BATCH, crowd, pick
from tisim.backend import runtime

kept = {}

def keep(name, result):
    assert result.status.ok, result.status.reason
    kept.update({f"{name}/{key}": values for key, values in result.state.items()})
    kept.update({f"{name}/start/{key}": values for key, values in result.start.items()})
    kept[f"{name}/work"] = np.array([result.work[key] for key in sorted(result.work)])

runtime.init(**json.loads(sys.argv[2]))
results = scenes.simulate(crowd(), worlds=BATCH, capacity=200, schedule="world")
for w, result in enumerate(pick(results)):
    keep(w, result)
kept["left"] = np.array([len(result.state["mass"]) for result in results])
keep("kicked", scenes.simulate([kicked()], worlds=1, capacity=32)[0])
np.savez(sys.argv[1], **kept)
"""


def crowd_elsewhere(folder, backend=BACKEND, **settings):
    """Results of test_schedules.crowd in another process, with all passes of the compiler, a backend and
    settings of the runtime."""
    file = folder / "results.npz"
    command = [
        sys.executable,
        "-W",
        "error::RuntimeWarning",
        "-c",
        ELSEWHERE,
        str(file),
        json.dumps(settings),
    ]
    environment = os.environ | {"TI_ADVANCED_OPTIMIZATION": "1", choice.VARIABLE: backend}
    completed = subprocess.run(
        command, capture_output=True, text=True, timeout=3600, check=False, env=environment
    )
    assert completed.returncode == 0, completed.stderr
    with np.load(file) as arrays:
        return dict(arrays)


@pytest.fixture(scope="session")
def elsewhere(tmp_path_factory):
    """Results of test_schedules.crowd in another process, with one thread and the other backend."""
    other = next((name for name in choice.installed() if name != BACKEND), BACKEND)
    return crowd_elsewhere(tmp_path_factory.mktemp("elsewhere"), other, threads=1)


@pytest.fixture(scope="session")
def in_single_precision(tmp_path_factory):
    """Results of test_schedules.crowd in another process, in single precision."""
    return crowd_elsewhere(tmp_path_factory.mktemp("single"), precision="f32", threads=2)


def elsewhere_with(setting):
    """Return a function that calls MODULE.NAME of the tests in a process with a runtime setting, and returns
    its result."""

    def call(module, name):
        code = (
            f"import json; from tisim.backend import runtime; runtime.init({setting}); "
            f"from tests.{module} import {name}; print(json.dumps({name}()))"
        )
        command = [sys.executable, "-W", "error::RuntimeWarning", "-c", code]
        root = Path(__file__).parents[1]
        completed = subprocess.run(command, capture_output=True, text=True, check=True, cwd=root)
        return json.loads(completed.stdout.splitlines()[-1])

    return call


@pytest.fixture(scope="module")
def single():
    """A function that calls MODULE.NAME of the tests in a process of single precision, and returns its
    result."""
    return elsewhere_with("precision='f32'")


@pytest.fixture(scope="module")
def in_one_thread():
    """A function that calls MODULE.NAME of the tests in a process of one thread, and returns its result."""
    return elsewhere_with("threads=1")


@pytest.fixture(scope="module")
def in_fast_arithmetic():
    """A function that calls MODULE.NAME of the tests in a process of fast arithmetic, and returns
    its result."""
    return elsewhere_with("arithmetic='fast'")
