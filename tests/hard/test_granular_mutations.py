"""Each part of a granular law is broken in a copy of the package, and a test must see it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.hard.granular_scenes import LAWS

ROOT = Path(__file__).parents[2]
LAW = "tisim/effects/contact/granular"
PARTS = "tests/effects/contact/test_granular_parts.py::test_"
MUTATIONS = {
    "hooke": (
        f"{LAW}/hooke.py", "(w, pair) * overlap", "(w, pair) * overlap * 1.01",
        f"{PARTS}hooke_pushes_like_a_spring_and_damping_goes_by_speed",
    ),
    "hertz_material": (
        f"{LAW}/hertz.py", "2.0 / 3.0", "0.66", f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
    "jkr": (
        f"{LAW}/jkr.py", "1.5 * (ratio", "1.4 * (ratio",
        f"{PARTS}jkr_begins_at_contact_lasts_beyond_it_and_pulls_three_pi_gamma_r_at_most",
    ),
    "restitution_damping": (
        f"{LAW}/restitution.py", "hypot(logarithm, math.pi)", "hypot(logarithm, 3.0)",
        f"{PARTS}beside_hookes_spring_an_impact_has_the_restitution_too",
    ),
    "viscoelastic_damping": (
        f"{LAW}/viscoelastic.py", "* stiffness", "* stiffness * 1.1",
        f"{PARTS}viscoelastic_restitution_falls_as_the_fifth_root_of_the_speed",
    ),
    "constant_damping": (
        f"{LAW}/constant.py", "+ 0.0 * stiffness", "+ 1e-3 * stiffness",
        f"{PARTS}hooke_pushes_like_a_spring_and_damping_goes_by_speed",
    ),
    "mindlin_displacement": (
        f"{LAW}/mindlin.py", "known / spring, 0.0)", "0.9 * known / spring, 0.0)",
        f"{PARTS}the_displacement_of_mindlins_spring_is_remembered_whatever_the_pressure",
    ),
    "linear_spring": (
        f"{LAW}/mindlin.py", "return self.stiffness_ratio", "return 0.9 * self.stiffness_ratio",
        f"{PARTS}a_linear_spring_is_remembered_and_slides",
    ),
    "mindlin_force": (
        f"{LAW}/mindlin.py", "elastic = turned(elastic, normal) + spring * dt * sliding",
        "elastic = spring * dt * sliding",
        "tests/effects/contact/test_walls.py::test_a_grain_between_two_walls_hangs_by_mindlins_springs",
    ),
    "viscous_friction": (
        f"{LAW}/viscous.py", "grip *= most / ti.sqrt(square)", "grip *= 1.0",
        f"{PARTS}viscous_friction_forgets",
    ),
    "rolling_cdt": (
        f"{LAW}/rolling.py", "share * rolling, past", "-share * rolling, past",
        f"{PARTS}a_constant_torque_holds_back_rolling_at_any_speed",
    ),
    "rolling_epsd": (
        f"{LAW}/rolling.py", "2.25 * friction", "2.0 * friction",
        "tests/effects/contact/test_compositions.py::test_one_step_and_some_hundred_are_those_of_the_twin[jkr]",
    ),
    "rolling_sds": (
        f"{LAW}/rolling.py", "return grip, known / spring", "return grip, drawn",
        f"{PARTS}a_spring_against_rolling_holds_up_to_its_limit_and_is_left_at_once",
    ),
    "twisting_marshall": (
        f"{LAW}/twisting.py", "0.5 * circle * circle", "circle * circle",
        f"{PARTS}a_spring_against_twisting_holds_up_to_its_limit_and_is_left_at_once",
    ),
    "twisting_sds": (
        f"{LAW}/twisting.py", "self.arm(w, pair) * limit", "self.arm(w, pair) * limit * 1.1",
        f"{PARTS}a_spring_against_twisting_holds_up_to_its_limit_and_is_left_at_once",
    ),
    "sjkr": (
        f"{LAW}/cohesion.py", "2.0 * ti.math.pi", "ti.math.pi", f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
    "dmt": (
        f"{LAW}/cohesion.py", "adhesive: ClassVar[bool] = True", "adhesive: ClassVar[bool] = False",
        f"{PARTS}cohesion_pulls_while_surfaces_touch",
    ),
}  # fmt: skip
"""By part: a file, what is in it once, what it becomes, and a test that must fail then."""
HERTZ_MINDLIN = "tests/effects/contact/test_hertz_mindlin.py::test_"
SHARED = {
    "eased": (
        f"{LAW}/spring.py", "ti.min(stiffness", "ti.max(stiffness",
        f"{HERTZ_MINDLIN}a_closed_path_yields_no_work",
    ),
    "turned": (
        f"{LAW}/spring.py", "known *= ti.sqrt(size / (size - out * out))", "known *= 1.0",
        f"{HERTZ_MINDLIN}what_is_remembered_turns_with_the_pair",
    ),
    "slipping": (
        f"{LAW}/spring.py", "known = grip - drag", "known = elastic",
        f"{HERTZ_MINDLIN}coulombs_limit_holds_with_the_damping_and_is_left_at_once",
    ),
    "can_follow": (
        f"{LAW}/spring.py", "2.0 * damping * dt", "0.0 * damping * dt",
        "tests/effects/contact/test_granular_input.py"
        "::test_what_no_step_can_follow_stops_the_world_and_is_named",
    ),
}  # fmt: skip
"""The same of what several parts share."""
EVERY = {**MUTATIONS, **SHARED}


def test_each_part_of_a_law_is_broken():
    parts = {part.kind() for law in LAWS.values() for part in law.members().values()}
    assert set(MUTATIONS) == parts
    for file, old, new, _ in EVERY.values():
        assert (ROOT / file).read_text().count(old) == 1, (file, old)
        assert old != new


def copied(to):
    for name in ("tisim", "tests", "cases", "optimize"):
        shutil.copytree(ROOT / name, to / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", to)


def outcome(root, *tests):
    """What pytest says of tests in a copy, which run in double precision whatever this one runs in."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-m", "slow or not slow", *tests]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("TISIM_TEST_")}
    return subprocess.run(
        command, cwd=root, env={**environment, "PYTHONPATH": str(root)},
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_the_tests_pass_where_nothing_is_broken(tmp_path):
    """Else one that fails would say nothing."""
    copied(tmp_path)
    done = outcome(tmp_path, *sorted({test for *_, test in EVERY.values()}))
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("part", EVERY)
def test_a_test_sees_what_is_broken(part, tmp_path):
    file, old, new, test = EVERY[part]
    copied(tmp_path)
    (tmp_path / file).write_text((ROOT / file).read_text().replace(old, new))
    done = outcome(tmp_path, test)
    assert done.returncode == 1, done.stdout[-2000:] + done.stderr[-2000:]
    # An assertion of the test itself, and no error in what was broken: where it was raised is said last.
    assert re.search(r"^E +(AssertionError|assert )", done.stdout, re.MULTILINE), done.stdout[-2000:]
    assert re.search(r"^\S+:\d+: AssertionError$", done.stdout, re.MULTILINE), done.stdout[-2000:]
