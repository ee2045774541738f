"""Figures of concentrated samples, drawn from known results."""

from types import SimpleNamespace

import numpy as np

from tisim.cases.concentration import figures


def test_curves_of_concentrated_samples():
    when = np.linspace(0.0, 0.6, 4)
    curves = {
        (angle, c): (when, c * np.arange(4.0), c * np.arange(4.0) + angle)
        for angle in (0.0, 90.0) for c in figures.CONCENTRATIONS
    }  # fmt: skip
    right = figures.captured_figure(curves).axes[1]
    hanging, touched = right.lines[2:4]
    assert hanging.get_label() == "500 mg/mL, captured or in a chain that is"
    np.testing.assert_allclose(hanging.get_ydata(), 0.5 * np.arange(4.0) + 90.0)
    np.testing.assert_allclose(touched.get_ydata(), 0.5 * np.arange(4.0))
    assert figures.table(curves).splitlines()[2] == f"0.0,0.005,{when[1]},0.005,0.005"


def test_picture_of_a_run_shows_chains_in_colour_and_their_mean_length():
    """Two pairs along the field and a single particle; all five were single at the start."""

    class FewFrames(list):
        times = np.array([0.0, 1e-3])

    def frame(position, captured=0):
        moment = np.tile([1.0, 0.0, 0.0], (5, 1))
        at = np.where(np.arange(5) < captured, 1e-3, -1.0)
        arrays = {"position": position, "radius": np.full(5, 7.5e-8), "moment": moment, "captured_at": at}
        return SimpleNamespace(arrays={**arrays, "fixed": (at >= 0).astype(int)})

    pairs = 1.5e-7 * np.array([[0, 0, 0], [1, 0, 0], [0, 0, 9], [1, 0, 9], [4, 9, 0.0]])
    trajectory = FewFrames([frame(10 * pairs), frame(pairs)])
    left, right = figures.pictures(trajectory)["chains.png"].axes
    np.testing.assert_allclose(right.lines[0].get_xdata(), [0.0, 1.0])
    np.testing.assert_allclose(right.lines[0].get_ydata(), [1.0, 5 / 3])
    # Seen along y, with x to the right and z upwards.
    picture, (low, high, bottom, top) = left.images[0].get_array(), left.images[0].get_extent()
    rows, columns, _ = picture.shape
    row = (rows * (pairs[:, 2] - bottom) / (top - bottom)).astype(int)
    seen = picture[row, (columns * (pairs[:, 0] - low) / (high - low)).astype(int)]
    assert seen[:, 3].tolist() == [1] * 5
    np.testing.assert_allclose(seen[[0, 2]], seen[[1, 3]], atol=0.02)
    assert np.ptp(seen[4, :3]) < 0.02
    assert np.ptp(seen[:4, :3], axis=1).min() > 0.1
    assert np.abs(seen[0] - seen[2]).max() > 0.2
    # One is captured and holds its neighbour.
    trajectory[1] = frame(pairs, captured=1)
    _, _, captured = figures.pictures(trajectory)["chains.png"].axes
    held, touched = (line.get_ydata() for line in captured.lines)
    np.testing.assert_allclose(held, [0.0, 0.4])
    np.testing.assert_allclose(touched, [0.0, 0.2])
