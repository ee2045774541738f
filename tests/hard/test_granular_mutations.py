"""Each contact law and wall motion is broken in a copy of the package, and a test must detect it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.hard.granular_scenes import LAWS
from tests.hard.mutations import EVERY, MUTATIONS
from tisim.components.component import Component
from tisim.effects.contact.granular.parts import ContactPart
from tisim.scene import plugins

ROOT = Path(__file__).parents[2]
ROOMS = ("tisim.effects.contact.", "tisim.effects.walls.")
UNBROKEN = {"granular", "fixed"}
"""``granular`` consists of its parts, each of which has a mutation; ``fixed`` does nothing."""


def of_the_package(contract):
    """Names of the contact laws and wall motions in the package that subclass a contract."""
    plugins.load_parts()
    return {kind.kind() for kind in contract.kinds() if kind.__module__.startswith(ROOMS)}


def test_each_law_of_contact_and_motion_of_a_wall_is_broken():
    assert set(MUTATIONS) == of_the_package(Component) - UNBROKEN
    for file, old, new, _ in EVERY.values():
        assert (ROOT / file).read_text().count(old) == 1, (file, old)
        assert old != new


def test_hard_cases_have_every_part_of_a_law():
    assert {part.kind() for law in LAWS.values() for part in law.members().values()} == of_the_package(
        ContactPart
    )


def copied(to):
    for name in ("tisim", "tests", "cases", "optimize"):
        shutil.copytree(ROOT / name, to / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", to)


def outcome(root, *tests):
    """Run pytest on tests of a copy, in double precision regardless of the precision of this session."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-m", "slow or not slow", *tests]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("TISIM_TEST_")}
    return subprocess.run(
        command, cwd=root, env={**environment, "PYTHONPATH": str(root)},
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_the_tests_pass_without_mutations(tmp_path):
    """Without this, a failing test would prove nothing about a mutation."""
    copied(tmp_path)
    done = outcome(tmp_path, *sorted({test for *_, test in EVERY.values()}))
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("part", EVERY)
def test_a_mutation_is_detected(part, tmp_path):
    file, old, new, test = EVERY[part]
    copied(tmp_path)
    (tmp_path / file).write_text((ROOT / file).read_text().replace(old, new))
    done = outcome(tmp_path, test)
    assert done.returncode == 1, done.stdout[-2000:] + done.stderr[-2000:]
    # The test must fail by its own assertion, not by an error in the mutated code; pytest prints the place
    # last.
    assert re.search(r"^E +(AssertionError|assert )", done.stdout, re.MULTILINE), done.stdout[-2000:]
    assert re.search(r"^\S+:\d+: AssertionError$", done.stdout, re.MULTILINE), done.stdout[-2000:]
