"""Trajectories from the command line, and the commands that show them."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tests.files.full_disk import files_of_at_most
from tests.files.test_growing_hdf5 import STILL
from tests.files.test_growing_hdf5 import frame as grown
from tisim import Simulation
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.files import atomic, checksum
from tisim.io.reader import frames
from tisim.io.trajectory import Trajectory


def every_frame(path):
    with frames(path) as sequence:
        return list(sequence)


def test_run_plot_movie_and_export(tisim, toml, tmp_path):
    code, out, _ = tisim("run", toml, "--frames", 3)
    assert code == 0
    assert "trajectory.h5" in out
    folder = tmp_path / "out" / "flow"
    assert [round(1e3 * frame.time, 9) for frame in every_frame(folder / "trajectory.h5")] == [
        0, 0.334, 0.667, 1,
    ]  # fmt: skip
    assert tisim("plot", folder, "--out", "p")[0] == 0
    assert {path.name for path in (tmp_path / "p").iterdir()} == {".tisim", "cloud.png", "time_series.png"}
    assert tisim("movie", folder, "--to", "m/flow.gif", "--rate", 5)[0] == 0
    assert (tmp_path / "m/flow.gif").read_bytes()[:4] == b"GIF8"
    code, out, _ = tisim("export", folder, "--format", "vtk", "--out", "v")
    assert (code, out.strip()) == (0, "v/trajectory.pvd")
    assert len(list((tmp_path / "v").glob("*.vtu"))) == 4
    for command, name in (
        (("plot", folder, "--out", "u"), "time_series.png"),
        (("movie", folder, "--to", "u/flow.gif"), "flow.gif"),
        (("export", folder, "--format", "vtk", "--out", "u"), "trajectory_00003.vtu"),
        (("export", folder, "--format", "xyz", "--out", "u"), "trajectory.xyz.new"),
        (("export", folder, "--format", "h5md", "--out", "u"), "trajectory_copy.h5"),
    ):
        users = tmp_path / "u" / name
        users.parent.mkdir(exist_ok=True)
        users.write_text("the user's own")
        code, _, err = tisim(*command)
        assert code == 2
        assert "files that tisim has not written and would replace (or give --overwrite)" in err
        assert f"received 'u' with {name}" in err
        assert [(path.name, path.read_text()) for path in users.parent.iterdir()] == [
            (name, "the user's own")
        ]
        users.unlink()
    assert tisim("plot", folder)[0] == 0, "the run's own cloud.png"
    (folder / "trajectory.h5").unlink()
    code, out, _ = tisim("export", folder, "--format", "xyz")
    assert (code, out.strip()) == (0, str(folder / "result.xyz"))


def test_a_folder_without_data_to_draw_is_refused(tisim, tmp_path):
    (tmp_path / "out").mkdir()
    rule = "folder must be one with a trajectory.h5 or result.h5; received 'out', with"
    assert tisim("plot", "out") == (2, "", f"{rule} neither\n")
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "search.h5").touch()
    message = "folder must be the folder of a run; received the folder of a search, with the pictures:"
    assert tisim("plot", "s") == (2, "", f"{message} none yet\n")
    for name in ("front.png", "convergence.png"):
        (tmp_path / "s" / name).touch()
    assert tisim("plot", "s") == (2, "", f"{message} s/convergence.png, s/front.png\n")
    (tmp_path / "c").mkdir()
    for name in ("cost.h5", "cost.png"):
        (tmp_path / "c" / name).touch()
    assert tisim("plot", "c") == (2, "", f"{message.replace('search', 'study of costs')} c/cost.png\n")
    (tmp_path / "out" / "checkpoint.h5").touch()
    assert tisim("plot", "out") == (2, "", f"{rule} only the checkpoint of an unfinished run\n")


@pytest.mark.slow
def test_ctrl_c_and_resume_leave_one_whole_trajectory(tisim, toml, tmp_path, monkeypatch, press_ctrl_c):
    assert tisim("run", toml, "--every", "5e-5", "--out", "whole")[0] == 0
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=4)
        assert tisim("run", toml, "--every", "5e-5", "--out", "cut")[0] == 130
    cut = tmp_path / "cut" / "trajectory.h5"
    begun = every_frame(cut)
    code, _, err = tisim("run", toml, "--out", "cut", "--resume")
    assert code == 2
    assert "--frames or --every must be given as before, to go on with trajectory.h5" in err
    assert tisim("run", toml, "--every", "5e-5", "--out", "cut")[0] == 0
    whole, resumed = every_frame(tmp_path / "whole" / "trajectory.h5"), every_frame(cut)
    assert 0 < len(begun) < len(whole) == 21
    for frame, other in zip(resumed, whole, strict=True):
        assert (frame.time, frame.step) == (other.time, other.step)
        for name, values in frame.arrays.items():
            np.testing.assert_array_equal(values, other.arrays[name])


@pytest.mark.slow
def test_a_full_disk_keeps_earlier_frames_and_a_checkpoint(tisim, toml, tmp_path, monkeypatch):
    """The system refuses to let files grow during the run; later there is room again."""
    folder = tmp_path / "out" / "flow"

    def crowded(self, run=Simulation.run, **how):
        with files_of_at_most((folder / "trajectory.h5").stat().st_size + 60_000):
            run(self, **how)

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "run", crowded)
        code, out, err = tisim("run", toml, "--every", "5e-5")
    assert (code, out) == (1, "")
    assert "trajectory.h5 could not be written: File too large; frames before are intact" in err
    assert "checkpoint.h5 is written. To go on, make room and give the same command again" in err
    names = {path.name for path in folder.iterdir()}
    assert names == {".tisim", ".tisim.lock", "checkpoint.h5", "trajectory.h5"}
    begun = every_frame(folder / "trajectory.h5")
    assert 2 < len(begun) < 21

    code, out, err = tisim("plot", folder, "--out", "p")
    assert code == 0
    assert f"the run has come to t = {begun[-1].time:.6g} s of 0.001 s; what follows is missing" in err

    assert tisim("run", toml, "--every", "5e-5", "--resume")[0] == 0
    recorded_frames = every_frame(folder / "trajectory.h5")
    assert [frame.step for frame in recorded_frames] == list(range(0, 1001, 50))
    for frame, other in zip(begun, recorded_frames, strict=False):
        np.testing.assert_array_equal(frame.arrays["position"], other.arrays["position"])
    assert "missing" not in tisim("plot", folder, "--out", "p")[2]


@pytest.mark.parametrize("command", ["plot", "movie", "export"])
def test_damaged_trajectories_are_refused_in_a_line(tisim, tmp_path, command):
    Trajectory(tmp_path / "trajectory.h5", [STILL]).close()
    code, out, err = tisim(command, "trajectory.h5")
    assert (code, out) == (2, "")
    assert "file must be one with" in err  # followed by the number of frames
    content = (tmp_path / "trajectory.h5").read_bytes()
    for hurt in (content[: len(content) // 2], content[:9] + bytes(512) + content[521:], bytes(len(content))):
        (tmp_path / "trajectory.h5").write_bytes(hurt)
        code, out, err = tisim(command, "trajectory.h5")
        assert (code, out) == (2, "")
        assert len(err.splitlines()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["trajectory.h5"]


def test_a_full_disk_at_the_end_of_a_run_loses_nothing(tisim, toml, monkeypatch):
    replace = atomic.replace_file

    def full(path, data):
        if path.name == "result.h5":
            with files_of_at_most(0):
                replace(path, data)
        replace(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(checksum, "replace_file", full)
        code, out, err = tisim("run", toml)
    assert (code, out) == (1, "")
    assert "result.h5 could not be written: File too large; everything stored before is intact. " in err
    assert "checkpoint.h5 is written. To go on, make room" in err
    code, out, _ = tisim("run", toml, "--resume")
    assert (code, "1000" in out) == (0, True)


@pytest.mark.slow
def test_a_run_without_frames_leaves_none_of_an_earlier_run(tisim, toml, tmp_path):
    assert tisim("run", toml, "--frames", 2)[0] == 0
    assert tisim("run", toml, "--overwrite")[0] == 0
    assert not (tmp_path / "out/flow/trajectory.h5").exists()


def test_a_case_draws_its_own_pictures_and_figures(tisim, toml, tmp_path, monkeypatch):
    """plot finds the case by the scene's name; figures writes figures and tables."""
    counts = []

    def figure():
        figure_ = Figure()
        FigureCanvasAgg(figure_)
        return figure_

    def pictures(sequence):
        counts.append(len(sequence))
        return {"own.png": figure()}

    def figures(size, progress):
        progress(1.0)
        return {"many.png": figure(), "many.csv": f"size\n{size}\n"}

    text = (tmp_path / toml).read_text()
    (tmp_path / toml).write_text(text.replace('name = "scene"', 'name = "toy"'))
    sizes = {"default": Size("", {}), "small": Size("", {})}
    parts = ("toy", "A toy", "none", sizes, lambda size, seed: None, lambda: iter(()))
    toy = Case(*parts, pictures=pictures, figures=figures)
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": toy})
    assert tisim("run", toml, "--frames", 3)[0] == 0
    assert tisim("plot", "out/flow", "--out", "p")[0] == 0
    names = {path.name for path in (tmp_path / "p").iterdir()}
    assert names == {".tisim", "cloud.png", "time_series.png", "own.png"}
    assert counts == [4]
    code, out, _ = tisim("figures", "toy", "--size", "small")
    # Tables are written before figures, because drawing a figure can fail.
    assert (code, out.split()) == (0, ["out/toy-figures/many.csv", "out/toy-figures/many.png"])
    assert (tmp_path / "out/toy-figures/many.csv").read_text() == "size\nsmall\n"
    (tmp_path / "out/toy-figures/notes.txt").write_text("the user's own")
    code, _, err = tisim("figures", "toy")
    assert code == 2
    assert "(or give --overwrite); received 'out/toy-figures' with notes.txt" in err
    (tmp_path / "out/toy-figures/notes.txt").unlink()
    code, _, err = tisim("figures", "toy")
    rule = "output folder must be without finished figures (or give --overwrite)"
    assert (code, err) == (2, f"{rule}; received 'out/toy-figures'\n")
    assert tisim("figures", "toy", "--overwrite")[0] == 0
    assert (tmp_path / "out/toy-figures/many.csv").read_text() == "size\ndefault\n"
    code, _, err = tisim("figures", "toy", "--size", "huge")
    assert code == 2
    assert "size must be one of default, small; received 'huge'" in err
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": Case(*parts)})
    code, _, err = tisim("figures", "toy")
    assert code == 2
    assert "case must be one that has figures; received 'toy'" in err


def test_wrong_input(tisim, toml, tmp_path):
    for arguments, message in (
        (["run", toml, "--frames", 0], "frames must be a whole number, at least 1; received 0"),
        (
            ["run", toml, "--frames", 2, "--every", 1],
            "recording must be given frames or every; received both",
        ),
        (
            ["plot", "none.h5"],
            "file must be a trajectory.h5 or result.h5 of a run; received 'none.h5', which does not exist",
        ),
        (["movie", toml], "file must be a trajectory.h5 or result.h5 of a run; received 'flow.toml'"),
        (
            ["export", "none.h5"],
            "file must be a trajectory.h5 or result.h5 of a run; received 'none.h5', which does not exist",
        ),
    ):
        code, out, err = tisim(*arguments)
        assert (code, out) == (2, "")
        assert message in err
    assert [path.name for path in tmp_path.iterdir()] == [toml]


def test_view_crop_clip_and_colour_change_the_pictures(tisim, toml, tmp_path):
    assert tisim("run", toml, "--frames", 2)[0] == 0
    folder = tmp_path / "out" / "flow"
    pictures = {}
    for option in (
        (),
        ("--colour", "speed"),
        ("--view", "30,60"),
        ("--crop", "0,0.5,0,0.5"),
        ("--clip", "z<0"),
    ):
        assert tisim("plot", folder, "--out", "p", *option) == (0, "p/cloud.png\np/time_series.png\n", "")
        pictures[option] = (tmp_path / "p" / "cloud.png").read_bytes()
    assert len(set(pictures.values())) == 5
    movies = {}
    for option in ((), ("--color", "radius", "--clip", "z<0", "--clip", "x>-1e-3")):
        assert tisim("movie", folder, "--to", "m/a.gif", *option)[0] == 0
        movies[option] = (tmp_path / "m" / "a.gif").read_bytes()
    assert len(set(movies.values())) == 2
    assert tisim("export", folder, "--fields", "radius, mass", "--format", "xyz", "--out", "x")[0] == 0
    assert (
        "Properties=species:S:1:pos:R:3:mass:R:1:radius:R:1 " in (tmp_path / "x/trajectory.xyz").read_text()
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("plot", "--colour", "heat"), "colour must be one of "),
        (("plot", "--view", "1"), "view must be 2 numbers, azimuth,elevation in degrees; received '1'"),
        (("movie", "--crop", "1,0,0,1"), "crop must be 0 <= left < right <= 1"),
        (
            ("movie", "--clip", "x"),
            "clip must be a part of space that is kept, such as y<0.01 (m); received 'x'",
        ),
        (("plot", "--lines", "wind"), "lines must be left out in this scene; received 'wind'"),
        (("movie", "--lines", "flow"), "lines must be left out in this scene; received 'flow'"),
        (("report", "--lines", "magnetic"), "lines must be left out in this scene; received 'magnetic'"),
        (("export", "--fields", "heat"), "fields must be some of "),
        (("export", "--fields", "mass", "--format", "h5md"), "fields must be chosen for vtk or xyz, as h5md"),
    ],
)
def test_pictures_that_cannot_be_drawn_as_asked_are_refused(tisim, tmp_path, words, message):
    with Trajectory(tmp_path / "t.h5", [STILL]) as trajectory:
        trajectory.write(0, grown(3))
        trajectory.write(0, grown(4))
    command, *more = words
    code, out, err = tisim(command, "t.h5", *more)
    assert (code, out) == (2, "")
    assert err.startswith(message)
    assert [path.name for path in tmp_path.iterdir()] == ["t.h5"]
