"""Trajectories do not change the run, have frames at the requested times, and are H5MD 1.1 files."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pyh5md
import pytest

import tisim
from tests.scenes import by_id, compiled, flow, scene
from tisim import Box, InputError, Recording
from tisim.engine.checkpoint import restore, save
from tisim.io import h5md
from tisim.io.reader import Frame, frames, world_count
from tisim.io.trajectory import Trajectory, recorded_fields

FLOWS = [flow(0, surface_energy=1e3, threshold=0.9, images=True), flow(1, duration=4e-4, images=True)]
"""Worlds of different durations in which grains merge and break."""
CAPACITY = max(one.capacity() for one in FLOWS)
ROOT = Path(__file__).parents[2]


def simulation(schedule="world"):
    return compiled(FLOWS[0], 2, CAPACITY, schedule)


def record(path, schedule="world", **rate):
    """Run the flows, write their trajectory to the path and return their results."""
    sim = simulation(schedule)
    sim.load(FLOWS)
    with Recording(path, **rate).observer(sim) as recorder:
        sim.run(observers=[recorder])
    return sim.results()


def every_frame(path, world=0):
    with frames(path, world) as sequence:
        return list(sequence)


@pytest.fixture(scope="module", params=["world", pytest.param("particle", marks=pytest.mark.slow)])
def file(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("trajectory") / "flows.h5"
    record(path, request.param, every=5e-5)
    return path


@pytest.fixture(scope="module")
def states():
    """(time, state) of the flows after every step, without a trajectory."""
    sim = simulation()
    sim.load(FLOWS)
    states_by_world = [[(r.time, by_id(r))] for r in sim.results()]
    while len(sim.ended()) < 2:
        sim.run(steps=1)
        for w, result in enumerate(sim.results()):
            if result.time > states_by_world[w][-1][0]:
                states_by_world[w].append((result.time, by_id(result)))
    return states_by_world


@pytest.mark.slow
@pytest.mark.parametrize("schedule", ["world", "particle"])
def test_a_run_is_the_same_to_the_last_bit_with_a_trajectory(tmp_path, schedule):
    sim = simulation(schedule)
    sim.load(FLOWS)
    sim.run()
    plain = sim.results()
    for w, result in enumerate(record(tmp_path / "t.h5", schedule, frames=23)):
        assert (result.work, result.time, result.status) == (plain[w].work, plain[w].time, plain[w].status)
        for name, values in result.state.items():
            np.testing.assert_array_equal(values, plain[w].state[name], err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("world", [0, 1])
def test_frames_are_the_first_states_at_or_after_the_wanted_times(file, states, world):
    times = np.array([t for t, _ in states[world]])
    due = np.arange(0.0, FLOWS[world].duration * (1 + 1e-9), 5e-5)
    # If a step is longer than the interval, one frame stands for two times.
    expected = np.unique(np.searchsorted(times, due - 1e-9 * 5e-5))
    recorded_frames = every_frame(file, world)
    assert [frame.step for frame in recorded_frames] == expected.tolist()
    for frame, k in zip(recorded_frames, expected, strict=True):
        assert frame.time == times[k]
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(values, states[world][k][1][name], err_msg=name)
    counts = [len(frame.arrays["id"]) for frame in recorded_frames]
    assert min(counts) < counts[0]
    assert (np.diff(counts) > 0).any() == (world == 0)


def test_frame_times_met_up_to_rounding_cost_no_step(tmp_path):
    """Ten steps of 30 us with a frame each; sums of 30 us are below its multiples in the last bit."""
    steady = scene([(0, 0, 0)], [(1.0, 0, 0)], dt=3e-5, steps=10)
    tisim.run(steady, record=Recording(tmp_path / "t.h5", frames=10))
    assert [frame.step for frame in every_frame(tmp_path / "t.h5")] == list(range(11))


def test_intervals_far_below_a_step_give_every_step(tmp_path):
    """The same holds for intervals below the rounding of times, for frames and for entries of a series."""
    steady = scene([(0, 0, 0)], [(1.0, 0, 0)], dt=1e-4, steps=60)
    simulation = tisim.Simulation(steady)
    for every in (1e-9, 1e-12, 1e-15, 1e-300):
        simulation.load(steady)
        series = tisim.MeasureSeries(every)
        with Recording(tmp_path / "t.h5", every=every).observer(simulation) as recorder:
            simulation.run(observers=[recorder, series])
        assert len(every_frame(tmp_path / "t.h5")) == len(series[0]["time"]) == 61
    simulation.close()


def test_the_end_is_a_frame_also_between_wanted_times(tmp_path):
    steady = scene([(0, 0, 0)], [(1.0, 0, 0)], dt=1e-4, steps=10)
    tisim.run(steady, record=Recording(tmp_path / "t.h5", every=3.5e-4))
    assert [frame.step for frame in every_frame(tmp_path / "t.h5")] == [0, 4, 7, 10]


def test_a_failed_run_ends_with_its_last_good_state(tmp_path):
    fast = scene([(0, 0, 0)], [(1e308, 0, 0)], dt=10.0, steps=3)
    result = tisim.run(fast, record=Recording(tmp_path / "t.h5", frames=3))
    assert not result.status.ok
    recorded_frames = every_frame(tmp_path / "t.h5")
    assert recorded_frames[-1].time == result.time
    assert np.isfinite(recorded_frames[-1].arrays["position"]).all()


@pytest.mark.slow
def test_scenes_of_different_structure_are_written_to_one_file(tmp_path):
    mixed = [scene([(k * 1e-3, 0, 0)], [(1.0, 0, 0)], dt=1e-4, steps=4) for k in range(3)]
    mixed[1] = mixed[1].model_copy(update={"domain": Box(low=(-1,) * 3, high=(1,) * 3)})
    results = tisim.run(mixed, record=Recording(tmp_path / "t.h5", frames=2))
    assert world_count(tmp_path / "t.h5") == 3
    for w, result in enumerate(results):
        with frames(tmp_path / "t.h5", w) as sequence:
            assert sequence.scene == mixed[w]
            assert len(sequence) == 3
            np.testing.assert_array_equal(sequence[-1].arrays["position"], result.state["position"])


def test_an_independent_reader_reads_it(file):
    """pyh5md, by authors of the specification."""
    with pyh5md.File(file, "r") as read:
        assert tuple(read.attrs["version"] if "version" in read.attrs else read["h5md"].attrs["version"]) == (
            1,
            1,
        )
        for w in range(2):
            group = read.particles_group(f"world_{w}")
            for name in ("position", "velocity", "mass", "radius", "temperature"):
                element = pyh5md.element(group, name)
                ids = pyh5md.element(group, "id")
                for k, frame in enumerate(every_frame(file, w)):
                    there = ids.value[k] != ids.value.fillvalue
                    np.testing.assert_array_equal(element.value[k][there], frame.arrays[name])
                    assert np.isnan(element.value[k][~there]).all()
                    assert (element.step[k], element.time[k]) == (frame.step, frame.time)


def test_layout_follows_the_specification(file):
    with h5py.File(file) as read:
        head = read["h5md"]
        assert head.attrs["version"].tolist() == [1, 1]
        assert head.attrs["version"].dtype.kind == "i"
        for group, name in (("author", "name"), ("creator", "name"), ("creator", "version")):
            text = head[group].attrs.get_id(name)
            assert (text.dtype.kind, text.shape) == ("S", ())
        assert head["modules/units"].attrs["system"] == "SI"
        for w, one in enumerate(FLOWS):
            group = read[f"particles/world_{w}"]
            box = group["box"]
            assert box.attrs["dimension"] == 3
            assert box.attrs["boundary"].tolist() == [b"periodic"] * 3
            low, high = one.domain.bounds()
            np.testing.assert_array_equal(box["edges"], high - low)
            assert set(group) - {"box"} == {field.name for field in recorded_fields(one)}
            position = group["position"]
            assert (np.diff(position["step"]) > 0).all()
            for name in set(group) - {"box"}:
                element = group[name]
                # Elements that are sampled together may be hard links to the same objects.
                assert element["step"] == position["step"]
                assert element["time"] == position["time"]
                assert element["value"].shape[:2] == position["value"].shape[:2]
                assert len(element["value"]) == len(element["step"])
            assert group["id/value"].fillvalue == h5md.ABSENT
            for frame in group["id/value"][:]:
                present = frame[frame != h5md.ABSENT]
                assert len(np.unique(present)) == len(present)
            units = {
                name: group[name]["value"].attrs.get("unit", "") for name in ("position", "velocity", "id")
            }
            assert units == {"position": "m", "velocity": "m s-1", "id": ""}
            assert group["position/time"].attrs["unit"] == "s"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", ""),
        ("m", "m"),
        ("m/s", "m s-1"),
        ("kg/m^3", "kg m-3"),
        ("N m", "N m"),
        ("J/(kg K)", "J kg-1 K-1"),
    ],
)
def test_units_are_written_by_the_rules_of_the_units_module(text, expected):
    assert h5md.unit_string(text) == expected


def test_open_space_has_no_edges(tmp_path):
    still = scene([(0, 0, 0)], [(0.0, 0, 0)])
    tisim.run(still, record=Recording(tmp_path / "t.h5", frames=1))
    with h5py.File(tmp_path / "t.h5") as read:
        box = read["particles/all/box"]
        assert (box.attrs["boundary"].tolist(), list(box)) == ([b"none"] * 3, [])


def test_the_box_lists_its_periodic_axes():
    slab = Box(low=(0, 0, 0), high=(1, 2, 3), periodic=(True, False, True))
    with h5py.File("slab.h5", "w", driver="core", backing_store=False) as made:
        h5md.write_box(made, slab)
        assert made["box"].attrs["boundary"].tolist() == [b"periodic", b"none", b"periodic"]
        assert made["box/edges"][...].tolist() == [1.0, 2.0, 3.0]


def test_a_trajectory_resumes_from_a_checkpoint(tmp_path):
    """Frames after the checkpoint are written again; none is missing or duplicated."""
    sim = simulation()
    recording = Recording(tmp_path / "t.h5", frames=15)
    sim.load(FLOWS[:1])
    with recording.observer(sim) as recorder:
        sim.run(until=3e-4, observers=[recorder])
        save(sim, tmp_path / "c.h5")
        sim.run(steps=100, observers=[recorder])
    cut = every_frame(tmp_path / "t.h5")
    sim.load(FLOWS[:1])
    restore(sim, tmp_path / "c.h5")
    now = float(sim.s.read("time")[0])
    assert now < cut[-1].time < FLOWS[0].duration
    with recording.observer(sim, resume=True) as recorder:
        times = [frame.time for frame in cut if frame.time <= now]
        assert recorder.trajectory.groups[0]["position/time"][:].tolist() == times
        assert len(times) > 1
        sim.run(observers=[recorder])
    record(tmp_path / "whole.h5", frames=15)
    whole, resumed = every_frame(tmp_path / "whole.h5"), every_frame(tmp_path / "t.h5")
    assert [f.step for f in resumed] == [f.step for f in whole]
    for frame, other in zip(resumed, whole, strict=True):
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(values, other.arrays[name])
    assert [path.name for path in tmp_path.glob("t.h5*")] == ["t.h5"]


@pytest.mark.parametrize("worlds", [1, 2])
def test_a_trajectory_of_another_scene_is_not_resumed(tmp_path, worlds):
    """The other scene has other velocities of the same number of particles, or several worlds."""
    path, mine, other = tmp_path / "t.h5", *(scene([(0, 0, 0)], [(v, 0, 0)]) for v in (1.0, 2.0))
    Trajectory(path, [mine, other][-worlds:]).close()
    content = path.read_bytes()
    rule = r"trajectory to go on with must be of the same scene; received .*t\.h5, of another one"
    with pytest.raises(InputError, match=rule):
        Trajectory.resume(path, mine, 1.0)
    assert [(file.name, file.read_bytes()) for file in tmp_path.iterdir()] == [("t.h5", content)]


KILLED = """
import sys, time
import numpy as np
import tests.io.test_trajectory as t
from tisim.io.reader import Frame
from tisim import Recording
from tisim.io.trajectory import Trajectory
scene = t.scene([(0, 0, 0)] * 3000, [(0.0, 0, 0)] * 3000)
with Trajectory(sys.argv[1], [scene]) as trajectory:
    for k in range(10**6):
        trajectory.write(0, t.synthetic(k))
"""


def synthetic(k):
    """A frame that each of its numbers identifies."""
    n = 3000 - k % 7
    numbers = k + np.arange(n) / 4096
    vector = numbers[:, None] + np.array([0.0, 0.25, 0.5]) / 4096
    arrays = dict(position=vector, velocity=-vector, mass=numbers, radius=2 * numbers, id=np.arange(n))
    return Frame(1e-3 * k, 10 * k, arrays)


@pytest.mark.slow
def test_all_finished_frames_of_a_killed_run_can_be_read(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for kill in range(2):
        path = tmp_path / f"{kill}.h5"
        running = subprocess.Popen([sys.executable, "-c", KILLED, str(path)], env=environment, cwd=ROOT)
        try:
            while not path.exists() or path.stat().st_size < 500_000 * (kill + 1):
                assert running.poll() is None
                time.sleep(0.01)
            # Also while it is written.
            alive = every_frame(path)
        finally:
            running.kill()
            running.wait()
        recorded_frames = every_frame(path)
        assert 5 < len(alive) <= len(recorded_frames)
        for k, frame in enumerate(recorded_frames):
            expected = synthetic(k)
            assert (frame.time, frame.step) == (expected.time, expected.step)
            for name, values in expected.arrays.items():
                np.testing.assert_array_equal(frame.arrays[name], values)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda path: Recording(path), "recording must be given frames or every; received neither"),
        (lambda path: Recording(path, 1, 1.0), "recording must be given frames or every; received both"),
        (lambda path: Recording(path, frames=0), "frames must be a whole number, at least 1; received 0"),
        (lambda path: Recording(path, frames=2.5), "frames must be a whole number, at least 1; received 2.5"),
        (lambda path: Recording(path, every="1 s"), "every must be above 0 s, and finite; received '1 s'"),
        (lambda path: Recording(path, every=0.0), "every must be above 0 s, and finite; received 0.0"),
        (lambda path: Recording(path, every=float("nan")), "every must be above 0 s, and finite"),
        (lambda path: Trajectory(path / "no/t.h5", []), "a file that can be written; received"),
        (lambda path: every_frame(path / "none.h5"), "file must be a trajectory.h5 or result.h5 of a run"),
        (lambda path: every_frame(Path(__file__)), "file must be a trajectory.h5 or result.h5 of a run"),
    ],
)
def test_wrong_recordings_are_refused(tmp_path, make, message):
    with pytest.raises(InputError, match=message):
        make(tmp_path)


def test_other_files_and_worlds_are_refused(tmp_path, file):
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = 1
    with pytest.raises(InputError, match=r"file must be a trajectory.h5 or result.h5 of a run"):
        every_frame(tmp_path / "other.h5")
    with pytest.raises(InputError, match="world must be 0 to 1; received 2"):
        every_frame(file, 2)
