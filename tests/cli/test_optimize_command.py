"""tisim optimize and tisim cache, on a problem that takes seconds."""

import csv

import numpy as np
import pytest

from tisim import Box, Cloud, Scene
from tisim.cases import case as catalogue
from tisim.cases.case import Case, Size
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.problem import Problem
from tisim.optimize.storage.cache import Cache
from tisim.plotting.cloud import cloud
from tisim.steppers import FixedStep, Verlet


def spread(result):
    """Mean distance from the middle, m."""
    return float(np.linalg.norm(result.state["position"], axis=1).mean())


def toy_problem(size, variant):
    def scene(design, seed):
        low, high = (-design["half_side"],) * 3, (design["half_side"],) * 3
        return Scene(
            particles=Cloud(number=5, radius=1e-4, density=1.0),
            domain=Box(low=low, high=high),
            stepper=Verlet(control=FixedStep(dt=1.0)),
            duration=2.0,
            seed=seed,
        )

    genome = Genome((Gene("half_side", "m", 0.01, 0.1),))
    return Problem(
        "toy",
        genome,
        scene,
        spread,
        symbol="R",
        derived={"2 R": lambda r: 2 * r},
        picture=lambda scene, result: cloud(result),
        details=lambda design, result: {
            "half side, m": design["half_side"],
            "R of one run, m": spread(result),
        },
    )


TOY = Case(
    name="toy",
    title="A toy",
    source="none",
    sizes={
        "default": Size(
            "5 grains", {}, {"method": "zohdi", "generations": 2, "options": {"population": 6, "parents": 2}}
        )
    },
    scene=lambda size, seed: None,
    check=lambda: iter(()),
    problem=toy_problem,
    variants=("only",),
)


SEARCH = ["optimize", "toy", "--out", "s", "--generations", "1", "--set", "search.ensemble.max_starts=4"]


@pytest.mark.long
def test_optimize_ends_with_all_its_files_and_resumes(tisim, tmp_path, monkeypatch, press_ctrl_c):
    monkeypatch.setattr(catalogue, "every", lambda: {"toy": TOY})
    with monkeypatch.context() as patch:
        press_ctrl_c(patch, after=9)
        code, _, err = tisim(*SEARCH)
    assert code == 130
    assert "give the same command again" in " ".join(err.split())
    code, out, err = tisim(*SEARCH)
    assert code == 0
    assert "2 R" in out
    assert "half side, m" in out
    names = {
        "search.h5",
        "best.csv",
        "sensitivity.csv",
        "sensitivity.png",
        "convergence.png",
        "convergence.pdf",
        "best_scene.toml",
        "best_cloud.png",
        "best_run.csv",
    }
    assert names <= {path.name for path in (tmp_path / "s").iterdir()}
    heading, (name, side), (_, distance) = csv.reader((tmp_path / "s/best_run.csv").read_text().splitlines())
    assert (heading, name) == (["quantity", "value"], "half side, m")
    assert 0.01 < float(side) < 0.1
    assert 0 < float(distance) < 2 * float(side)
    assert "generation   1  best R" in err
    evaluations = len(Cache(tmp_path / "s/search.h5"))
    assert tisim(*SEARCH)[0] == 0
    assert len(Cache(tmp_path / "s/search.h5")) == evaluations
    code, _, err = tisim(*SEARCH, "--fresh")
    assert code == 2
    assert "--overwrite" in err
    code, out, _ = tisim("cache", "s/search.h5")
    assert code == 0
    assert out.split("\n")[1].split()[:2] == ["toy", str(evaluations)]
    assert tisim("cache", "s/search.h5", "--verify")[0] == 0
    assert tisim("cache", "s/search.h5", "--compact")[1].startswith(f"{evaluations} evaluations kept")
    about = Cache(tmp_path / "s/search.h5").tables()
    assert any(name.endswith("hall_of_fame") for name in about)
