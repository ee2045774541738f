"""Standard pictures and movies from the file of a run."""

from __future__ import annotations

import itertools
import subprocess
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from matplotlib.animation import FFMpegWriter, PillowWriter
from PIL import Image

import tisim
from tests.scenes import scene
from tisim import Box, InputError, Open, Recording, ShearedBox
from tisim.io.reader import Frames, frames
from tisim.io.trajectory import Trajectory
from tisim.plotting.cloud import start_and_end
from tisim.plotting.look import Look
from tisim.plotting.movie import movie
from tisim.plotting.time_series import clouds, history, mark_missing, quantities

MOVING = dict(
    position=[(0, 0, 0), (0.01, 0, 0)],
    velocity=[(1.0, 2.0, 0), (3.0, 2.0, 0)],
    mass=[1.0, 3.0],
    dt=1e-3,
    steps=4,
)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("plots") / "t.h5"
    tisim.run(scene(**MOVING), record=Recording(path, frames=4))
    return path


def test_the_history_of_two_grains_in_straight_flight(file):
    with frames(file) as trajectory:
        series = history(trajectory)
    np.testing.assert_allclose(series.time, np.arange(5) * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(series.kinetic_energy, 0.5 * (1 + 4) + 1.5 * (9 + 4), rtol=1e-12)
    np.testing.assert_allclose(series.drift, [[2.5, 2.0, 0]] * 5, rtol=1e-12)
    np.testing.assert_allclose(series.shift, series.time[:, None] * [2.5, 2.0, 0], rtol=1e-9, atol=1e-15)
    assert series.number.tolist() == [2] * 5


def test_quantities_draw_the_history(file):
    with frames(file) as trajectory:
        figure, series = quantities(trajectory), history(trajectory)
    energy, centre = figure.axes
    np.testing.assert_array_equal(energy.lines[0].get_ydata(), series.kinetic_energy)
    for k, line in enumerate(centre.lines):
        np.testing.assert_array_equal(line.get_ydata(), series.shift[:, k])
    assert energy.get_ylim()[0] == 0
    assert [axis.get_title("left") for axis in figure.axes] == ["(a)", "(b)"]
    labels = energy.get_ylabel(), centre.get_ylabel(), centre.get_xlabel()
    assert labels == ("kinetic energy (J)", "shift of the\ncentre of gravity (mm)", "time (ms)")
    assert centre.xaxis.get_major_formatter()(0.002) == "2"
    assert figure.get_suptitle() == "2 particles throughout"


def test_a_changing_number_of_particles_has_a_panel():
    class Seen(list):
        times = np.array([0.0, 1.0])
        scene = SimpleNamespace(domain=Open())

    def frame(number):
        arrays = {name: np.ones((number, 3)) for name in ("position", "velocity")}
        return SimpleNamespace(arrays={**arrays, "mass": np.ones(number)})

    figure = quantities(Seen([frame(3), frame(2)]))
    *_, number = figure.axes
    assert number.lines[0].get_ydata().tolist() == [3, 2]
    assert (number.get_title("left"), figure.get_suptitle()) == ("(c)", "")


def test_a_crossing_of_a_sheared_face_causes_no_jump():
    """A particle moves with the flow and at 1 m/s along the gradient; the rate is 10 /s, and sides are 2
    m."""
    box = ShearedBox(low=(-1, -1, -1), high=(1, 1, 1), rate=10.0)

    class Seen(list):
        times = np.array([0.0, 1.0])
        scene = SimpleNamespace(domain=box)

    frames = Seen()
    for height in (0.9, -0.9):
        arrays = {"position": np.array([[0.0, height, 0.0]]), "velocity": np.array([[10 * height, 1.0, 0.0]])}
        frames.append(SimpleNamespace(arrays={**arrays, "mass": np.array([2.0])}))
    series = history(frames)
    np.testing.assert_allclose(series.kinetic_energy, 1.0, rtol=1e-12)
    np.testing.assert_allclose(series.drift, [[0.0, 1.0, 0.0]] * 2, rtol=0, atol=1e-12)
    for axis in quantities(frames).axes:
        assert "relative" in axis.get_ylabel()


@pytest.mark.parametrize(("speeds", "scale"), [((0.0, 1e-3, 1.0), "log"), ((0.0, 0.9, 1.0), "linear")])
def test_energies_that_span_decades_are_on_a_logarithmic_axis(speeds, scale):
    """This includes a start at rest; markers at the edges of the plot are not clipped."""

    class Seen(list):
        times = np.arange(3.0)
        scene = SimpleNamespace(domain=Open())

    def frame(speed):
        arrays = {"position": np.zeros((1, 3)), "velocity": np.array([[speed, 0, 0]]), "mass": np.ones(1)}
        return SimpleNamespace(arrays=arrays)

    energy, *_ = quantities(Seen(map(frame, speeds))).axes
    assert energy.get_yscale() == scale
    assert not energy.lines[0].get_clip_on()


def test_the_velocity_is_drawn_if_grains_reenter(tmp_path):
    box = Box(low=(-0.02,) * 3, high=(0.02,) * 3)
    tisim.run(scene(**MOVING, domain=box), record=Recording(tmp_path / "t.h5", frames=4))
    with frames(tmp_path / "t.h5") as trajectory:
        centre = quantities(trajectory).axes[1]
    assert "velocity" in centre.get_ylabel()
    np.testing.assert_allclose(centre.lines[0].get_ydata(), 2.5)


def test_pictures_of_an_interrupted_run_state_the_missing_time(file, tmp_path):
    """The same frames, for a run with twice the duration."""
    longer = scene(**{**MOVING, "steps": 8})
    with frames(file) as trajectory, Trajectory(tmp_path / "t.h5", [longer]) as begun:
        assert mark_missing(quantities(trajectory), trajectory).get_supxlabel() == ""
        for frame in trajectory:
            begun.write(0, frame)
    with frames(tmp_path / "t.h5") as trajectory:
        figures = [mark_missing(draw(trajectory), trajectory) for draw in (clouds, quantities)]
    for figure in figures:
        message = "the run has come to t = 0.004 s of 0.008 s; what follows is missing"
        assert figure.get_supxlabel() == message
    assert [axis.get_title("left").split(",")[0] for axis in figures[0].axes] == [
        "(a) start",
        "(b) last frame",
    ]


def test_clouds_are_of_the_first_and_last_frame(file):
    with frames(file) as trajectory:
        start, end = clouds(trajectory).axes
    titles = [axis.get_title("left").split(":")[0] for axis in (start, end)]
    assert titles == ["(a) start, t = 0 s", "(b) end, t = 4 ms"]


def test_start_and_end_are_on_one_scale_with_the_axes_of_space_and_gravity():
    """A cloud that expands tenfold in open space."""
    states = [{"position": k * np.eye(3), "radius": np.full(3, 0.1)} for k in (1.0, 10.0)]
    for effects, letters in (((), "xyz"), ((tisim.effects.Gravity(acceleration=(0, 0, -2.0)),), "xyzg")):
        made = SimpleNamespace(domain=Open(), effects=effects, materials={})
        figure = start_and_end(states, (0.0, 1.0), made)
        left, right = figure.axes
        assert left.get_xlim() == right.get_xlim()
        assert left.get_ylim() == right.get_ylim()
        heights = {
            text.get_text(): text.get_position()[1] for text in right.texts if text.get_text() in "xyzg"
        }
        assert "".join(sorted(filter(None, heights), key="xyzg".index)) == letters
        assert "g" not in heights or heights["g"] < heights["x"] < heights["z"]


def test_a_movie_has_all_frames_and_they_differ(file, tmp_path):
    fractions = []
    with frames(file) as trajectory:
        movie(trajectory, tmp_path / "t.gif", 10, fractions.append)
    assert fractions[-1] == 1.0
    assert [path.name for path in tmp_path.iterdir()] == ["t.gif"]
    with Image.open(tmp_path / "t.gif") as read:
        assert read.n_frames == 5
        assert read.info["duration"] == 100
        pictures = []
        for k in range(5):
            read.seek(k)
            pictures.append(np.asarray(read.convert("RGB")).astype(int))
    assert all(np.abs(a - b).max() > 100 for a, b in itertools.pairwise(pictures))


def test_the_note_of_an_interrupted_run_is_complete_and_covers_nothing(file, tmp_path, monkeypatch):
    """In the narrowest picture, with numbers of all digits."""
    pages = []

    def grab(writer, **more):
        figure = writer.fig
        figure.draw_without_rendering()
        pages.append([(part, part.get_window_extent()) for part in (*figure.texts, *figure.axes)])

    monkeypatch.setattr(PillowWriter, "grab_frame", grab)
    monkeypatch.setattr(PillowWriter, "finish", lambda writer: None)
    message = "the run has come to t = 1.83413e-06 s of 1.23457e-05 s; what follows is missing"
    monkeypatch.setattr(Frames, "missing", message)
    with frames(file) as trajectory:
        movie(trajectory, tmp_path / "t.gif")
    assert len(pages) == 5
    for parts in pages:
        ((note, place),) = [pair for pair in parts if getattr(pair[0], "get_text", str)() == message]
        whole = note.figure.bbox
        assert whole.x0 < place.x0 < place.x1 < whole.x1
        others = [other for part, other in parts if part is not note]
        assert len(others) == 2, "caption, grains"
        assert not any(place.overlaps(other) for other in others)


def test_movies_that_cannot_be_made_are_refused(file, tmp_path, monkeypatch):
    monkeypatch.setattr(FFMpegWriter, "isAvailable", lambda: False)
    monkeypatch.setattr("tisim.plotting.movie.FFMPEG", "absent_module")
    with frames(file) as trajectory:
        for name, rate, message in (
            (
                "t.mp4",
                20,
                r"movie must be a .gif, as there is no ffmpeg .*tisim\[movie\].*; received 't.mp4'",
            ),
            ("t.avi", 20, r"movie must be a .gif or .mp4 file; received 't.avi'"),
            ("t.gif", 0, "frames a second must be 1 to 100; received 0"),
        ):
            with pytest.raises(InputError, match=message):
                movie(trajectory, tmp_path / name, rate)
    assert list(tmp_path.iterdir()) == []


def test_an_mp4_is_written_by_the_ffmpeg_of_the_extra(file, tmp_path, monkeypatch):
    """Also on a machine without ffmpeg; the film has all frames."""
    carried = pytest.importorskip("imageio_ffmpeg")
    monkeypatch.setitem(matplotlib.rcParams, "animation.ffmpeg_path", "no-such-ffmpeg")
    with frames(file) as trajectory:
        movie(trajectory, tmp_path / "t.mp4", 10, look=Look.of("speed", "30,20"))
    assert [path.name for path in tmp_path.iterdir()] == ["t.mp4"]
    count, seconds = carried.count_frames_and_secs(str(tmp_path / "t.mp4"))
    assert (count, seconds) == (5, pytest.approx(0.5))
    # Its reader of frames does not close its pipes.
    words = [carried.get_ffmpeg_exe(), "-v", "error", "-i", str(tmp_path / "t.mp4"), "-f", "rawvideo"]
    raw = subprocess.run([*words, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
    pictures = np.frombuffer(raw, np.uint8).reshape(5, -1).astype(int)
    assert all(np.abs(a - b).max() > 50 for a, b in itertools.pairwise(pictures))
    assert matplotlib.rcParams["animation.ffmpeg_path"] == "no-such-ffmpeg"
