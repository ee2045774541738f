"""Files written by tisim new work, and their tests pass."""

import pytest

from tisim.cli import new
from tisim.files import python_file
from tisim.scene import plugins


def run_tests(name):
    """Run the tests beside a file that has been loaded."""
    tests = [test for word, test in vars(plugins.load(f"test_{name}.py")).items() if word.startswith("test_")]
    assert tests
    for test in tests:
        test()


PARTS = {
    "pair": (["effect", "soft_law"], "return -self.strength(w)", "return self.strength(w)"),
    "external": (["effect", "own_spring", "--kind", "external"], "return -self", "return -2.0 * self"),
    "contact_part": (
        ["contact_part", "own_glue"],
        "return self.coverage(w)",
        "return 2.0 * self.coverage(w)",
    ),
    "operator": (["operator", "condensing"], "** 3", "** 2"),
    "source": (["source", "sheared_flow"], "0.0, 0.0, rate]", "0.0, rate, 0.0]"),
    "stepper": (["stepper", "own_euler"], "+= dt / s.mass", "+= 0.9 * dt / s.mass"),
}
"""Arguments of the command, and an error put into the written law, for each template."""


@pytest.mark.long
@pytest.mark.parametrize(
    "template",
    [pytest.param(part, marks=() if part == "pair" else pytest.mark.slow) for part in PARTS],
)
def test_a_part_of_scenes(tisim, own_file, tmp_path, template):
    words, law, slip = PARTS[template]
    name = words[1]
    code, out, err = tisim("new", *words)
    assert code == 0, err
    *files, advice = out.splitlines()
    assert files == [f"{name}.py", f"test_{name}.py", f"{name}.toml"]
    assert advice == f"to try it: tisim run {name}.toml --plugin {name}.py; python -m pytest test_{name}.py"
    code, _, err = tisim("run", f"{name}.toml", "--plugin", f"{name}.py")
    assert code == 0, err
    run_tests(name)
    text = (tmp_path / f"{name}.py").read_text()
    assert text.count(law) == 1
    own_file(f"{name}.py", text.replace(law, slip))
    python_file.unload(f"test_{name}")
    plugins.load(f"{name}.py")
    with pytest.raises(AssertionError):
        run_tests(name)


@pytest.mark.long
def test_a_case(tisim, own_file):
    assert tisim("new", "case", "my_fall")[0] == 0
    code, out, _ = tisim("check", "my_fall.py")
    assert code == 0
    assert "pass" in out
    assert tisim("run", "my_fall.py", "--size", "small")[0] == 0
    run_tests("my_fall")


@pytest.mark.long
def test_a_problem(tisim, own_file):
    assert tisim("new", "problem", "my_throw")[0] == 0
    code, out, err = tisim("optimize", "my_throw.py", "--generations", "1")
    assert code == 0, err
    assert "miss (m)" in out
    run_tests("my_throw")


UNIQUE = "a name that no other effect, operator, source or stepper has"
KEPT = ("there.py", "test_tested.py", "settled.toml")
WRONG = [
    (["law", "soft_law"], f"WHAT must be one of {', '.join(new.USES)}; received 'law'"),
    (
        ["efect", "x"],
        f"WHAT must be one of {', '.join(new.USES)}; received 'efect'; did you mean 'effect'?",
    ),
    (["effect", "x", "--kind", "trio"], "--kind must be one of pair, external; received 'trio'"),
    (["source", "x", "--kind", "pair"], "--kind must be given for an effect only; received 'pair'"),
    (["effect", "SoftLaw"], "name must be a lower-case Python identifier; received 'SoftLaw'"),
    (["effect", "class"], "name must be a lower-case Python identifier; received 'class'"),
    (["case", "json"], "name must be a name that no other Python module has; received 'json'"),
    (
        ["effect", "gravity"],
        f"name must be {UNIQUE}; received 'gravity'",
    ),
    (
        ["stepper", "verlet"],
        f"name must be {UNIQUE}; received 'verlet'",
    ),
    (
        ["effect", "my_x_law"],
        "name must be words of two letters or more, such as my_xlaw; received 'my_x_law'",
    ),
    (["operator", "settled"], "settled.toml must be a new file; it already exists"),
    (["effect", "there"], "there.py must be a new file; it already exists"),
    (["effect", "tested"], "test_tested.py must be a new file; it already exists"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(words) for words, _ in WRONG])
def test_nothing_is_overwritten_and_wrong_names_are_refused(tisim, own_file, tmp_path, arguments, message):
    for file in KEPT:
        own_file(file, "kept")
    code, out, err = tisim("new", *arguments)
    assert (code, out, err) == (2, "", f"{message}\n")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(KEPT, "kept")
