"""Results of a study that do not depend on the machine: orders, work, reference error and files."""

import csv
import io
import itertools
import json
import shlex

import h5py
import numpy as np
import pytest
from rich.console import Console

from tests.accuracy.scenes import DURATION, KNOWN, STEP, UNKNOWN, only, oscillator
from tests.steppers.charged import charged
from tisim import InputError, Result, RunError, Status
from tisim.accuracy import Quantity, Study, plot, run, storage, study, table, write
from tisim.accuracy.quantity import displacement
from tisim.accuracy.timing import SimulationCache, Timed
from tisim.backend import runtime
from tisim.cli import scene_arguments
from tisim.steppers import Boris, Collocation, ErrorControl, FixedStep, IterationControl, Trapezoid, Verlet

pytestmark = pytest.mark.long
STEPPERS = {
    "Verlet, FixedStep: dt": 2,
    "Trapezoid, ErrorControl: error, tolerance": 2,
    "Trapezoid, IterationControl: longest, tolerance": 2,
    "Trapezoid(phi=0.0), IterationControl: longest, tolerance": 1,
    "Trapezoid(phi=1.0), IterationControl: longest, tolerance": 1,
}
"""Methods that are tried for the oscillator, with the orders of their steppers."""


@pytest.fixture(scope="module")
def measured():
    """A study of the oscillator, whose displacement is compared with the closed form and a reference."""
    with pytest.MonkeyPatch.context() as patch:
        only(patch, Verlet, Trapezoid)
        cost_study = Study(oscillator(), (KNOWN, UNKNOWN), precisions=("f64",), repeats=2)
        run(cost_study)
    return cost_study


def order(rows):
    """Order of the error in the number of steps, by regression."""
    return -np.polyfit(np.log([r.steps for r in rows]), np.log([r.errors[0][0] for r in rows]), 1)[0]


def test_every_stepper_shows_its_order_along_its_line(measured):
    assert {row.method for row in measured.rows} == set(STEPPERS)
    for method, expected in STEPPERS.items():
        # From the second level on the error is small enough to be a power of the step.
        rows = measured.line(method)[1:]
        assert len(rows) == 3
        assert order(rows) == pytest.approx(expected, abs=0.12), method


@pytest.mark.parametrize("method", STEPPERS)
def test_errors_fall_and_work_rises_with_the_requested_accuracy(measured, method):
    rows = measured.line(method)
    assert not any(row.failed for row in rows)
    for coarse, fine in itertools.pairwise(rows):
        assert fine.errors[0][0] < coarse.errors[0][0] / 2
        assert fine.steps > 1.5 * coarse.steps
        assert fine.sums > 1.5 * coarse.sums


def test_work_is_counted_by_the_steppers(measured):
    """Verlet takes one force evaluation a step, the implicit stepper one for each iteration."""
    for row in measured.line("Verlet, FixedStep: dt"):
        dt = float(row.setting.removeprefix("dt="))
        assert row.steps == np.ceil(DURATION / dt - 1e-9)
        assert row.sums == row.steps
        assert row.rejections == 0
    for row in measured.line("Trapezoid, IterationControl: longest, tolerance"):
        assert row.sums >= row.steps
    assert measured.line("Verlet, FixedStep: dt")[-1].setting == f"dt={STEP}"


def test_rejections_are_counted_as_the_sums_of_the_stepper_are():
    """Counts of individual steps are divided by the number of particles, counts of common steps are not."""
    for stepper, expected in ((Trapezoid(), 3.0), (Collocation(), 6.0)):
        scene = oscillator().model_copy(update={"stepper": stepper})
        work = {"particle_steps": 20, "force_evaluations": 40, "rejections": 6}
        pair = Result(scene, {}, {"mass": np.ones(2)}, DURATION, work, Status(True, ""), 0.0)
        assert Timed([pair], 1.0).work == (10.0, expected * 40 / 6, expected)


def test_the_error_of_the_reference_is_within_its_estimate(measured):
    """Its error estimate bounds its distance to the closed form, and is small beside every trusted error."""
    exact, own = (truth.estimate.value for truth in measured.truths)
    off = np.linalg.norm(own - exact) / np.linalg.norm(exact)
    assert measured.truths[0].error == 0.0
    assert 0 < off <= measured.truths[1].error
    for row in measured.rows:
        (true, sure), (error, unsure) = row.errors
        assert sure == 0.0
        assert unsure == pytest.approx(measured.truths[1].error, rel=1e-3)
        assert abs(true - error) <= unsure
        assert row.trusted(1)
    assert measured.truths[1].error < 20 * off


def test_steppers_with_the_same_error_do_not_confirm_each_other(monkeypatch):
    """For a rotation, the trapezoidal rule with equal steps and Boris' stepper agree at any step size."""
    limits = {"first": 0.02, "longest": 0.02, "shortest": 1e-9, "tolerance": 1e-4}
    own = Trapezoid(control=IterationControl(**limits))
    circle = charged(own, 2.0, velocity=(1.0, 0.0, 0.0))
    only(monkeypatch, Boris)

    def exact(result):
        w, t = 3.0, result.time
        return np.array([[np.sin(w * t), np.cos(w * t) - 1.0, 0.0]]) / w

    known_quantity = type(KNOWN)("known", displacement, exact)
    cost_study = Study(circle, (known_quantity, UNKNOWN), precisions=("f64",), repeats=1, coarser=1)
    run(cost_study)
    off = np.linalg.norm(cost_study.truths[1].estimate.value - cost_study.truths[0].estimate.value)
    off /= np.linalg.norm(cost_study.truths[0].estimate.value)
    assert off <= cost_study.truths[1].error < 100 * off
    # One line varies both settings of the paper's control, and one line each of them alone.
    names = {row.method.partition(": ")[2] for row in cost_study.rows}
    assert names == {"longest, tolerance", "longest", "tolerance", "dt"}
    # A smaller tolerance alone does not reduce the discretisation error, which dt_lim bounds.
    bounded = [row.errors[0][0] for row in cost_study.line("Trapezoid, IterationControl: tolerance")]
    assert bounded[1] > bounded[0] / 2
    assert order(cost_study.line("Boris, FixedStep: dt")) == pytest.approx(2, abs=0.05)


def test_the_cheapest_setting_is_the_cheapest(measured):
    for quantity, name in enumerate(("known", "unknown")):
        for error in (1e-1, 1e-2, 1e-3, 1e-4):
            good = [row for row in measured.rows if sum(row.errors[quantity]) <= error]
            chosen = measured.cheapest(error, name)
            assert chosen in good
            # Within the noise of the timings.
            assert chosen.interval[0] <= min(row.interval[1] for row in good)
        with pytest.raises(RunError, match=f"error of {name} must be at least .*; received 1e-30"):
            measured.cheapest(1e-30, name)
    for error, (row, *_) in measured.decades().items():
        assert row == measured.cheapest(error)
    with pytest.raises(InputError, match="quantity must be one of known, unknown; received 'speed'"):
        measured.cheapest(1e-3, "speed")


def test_words_and_python_of_a_row_make_its_scene(measured):
    """Pasted into a command line or a scene, they give the measured stepper."""
    names = {kind.__name__: kind for kind in (Boris, Verlet, Trapezoid, FixedStep, ErrorControl)}
    names["IterationControl"] = IterationControl
    for row in measured.rows:
        stepper = eval(row.python, names)
        arguments = shlex.split(row.options)
        assert arguments[::2] == ["--set"] * (len(arguments) // 2)
        assert measured.scene.replace(scene_arguments.assignments(arguments[1::2])).stepper == stepper
        parameter_value = row.setting.split(", ")[0].split("=")
        assert getattr(stepper.control, parameter_value[0]) == pytest.approx(
            float(parameter_value[1]), rel=5e-3
        )


def test_files_are_read_back(measured, tmp_path, monkeypatch):
    write(measured, tmp_path)
    plot(measured).savefig(tmp_path / "cost.png")
    with (tmp_path / "cost.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["method"], row["setting"]) for row in rows] == [row.key for row in measured.rows]
    assert [float(row["seconds"]) for row in rows] == [row.median for row in measured.rows]
    assert [float(row["error of unknown"]) for row in rows] == [r.errors[1][0] for r in measured.rows]
    with h5py.File(tmp_path / "cost.h5") as file:
        assert "numpy" in json.loads(file.attrs["versions"])
        assert json.loads(file.attrs["settings"])["device"] == "cpu"
        assert file.attrs["scene"] == measured.scene.to_toml()
        assert file["truths/unknown"].attrs["uncertainty"] == measured.truths[1].estimate.uncertainty
    again = Study(measured.scene, (KNOWN, UNKNOWN), precisions=("f64",))
    storage.resume(again, tmp_path)
    assert again.rows == measured.rows
    assert again.complete
    monkeypatch.setattr("tisim.version.__version__", "0.0.1")
    with pytest.raises(InputError, match="of another scene, version"):
        storage.resume(again, tmp_path)
    monkeypatch.undo()
    run(again, progress=lambda fraction, what: pytest.fail("nothing is left to measure"))
    other = Study(oscillator(dt=0.02), (KNOWN, UNKNOWN))
    with pytest.raises(InputError, match="output folder must be without the study of another scene"):
        storage.resume(other, tmp_path)
    assert (tmp_path / "cost.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def verlet_only(monkeypatch):
    """Only Verlet is tried, which takes one compilation."""
    only(monkeypatch)


def test_a_failed_setting_is_a_row_with_its_reason(verlet_only, monkeypatch):
    run = SimulationCache.run

    def brittle(self, scenes, *more):
        if scenes[0].stepper.control.dt > 0.02:
            raise RunError("a quantity is not finite")
        return run(self, scenes, *more)

    monkeypatch.setattr(SimulationCache, "run", brittle)
    cost_study = study(oscillator(), (KNOWN,), precisions=("f64",))
    assert [row.failed for row in cost_study.rows] == ["a quantity is not finite", "", "", ""]
    assert [len(row.seconds) for row in cost_study.rows] == [0, 3, 3, 3]
    assert cost_study.complete
    assert cost_study.cheapest(1.0) in cost_study.rows[1:]
    assert "not finite" in printed_table(cost_study)


def test_an_interrupted_study_keeps_its_measurements(verlet_only, monkeypatch):
    plain, runs = SimulationCache.run, []

    def stopped(self, scenes, *more):
        runs.append(scenes[0].stepper.control.dt)
        if runs.count(0.01) == 2:
            raise KeyboardInterrupt
        return plain(self, scenes, *more)

    monkeypatch.setattr(SimulationCache, "run", stopped)
    cost_study = Study(oscillator(), (KNOWN,), precisions=("f64",))
    with pytest.raises(KeyboardInterrupt):
        run(cost_study)
    assert [(row.setting, len(row.seconds)) for row in cost_study.rows] == [("dt=0.0316", 3), ("dt=0.01", 1)]
    assert not cost_study.complete


def printed_table(cost_study):
    console = Console(width=120, file=io.StringIO())
    console.print(table(cost_study))
    return console.file.getvalue()


def test_settings_over_the_budget_are_left_out(verlet_only):
    cost_study = study(oscillator(), (KNOWN,), precisions=("f64",), budget=1e-6)
    assert cost_study.rows == []
    assert not cost_study.complete
    with pytest.raises(RunError, match=r"the reference takes about \S+ s of running, more than the"):
        study(oscillator(), (UNKNOWN,), precisions=("f64",), budget=1e-6)


def test_nothing_to_compare_is_reported(verlet_only):
    still = Quantity("place across", lambda result: displacement(result)[:, 1])
    with pytest.raises(InputError, match=r"place across must be other than zero at the end; received 0.0"):
        study(oscillator(), (still,), precisions=("f64",), coarser=0)


def test_single_precision_and_fast_arithmetic_are_lines_of_their_own_and_the_runtime_as_before(verlet_only):
    before = runtime.current()
    numbers = {"precisions": ("f64", "f32"), "arithmetics": ("strict", "fast")}
    cost_study = study(oscillator(), (KNOWN,), **numbers, repeats=1, finer=2)
    assert runtime.current() == before
    single, double = cost_study.line("Verlet, FixedStep: dt, f32"), cost_study.line("Verlet, FixedStep: dt")
    assert [row.precision for row in single] == ["f32"] * 6
    # Before 1e-8 the rounding error of f32 dominates, and f64 has none of that size.
    assert single[0].errors[0][0] == pytest.approx(double[0].errors[0][0], rel=1e-3)
    assert single[-1].errors[0][0] > 10 * double[-1].errors[0][0]
    assert single[-1].options.endswith("--precision f32")
    fast = cost_study.line("Verlet, FixedStep: dt, fast")
    assert [row.arithmetic for row in fast] == ["fast"] * 6
    assert [row.errors[0][0] for row in fast] == pytest.approx([row.errors[0][0] for row in double], rel=1e-3)
    assert fast[-1].options.endswith("--arithmetic fast")
