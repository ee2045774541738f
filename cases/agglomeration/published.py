"""The six best individuals of Z04 (tables 1-3) are run again and compared with the published values.

    python -m tisim.cases.agglomeration.published [--grains 1000] [--starts 48] [--sensitivity]

With ``--sensitivity`` the first individual is also run with one assumption changed at a time.
"""

import argparse
from collections.abc import Callable, Mapping

import numpy as np
from rich.console import Console
from rich.table import Table

import tisim
from tisim import Scene
from tisim.cases.agglomeration.problem import cost
from tisim.cases.agglomeration.scene import PUBLISHED_COSTS, designs, scene
from tisim.numerics.statistics import half_width
from tisim.steppers import ApproachTime, Verlet


def changed(control: ApproachTime) -> Callable[[Scene], Scene]:
    """Return a function that gives a scene another step control."""
    return lambda s: s.model_copy(update={"stepper": Verlet(control=control)})


def setting(key: str, value: float | bool) -> Callable[[Scene], Scene]:
    """Return a function that changes one setting of a scene, by its dotted key."""
    return lambda s: s.replace({key: value})


CHANGES: Mapping[str, Callable[[Scene], Scene]] = {
    "as published": lambda s: s,
    "steps of at least 1e-7 s": changed(ApproachTime(shortest=1e-7)),
    "steps of at least 1e-5 s": changed(ApproachTime(shortest=1e-5)),
    "steps of at least 1e-4 s": changed(ApproachTime(shortest=1e-4)),
    "grains meet across the faces too": setting("domain.images", True),
    "friction ten times": setting("effects.friction.coefficient", 0.13456),
    "no work of deformation": lambda s: s.without("deformation_work"),
    "no reaction": lambda s: s.without("reaction"),
    "no softening": lambda s: s.without("softening"),
    "hardness a quarter": setting("effects.impact.hardness", 0.25 * 0.26548e6),
    "four times as long": lambda s: s.model_copy(update={"duration": 4 * s.duration}),
}  # fmt: skip


def estimate(scenes: list[Scene]) -> tuple[float, float]:
    """Return the mean of Pi and half of its 95 % confidence interval."""
    values = np.array([cost(result) for result in tisim.run(scenes)])
    return float(values.mean()), float(half_width(values))


def main() -> None:
    """Run the published individuals and print the results beside the values of Z04."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--grains", type=int, default=1000)
    parser.add_argument("--starts", type=int, default=48)
    parser.add_argument("--sensitivity", action="store_true")
    options = parser.parse_args()
    console = Console()

    table = Table(
        "rank", "Pi of Z04", "Pi here, 95 % CI", "n_f of Z04", "n_f here", title="Published individuals"
    )
    for rank, (design, published) in enumerate(zip(designs(), PUBLISHED_COSTS, strict=True), start=1):
        mean, half = estimate([scene(design, seed, options.grains) for seed in range(options.starts)])
        table.add_row(
            str(rank), f"{published:.3f}", f"{mean:.4f} ± {half:.4f}",
            f"{1000 * (1 - published) ** 3:.1f}", f"{options.grains * (1 - mean) ** 3:.1f}",
        )  # fmt: skip
    console.print(table)

    if options.sensitivity:
        table = Table("individual 1 with", "Pi, 95 % CI", title="One assumption changed at a time")
        for name, change in CHANGES.items():
            scenes = [change(scene(designs()[0], seed, options.grains)) for seed in range(options.starts)]
            mean, half = estimate(scenes)
            table.add_row(name, f"{mean:.4f} ± {half:.4f}")
        console.print(table)


if __name__ == "__main__":
    main()
