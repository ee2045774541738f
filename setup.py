"""The folders optimize and cases are installed as tisim.optimize and tisim.cases; for the rest see
pyproject.toml."""

from setuptools import find_packages, setup

setup(
    packages=[
        *find_packages(include=["tisim", "tisim.*"]),
        "tisim.cli.templates",
        *(f"tisim.{name}" for name in find_packages(include=["optimize*", "cases*"])),
    ],
    package_dir={"tisim.optimize": "optimize", "tisim.cases": "cases"},
)
