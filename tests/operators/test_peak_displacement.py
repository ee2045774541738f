"""The observer of the largest displacement of the centre of mass; a Result and its file contain its value."""

import h5py
import numpy as np
import pytest

from tests.scenes import scene, simulate
from tisim.effects import Tether
from tisim.io import run_folder
from tisim.operators import PeakDisplacement


def swinging(periods, speed):
    """Two masses of 1 kg on springs of 1 N/m, whose centre of mass oscillates too."""
    return scene(
        [[0.0, 0, 0], [0.1, 0, 0]], [[0.0, speed, 0], [0, speed, 0]],
        (Tether(stiffness=(1.0, 1.0, 1.0)), PeakDisplacement()),
        mass=1.0, dt=1e-3, steps=round(periods * 2 * np.pi / 1e-3),
    )  # fmt: skip


@pytest.mark.long
def test_the_largest_displacement_is_kept_and_not_the_last(tmp_path):
    """After half a period the cloud is back at its start and the record is v/w; before a quarter it still
    grows."""
    speeds = (0.3, 2.0)
    results = simulate([swinging(p, v) for p in (0.5, 0.125) for v in speeds], worlds=4, capacity=4)
    peaks = [result.measures["peak_displacement"] for result in results]
    expected = [v * factor for factor in (1.0, np.sin(np.pi / 4)) for v in speeds]
    np.testing.assert_allclose(peaks, expected, rtol=1e-3)
    end = results[0].state["position"] - results[0].start["position"]
    assert np.abs(end).max() < 1e-2 * peaks[0]
    folder = run_folder.RunFolder(tmp_path)
    run_folder.write(results[1], folder)
    with h5py.File(folder.result) as file:
        assert file["measures"].attrs["peak_displacement"] == peaks[1]


def test_the_displacement_is_weighted_by_mass():
    """Of masses 1 kg and 3 kg only the light one moves, so the centre of mass moves a quarter as far."""
    setup = scene(
        [[0.0, 0, 0], [1.0, 0, 0]], [[1.0, 0, 0], [0, 0, 0]],
        (Tether(stiffness=(0.0, 0.0, 0.0)), PeakDisplacement()), mass=[1.0, 3.0], dt=1e-3, steps=100,
    )  # fmt: skip
    (result,) = simulate([setup], worlds=4, capacity=4)
    assert result.measures["peak_displacement"] == pytest.approx(0.1 / 4, rel=1e-12)


def test_an_infinite_displacement_stops_the_world():
    """The square of 1e297 m overflows: the previous state is returned and the run is reported as failed."""
    setup = scene(
        [[0.0, 0, 0], [1.0, 0, 0]], [[0.0, 1e300, 0], [0, 0, 0]],
        (Tether(stiffness=(0.0, 0.0, 0.0)), PeakDisplacement()), mass=1.0, dt=1e-3, steps=3,
    )  # fmt: skip
    (result,) = simulate([setup], worlds=4, capacity=4)
    assert not result.status.ok
    assert "a quantity is not finite, by effects.peak_displacement; kept t = 0 s" in result.status.reason
    assert result.measures["peak_displacement"] == 0.0
