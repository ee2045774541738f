"""Lines along fields, against closed forms and magpylib."""

import magpylib
import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.constants import mu_0

from tests.report.conftest import record, scene
from tisim import Box, InputError, Open
from tisim.io.reader import frames
from tisim.plotting.cloud import start_and_end
from tisim.plotting.field_lines import FieldLines, arrowheads, dipole_field, ends, follow, lines_through
from tisim.plotting.look import Look
from tisim.plotting.movie import movie
from tisim.plotting.scenery import NO_SCENERY
from tisim.sources import MagneticField, UniformFlow

__all__ = ["record"]
LOW, HIGH = np.array([-1.0, -1.0, -1.0]), np.array([1.0, 1.0, 2.0])


def test_a_line_follows_a_circle():
    """The field of a rotation about z, with half a turn in either direction."""
    count = 200
    for sign in (-1, 1):
        line = follow(
            lambda r: np.cross([0, 0, 3.0], r), [[2.0, 0, 1], [1.0, 0, 0]], sign * 2 * np.pi / count, count
        )
        assert line.shape == (count + 1, 2, 3)
        np.testing.assert_allclose(np.linalg.norm(line[:, 0, :2], axis=1), 2, rtol=1e-8)
        np.testing.assert_allclose(line[-1], [[-2.0, 0, 1], [1.0, 0, 0]], atol=1e-6)
        assert np.sign(line[1, 0, 1]) == sign


def test_a_line_ends_where_the_field_is_0():
    line = follow(lambda r: np.where(r[:, :1] < 0.45, [[1.0, 0, 0]], 0.0), np.zeros((1, 3)), 0.1, 20)
    assert line[-1, 0, 0] == line[-2, 0, 0]
    assert 0.4 < line[-1, 0, 0] < 0.6
    np.testing.assert_allclose(line[:4, 0, 0], [0, 0.1, 0.2, 0.3])


def test_lines_of_a_dipole_have_their_closed_form():
    """r = R sin^2 of the angle to the moment."""
    place, moment = np.zeros((1, 3)), np.array([[0.0, 0.0, 2.0]])
    line = follow(
        lambda r: dipole_field(r, place, moment, np.full(1, 0.1)), np.array([[1.0, 0, 0]]), 0.005, 200
    )[:, 0]
    r = np.linalg.norm(line, axis=1)
    np.testing.assert_allclose(r, 1 - (line[:, 2] / r) ** 2, rtol=1e-6)
    assert r[-1] < 0.6


def test_the_field_of_moments_is_that_of_magnetised_spheres(rng):
    place, moment = rng.uniform(-1, 1, (5, 3)), rng.normal(size=(5, 3))
    radius = rng.uniform(0.2, 0.5, 5)
    points = rng.uniform(-1.5, 1.5, (400, 3))
    volume = 4 / 3 * np.pi * radius**3
    spheres = [
        magpylib.magnet.Sphere(diameter=2 * r, polarization=mu_0 * m / v, position=p)
        for p, m, r, v in zip(place, moment, radius, volume, strict=True)
    ]
    expected = magpylib.getB(spheres, points, sumup=True)
    inside = np.linalg.norm(points[:, None] - place, axis=2) < radius
    assert inside.any()
    np.testing.assert_allclose(
        dipole_field(points, place, moment, radius), expected, rtol=1e-9, atol=1e-12 * abs(expected).max()
    )


@pytest.mark.parametrize("pairs", [7, 10**6])
def test_sums_of_few_dipoles_at_a_time_are_the_same(pairs, rng, monkeypatch):
    place, moment, points = (rng.normal(size=(n, 3)) for n in (6, 6, 3))
    whole = dipole_field(points, place, moment, np.full(6, 0.1))
    monkeypatch.setattr("tisim.plotting.field_lines.SUMMED_PAIRS", pairs)
    np.testing.assert_allclose(dipole_field(points, place, moment, np.full(6, 0.1)), whole, rtol=1e-12)


@pytest.mark.parametrize("way", [(0.0, 0.0, -2.0), (1.0, 0.0, 0.0)])
def test_lines_of_a_uniform_field_go_straight_through_the_box(way):
    lines = lines_through(lambda r: np.tile(way, (len(r), 1)), LOW, HIGH)
    assert len(lines) == 49
    along = int(np.argmax(np.abs(way)))
    step = np.linalg.norm(HIGH - LOW) / 160
    for line in lines:
        others = np.delete(line, along, axis=1)
        np.testing.assert_allclose(others, np.tile(others[0], (len(line), 1)), atol=1e-12)
        assert ((line >= LOW) & (line <= HIGH)).all()
        reached = np.sort(line[[0, -1], along])
        assert np.abs(reached - [LOW[along], HIGH[along]]).max() < step
        np.testing.assert_allclose(np.linalg.norm(np.diff(line, axis=0), axis=1), step)
        assert np.sign(line[-1, along] - line[0, along]) == np.sign(way[along])
    pieces = ends(lines)
    assert pieces.shape == (sum(len(line) - 1 for line in lines), 2, 3)
    assert ends([]).shape == (0, 2, 3)


@pytest.fixture(scope="module")
def magnetised():
    box = Box(low=(-1.0,) * 3, high=(1.0,) * 3)
    return scene(2, effects=(MagneticField(constant=(0.0, 0.0, 0.5)),), domain=box)


def test_a_scene_has_lines_of_its_sources_only(magnetised):
    with pytest.raises(InputError, match="lines must be one of magnetic; received 'flow'"):
        FieldLines(magnetised, "flow")
    with pytest.raises(InputError, match="lines must be one of magnetic; received 'wind'"):
        FieldLines(magnetised, "wind")
    with pytest.raises(InputError, match="lines must be left out in this scene; received 'flow'"):
        FieldLines(scene(1), "flow")


@pytest.mark.long
def test_lines_are_in_the_box_of_the_scene_or_around_all(magnetised):
    start = magnetised.start()
    with FieldLines(magnetised, "magnetic") as field:
        around = field.beside(NO_SCENERY, start, 0.0)
    (lines,) = around.edges
    np.testing.assert_allclose(np.abs(lines.ends[..., 2]).max(), 1.0, atol=0.03)
    flowing = scene(2, effects=(UniformFlow(velocity=(1.0, 0.0, 0.0)),), domain=Open())
    state = {"position": np.zeros((1, 3)), "radius": np.ones(1)}
    with FieldLines(flowing, "flow") as field:
        long = field.lines(state, 0.0, np.array([[9.0, 0, 0]]))
    x = np.concatenate(long)[:, 0]
    assert x.min() < -1
    assert x.max() > 9


@pytest.mark.long
def test_a_picture_has_lines_if_they_are_wanted(magnetised):
    start = magnetised.start()
    pictures = []
    for lines in (None, "magnetic"):
        figure = start_and_end((start, start), (0.0, 1.0), magnetised, look=Look(lines=lines))
        assert isinstance(figure, Figure)
        pictures.append(figure.axes[0].images[0].get_array())
    blue = [(one[..., 2] > one[..., 0] + 0.15)[one[..., 3] > 0.5].sum() for one in pictures]
    assert blue[1] > blue[0] + 1000


@pytest.mark.long
def test_a_movie_has_lines_if_they_are_wanted(magnetised, record, tmp_path):
    places = [[-0.5, 0, 0], [0.5, 0, 0]]
    path, made = record(magnetised, [{"id": [0, 1], "position": places}] * 2), {}
    for lines in (None, "magnetic"):
        with frames(path) as sequence:
            movie(sequence, tmp_path / "a.gif", look=Look(lines=lines))
        made[lines] = (tmp_path / "a.gif").read_bytes()
    assert len(made["magnetic"]) > 1.5 * len(made[None])


def test_arrowheads_point_along_the_field():
    """Around a wire: each tip is ahead of its barbs, at the middle of a line, and short lines have none."""

    def field(r):
        return np.stack([-r[:, 1], r[:, 0], 0 * r[:, 0]], axis=1)

    lines = lines_through(field, np.array([-1.0, -1.0, -0.2]), np.array([1.0, 1.0, 0.2]))
    barbs = arrowheads([*lines, np.array([[0.0, 0, 0], [1e-3, 0, 0]])])
    heads = barbs.reshape(-1, 4, 2, 3)
    assert 10 < len(heads) <= len(lines)
    tips, behind = heads[:, 0, 0], heads[:, :, 1].mean(axis=1)
    np.testing.assert_array_equal(heads[:, :, 0], np.repeat(tips[:, None], 4, axis=1))
    along = field(tips) / np.linalg.norm(field(tips), axis=1, keepdims=True)
    size = np.linalg.norm(tips - behind, axis=1)
    cosine = ((tips - behind) * along).sum(axis=1) / size
    assert cosine.min() > 0.9
    assert np.ptp(size) < 1e-9
    nearest = [min(np.linalg.norm(line - tip, axis=1).min() for line in lines) for tip in tips]
    assert max(nearest) < 0.02
    assert arrowheads([]).shape == (0, 2, 3)
