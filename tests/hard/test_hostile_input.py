"""Thousands of kinds of hostile input: each is accepted or refused in one line, within a second."""

import time
import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests import hostile
from tests.judged import ACCEPTED, check_file, check_message, command, nothing_runs
from tisim import InputError, Scene
from tisim.cli import scene_arguments

pytestmark = pytest.mark.long

EXAMPLES = settings(
    max_examples=200, derandomize=True, database=None, deadline=None, suppress_health_check=list(HealthCheck)
)
"""The examples are the same in every run; wall time is not bounded, because it depends on machine load."""
FEWER = settings(EXAMPLES, max_examples=40)
RANDOM = st.randoms(use_true_random=False)


@pytest.fixture(scope="module", autouse=True)
def warm():
    """The valid scenes that are mutated; also imports all modules that they need."""
    return hostile.valid()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A scene file that the tests overwrite."""
    return tmp_path_factory.mktemp("hostile") / "scene.toml"


def judge(make, file):
    """The scene is accepted and survives a round trip through a file, or is refused with a message.

    Either takes less than a second of CPU time.
    """
    began = time.thread_time()
    try:
        accepted = make()
    except InputError as fault:
        check_message(str(fault))
        accepted = None
    assert time.thread_time() - began < 1.0
    if accepted is not None:
        check_file(accepted, file)


def test_the_unmutated_scenes_are_valid(warm, file):
    assert len(warm) > 60
    for data in warm:
        check_file(Scene.from_dict(data), file)


@EXAMPLES
@given(random=RANDOM)
def test_plain_data(file, random):
    data = hostile.mutated(random)
    judge(lambda: Scene.from_dict(data), file)


@EXAMPLES
@given(random=RANDOM)
def test_files(file, random):
    file.write_bytes(hostile.mutated_toml(random))
    judge(lambda: Scene.from_toml(file), file)


@EXAMPLES
@given(random=RANDOM)
def test_settings(warm, file, random):
    data = random.choice(warm)
    change = hostile.assignment(data, random)
    judge(lambda: Scene.from_dict(data).replace(scene_arguments.assignments([change])), file)


NUMBERS = ("-1", "0", "nan", "x", "", "1" + "0" * 23, "9" * 5000)
NAMES = ("", "x" * 300, "a\x00b", "/", "a\nb", "\udcff", "none.toml")
NUMBERED = {
    ("run", "SCENE"): ("--threads", "--seed", "--every"),
    ("cost", "SCENE"): ("--error", "--coarser", "--repeats", "--starts"),
    ("optimize", "agglomeration"): ("--population", "--target", "--seed"),
}
NAMED = {
    ("run", "SCENE"): ("--out", "--size", "--device", "--precision", "--arithmetic", "--without"),
    ("optimize", "agglomeration"): ("--size", "--variant", "--method", "--out"),
}
TARGETS = ("run", "explain", "check", "cache", "plot", "export", "movie", "figures", "cost")
SEARCH = (
    "self=1", "options.self=1", "options=3", "method=[]", "method=3", "ensemble=[]", "seed=" + "9" * 5000,
    "=1", ".".join("a" * 20_000) + "=1", "options.population=1e400", "generations=[" + "[" * 5000, "kind",
)  # fmt: skip
COMMANDS = (
    *((*words, option, NUMBERS) for words, options in NUMBERED.items() for option in options),
    *((*words, option, NAMES) for words, options in NAMED.items() for option in options),
    *((target, NAMES) for target in TARGETS),
    ("optimize", "agglomeration", "--executor", ("processes:0", "processes:x", "processes:" + "9" * 30)),
    ("optimize", "agglomeration", "--set", tuple(f"search.{key}" for key in SEARCH)),
)
"""Words of a command, and values for its last word."""


@pytest.mark.parametrize("words", COMMANDS, ids=[" ".join(words[:-1])[:40] for words in COMMANDS])
def test_commands(words, tmp_path, monkeypatch):
    """Refused commands print one line to standard error and exit with code 2, for any arguments."""
    monkeypatch.chdir(tmp_path)
    scene = tmp_path / "scene.toml"
    scene.write_text(Scene.from_dict(hostile.valid()[1]).to_toml())
    with nothing_runs():
        for last in words[-1]:
            arguments = [str(scene) if word == "SCENE" else word for word in (*words[:-1], last)]
            code, err = command(arguments)
            if ACCEPTED not in err and code != 0:
                assert code == 2, (last[:50], err)
                assert len(err.strip().splitlines()) == 1, (last[:50], err)
                assert len(err) < 1500


@FEWER
@given(random=RANDOM)
def test_run_of_a_hostile_file(file, random):
    file.write_bytes(hostile.mutated_toml(random))
    words = ["run", str(file)]
    for _ in range(random.randrange(3)):
        words += ["--set", hostile.assignment(random.choice(hostile.valid()), random)]
    with nothing_runs():
        code, err = command([*words, "--out", str(file.parent / "run")])
    if code == 2:
        check_message(err.strip())
    else:
        assert (code, err.strip()) == (1, ACCEPTED)


def test_received_values_are_shortened():
    """Ten million characters, a number of 100,000 digits and a list of 100,000 levels are shortened to about
    200 characters."""
    for value in (
        "x" * 10**7,
        10**100_000,
        hostile.nested(100_000),
        {"a": hostile.tables(1000)},
        b"x" * 10**6,
    ):
        with pytest.raises(InputError) as fault:
            Scene.from_dict({"particles": value, "duration": 1.0})
        assert str(fault.value).startswith(("particles must be a table; received", "particles.kind must be"))
        assert len(str(fault.value)) < 300
    with pytest.raises(InputError, match=r"^scene must be a table; received 3$"):
        Scene.from_dict(3)


def test_odd_names_come_back_from_a_file(file):
    """Keys that TOML must quote, characters beyond 16 bits, and characters that must be escaped."""
    data = dict(hostile.valid()[1])
    for name in ("a b", "a.b", "", "größer", "😀", '"', "\\", "\n", "\x00", "\x7f", "\u2028", "#", "[x]"):
        quantities = {name: [1.0, 2.0], "temperature": 300.0}
        scene = Scene.from_dict(
            {**data, "name": name, "particles": {**data["particles"], "quantities": quantities}}
        )
        assert tomllib.loads(scene.to_toml())["particles"]["quantities"] == quantities
        check_file(scene, file)
