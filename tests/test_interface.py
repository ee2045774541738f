"""Public imports: every name is available, and nothing is loaded before it is used."""

import ast
import importlib
import json
import subprocess
import sys
from pathlib import Path

import pytest

import tisim
from tisim.components.component import Component
from tisim.components.serialization import load
from tisim.packing import Placement

FAMILIES = ("effects", "geometry", "shapes", "sources", "operators", "steppers", "packing")
HEAVY = ("taichi", "quadrants", "numpy", "scipy", "pydantic", "h5py", "matplotlib")


def parts(family):
    """Names of all components of scenes that the modules of a family define, including contracts."""
    package = importlib.import_module(f"tisim.{family}")
    load(package)
    inside = (module for name, module in sys.modules.items() if name.startswith(f"tisim.{family}."))
    return {
        name
        for module in list(inside)
        for name, value in vars(module).items()
        if isinstance(value, type) and issubclass(value, Component) and value.__module__ == module.__name__
    }


@pytest.mark.parametrize("family", FAMILIES)
def test_families_export_all_their_parts(family):
    package = importlib.import_module(f"tisim.{family}")
    missing = {name for name in parts(family) if not name.startswith("_")} - set(dir(package))
    # Base classes shared by laws of one family, which users do not name.
    shared = {
        "AtIntervals",
        "Attempts",
        "BehindPlanes",
        "DipolePairs",
        "Dipoles",
        "EwaldPairs",
        "FilledPart",
        "FilledRegion",
        "GrainShapes",
        "Mixture",
        "PackingStepper",
        "Rods",
        "Shaped",
        "Superquadrics",
    }
    assert missing <= shared | {"LinearSpheres", "Pairwise", "Uniform"}


@pytest.mark.parametrize(
    "name", ["", *(f".{family}" for family in FAMILIES), ".accuracy", ".analysis", ".report", ".testing"]
)
def test_every_listed_name_exists(name):
    package = importlib.import_module(f"tisim{name}")
    listed = Path(package.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    names = {alias.name for node in ast.parse(listed).body for alias in node.names}
    assert names <= set(dir(package))
    for one in names:
        assert getattr(package, one) is not None


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Nothing"):
        _ = tisim.Nothing


def test_importing_tisim_loads_nothing_heavy():
    code = f"import tisim, json, sys; print(json.dumps([m for m in {HEAVY} if m in sys.modules]))"
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(completed.stdout) == []


def test_names_of_families_equal_top_level_names():
    assert tisim.RandomInBox is tisim.packing.RandomInBox
    assert issubclass(tisim.Lattice, Placement)
    assert callable(tisim.accuracy.study)
