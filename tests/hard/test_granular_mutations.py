"""Each part of a granular law is broken in a copy of the package, and a test must see it."""

import os
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


def test_each_part_of_a_law_is_broken():
    parts = {part.kind() for law in LAWS.values() for part in law.members().values()}
    assert set(MUTATIONS) == parts
    for file, old, new, _ in MUTATIONS.values():
        assert (ROOT / file).read_text().count(old) == 1, (file, old)
        assert old != new


@pytest.mark.slow
@pytest.mark.parametrize("part", MUTATIONS)
def test_a_test_sees_what_is_broken(part, tmp_path):
    file, old, new, test = MUTATIONS[part]
    for name in ("tisim", "tests", "cases", "optimize"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    source = (ROOT / file).read_text()
    (tmp_path / file).write_text(source.replace(old, new))
    command = [sys.executable, "-m", "pytest", "-n", "0", "-q", "-x", "-m", "slow or not slow", test]
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 1, done.stdout[-2000:] + done.stderr[-2000:]
    assert "AssertionError" in done.stdout or "assert " in done.stdout
