"""Compressed frames hold the particles of the file, to the stated rounding."""

import numpy as np
import pytest

from tests.report.conftest import scene
from tisim import Box, InputError, Open
from tisim.io.reader import frames
from tisim.report.columns import whole_numbers
from tisim.report.compressed_trajectory import compress


def read_back(trajectory, name):
    """The values of a quantity, shape (frames, rows, components)."""
    one = trajectory.column(name)
    values = one.scale.values(whole_numbers(one, trajectory.particles))
    return np.broadcast_to(values, (len(trajectory.times), *values.shape[1:]))


def by_id(trajectory, name, frame):
    """The values of a quantity in a frame, by id."""
    ids = trajectory.ids()[frame]
    values = read_back(trajectory, name)[frame]
    return {int(one): values[row] for row, one in enumerate(ids) if one >= 0}


COMING_AND_GOING = [[0, 1, 2, 3], [0, 2, 3], [0, 2, 3, 4], [4, 5, 6], [], [1, 4, 5, 6, 7]]
"""Ids of six frames: 1 leaves and returns, later ids are inserted, and once nothing is left."""


@pytest.mark.parametrize("domain", [Box(low=(-0.01,) * 3, high=(0.01,) * 3), Open()])
def test_particles_come_and_go(record, rng, domain):
    given = [
        {"id": ids, "position": rng.uniform(-0.01, 0.01, (len(ids), 3)), "mass": rng.uniform(1, 2, len(ids))}
        for ids in COMING_AND_GOING
    ]
    path = record(scene(8, domain=domain), given)
    with frames(path) as sequence:
        trajectory = compress(sequence, range(6))
    assert trajectory.particles == 5, "rows are used again"
    assert trajectory.counts.tolist() == [len(ids) for ids in COMING_AND_GOING]
    half = trajectory.column("position").scale.rounding()
    for m, frame in enumerate(given):
        places, masses = by_id(trajectory, "position", m), by_id(trajectory, "mass", m)
        assert sorted(places) == frame["id"]
        for k, one in enumerate(frame["id"]):
            assert np.abs(places[one] - frame["position"][k]).max() <= half * (1 + 1e-9)
            assert masses[one] == pytest.approx(
                frame["mass"][k], abs=trajectory.column("mass").scale.rounding() * 1.000001
            )


def test_crossing_a_periodic_face_costs_nothing(record):
    """Free flight through a periodic box is compressed as free flight in an open one."""
    start = np.random.default_rng(0).uniform(-0.01, 0.01, (400, 3))
    speed = np.random.default_rng(1).uniform(-1, 1, (400, 3))
    steps = [start + 2e-3 * k * speed for k in range(30)]
    sizes = []
    for domain, wrap in ((Box(low=(-0.01,) * 3, high=(0.01,) * 3), True), (Open(), False)):
        places = [np.mod(r + 0.01, 0.02) - 0.01 if wrap else r for r in steps]
        given = [{"id": range(400), "position": r} for r in places]
        with frames(record(scene(400, domain=domain), given, f"{wrap}.h5")) as sequence:
            sizes.append(len(compress(sequence, range(30)).column("position").data))
    assert sizes[0] < 1.3 * sizes[1]


def test_the_rounding_of_positions_is_the_stated_one(record, rng):
    path = record(scene(2000), [{"id": range(2000), "position": rng.uniform(-0.01, 0.01, (2000, 3))}])
    with frames(path) as sequence:
        trajectory, given = compress(sequence, [0]), sequence[0].arrays["position"]
    half = trajectory.column("position").scale.rounding()
    assert half == pytest.approx(0.02 / 2**17)
    error = np.abs(read_back(trajectory, "position")[0] - given).max()
    assert 0.9 * half < error <= half * (1 + 1e-9)


def test_positions_are_finer_if_a_particle_flies_far_away(record, rng):
    places = rng.uniform(-0.01, 0.01, (50, 3))
    places[0] = 1e3
    path = record(
        scene(50, domain=Open()), [{"id": range(50), "position": places, "radius": np.full(50, 1e-3)}]
    )
    with frames(path) as sequence:
        trajectory = compress(sequence, [0])
    assert trajectory.column("position").scale.bits == 32
    half = trajectory.column("position").scale.rounding()
    assert half < 1e-4
    error = np.abs(read_back(trajectory, "position")[0] - places).max()
    assert 0.3 * half < error <= half * (1 + 1e-6)


def test_quantities_have_their_units_and_scales(record, rng):
    wide = np.exp(rng.uniform(-8, 3, 300))
    given = [
        {"id": range(300), "position": rng.uniform(-0.01, 0.01, (300, 3)), "mass": wide * (1 + k),
         "velocity": rng.normal(size=(300, 3))}
        for k in range(3)
    ]  # fmt: skip
    with frames(record(scene(300), given)) as sequence:
        trajectory = compress(sequence, range(3))
    assert [one.name for one in trajectory.columns] == ["id", "position", "mass", "radius", "speed"]
    mass, speed = trajectory.column("mass"), trajectory.column("speed")
    assert (mass.unit, speed.unit) == ("kg", "m/s")
    assert (mass.scale.logarithmic, speed.scale.logarithmic) == (True, False)
    error = np.abs(read_back(trajectory, "mass")[2, :, 0] / (3 * wide) - 1).max()
    assert error <= mass.scale.rounding() * (1 + 1e-9)
    size = np.linalg.norm(given[1]["velocity"], axis=1)
    assert np.abs(read_back(trajectory, "speed")[1, :, 0] - size).max() <= speed.scale.rounding() * (1 + 1e-9)


def test_fields_are_chosen_by_name(record):
    path = record(scene(3), [{"id": range(3), "position": np.zeros((3, 3))}])
    with frames(path) as sequence:
        assert [one.name for one in compress(sequence, [0], names=["speed"]).columns][2:] == [
            "radius",
            "speed",
        ]
        with pytest.raises(InputError, match="field must be one of mass, radius, speed; received 'heat'"):
            compress(sequence, [0], names=["heat"])
        with pytest.raises(InputError, match="file must be one with a frame"):
            compress(sequence, [])


def test_a_part_of_the_particles(record, rng):
    path = record(scene(90), [{"id": range(90), "position": rng.uniform(-0.01, 0.01, (90, 3))}])
    with frames(path) as sequence:
        assert sorted(by_id(compress(sequence, [0], part=3), "mass", 0)) == list(range(0, 90, 3))
