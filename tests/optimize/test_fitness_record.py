"""Records of fitness values: equal to the last bit, equal in the mean, or changed."""

from dataclasses import replace

import numpy as np
import pytest

import tisim
from tisim import InputError, RunError, optimize
from tisim.backend.taichi import ti
from tisim.effects import Force, Gravity
from tisim.optimize import FitnessRecord, Gene, Genome, Objective, Problem
from tisim.steppers import FixedStep, Verlet


def fall(design, seed, strength=1.0):
    """A few particles that fall from random heights."""
    height = np.random.default_rng(seed).uniform(0.0, 1.0, 5)
    return tisim.Scene(
        particles=tisim.Particles(
            position=np.column_stack([np.arange(5.0), np.zeros(5), height]),
            velocity=np.full((5, 3), design["speed"]),
            radius=0.1,
            mass=1.0,
        ),
        effects=(Gravity(acceleration=(0.0, 0.0, -9.81 * strength)),),
        stepper=Verlet(control=FixedStep(dt=0.01)),
        duration=0.1,
    )


def problem(scene=fall):
    objectives = (
        Objective("height", lambda result: result.state["position"][:, 2].mean(), "m", maximise=True),
        Objective("spread", lambda result: result.state["position"][:, 2].std(), "m"),
    )
    return Problem("fall", Genome((Gene("speed", "m/s", 0.0, 9.0),)), scene, objectives)


class Blowing(Force):
    """A force that is NaN."""

    @ti.func
    def force(self, s, w, i, t):
        return ti.math.nan * s.velocity[w, i]


DESIGNS = {"slow": {"speed": 1.0}, "fast": {"speed": 8.0}}


@pytest.fixture(scope="module")
def record():
    return FitnessRecord.measure(problem(), DESIGNS, starts=6)


def test_a_record_contains_the_values_of_each_start(record):
    assert record.starts == 6
    for name, design in DESIGNS.items():
        results = tisim.run([fall(design, seed) for seed in range(6)])
        heights = [result.state["position"][:, 2].mean() for result in results]
        assert record.values[name]["height"] == heights


def test_a_record_file_keeps_all_bits(record, tmp_path):
    record.save(tmp_path / "fitness.json")
    loaded_record = FitnessRecord.load(tmp_path / "fitness.json")
    assert loaded_record == record
    again = loaded_record.again(problem())
    assert loaded_record.same_arithmetic(again)
    assert loaded_record.deviations(again) == {"slow": 0.0, "fast": 0.0}


def test_a_change_of_the_laws_is_detected(record):
    """Another gravity changes all heights by a thousandth of the fall and keeps their spread."""
    changed = record.again(problem(lambda design, seed: fall(design, seed, 1.001)))
    assert min(record.deviations(changed).values()) > 4.0


def test_different_rounding_is_not_a_change(record):
    """Single starts that differ, and a shift by rounding, keep the mean within its error."""
    draw = np.random.default_rng(5)
    values = {
        name: {
            name_of_start: (
                np.array(old) * (1 + 1e-7) + 0.1 * draw.normal(size=6) * (np.arange(6) < 3)
            ).tolist()
            for name_of_start, old in objectives.items()
        }
        for name, objectives in record.values.items()
    }
    assert max(record.deviations(replace(record, values=values)).values()) < 4.0


@pytest.mark.parametrize(("recorded", "now"), [(1.0, np.nan), (1.0, np.inf), (0.0, 1.0)])
def test_new_or_former_failures_are_a_change(record, recorded, now):
    """This holds even if another objective of the design has not changed."""
    before, after = (
        replace(record, values={"slow": {"height": [1.0], "spread": [value]}}) for value in (recorded, now)
    )
    assert before.deviations(after) == {"slow": np.inf}


def test_records_of_other_problems_are_refused(record, tmp_path):
    path = tmp_path / "fitness.json"
    with pytest.raises(InputError, match="fitness record must be an existing file; received"):
        FitnessRecord.load(path)
    for text in ("", "[1]", '{"format": "tisim fitness record 1"}', '{"format": "another"}'):
        path.write_text(text)
        with pytest.raises(InputError, match="fitness record must be"):
            FitnessRecord.load(path)
    with pytest.raises(InputError, match="problem must be the one recorded, 'fall'; received 'rise'"):
        record.again(replace(problem(), name="rise"))
    with pytest.raises(InputError, match=r"designs must be at least one; received \{\}"):
        FitnessRecord.measure(problem(), {})
    with pytest.raises(InputError, match=r"design 'slow' must be of the genes speed; received \['sped'\]"):
        FitnessRecord.measure(problem(), {"slow": {"sped": 1.0}})
    with pytest.raises(InputError, match="starts must be at least 1; received 0"):
        FitnessRecord.measure(problem(), DESIGNS, starts=0)


def test_a_run_that_fails_names_its_design():
    def scene(design, seed):
        setup = fall(design, seed)
        return setup.model_copy(update={"effects": (Blowing(),)}) if design["speed"] > 5 else setup

    wild = problem(scene)
    with pytest.raises(RunError, match="design 'fast', start 0: "):
        FitnessRecord.measure(wild, DESIGNS, starts=1)


def test_the_record_is_public():
    assert optimize.FitnessRecord is FitnessRecord
