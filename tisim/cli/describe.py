"""The commands ``cases``, ``explain`` and ``doctor`` describe cases, a scene and the machine."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.text import Text

from tisim.backend import runtime
from tisim.cli import scene_arguments
from tisim.cli.options import (
    Absent,
    Changes,
    Device,
    Plugins,
    Precision,
    SceneVariant,
    Seed,
    Size,
    Target,
)
from tisim.console import err, out, plain_table

Everything = Annotated[
    bool,
    typer.Option(
        "--all", help="Also show each field, each phase of a step, sources and the effects left out."
    ),
]


def cases() -> None:
    """List the cases."""
    from tisim.cases.case import every

    for case in every().values():
        out().print(Text.assemble((case.name, "bold"), f"  {case.title}\n    {case.source}"))
        table = plain_table()
        for name, size in case.sizes.items():
            usual = "; default of tisim cost" if name == case.cost_size else ""
            table.add_row(f"    --size {name}", f"{size.summary}{usual}")
        if case.scenes:
            table.add_row("    --variant NAME", f"of tisim run: {', '.join(case.scenes)}")
        if case.problem is not None:
            for variant in case.variants:
                problem = case.problem("default", variant)
                table.add_row(
                    f"    --variant {variant}", f"of tisim optimize: {problem.description or problem.title}"
                )
        out().print(table)


def explain(
    target: Target, absent: Absent = None, changes: Changes = None, seed: Seed = None,
    size: Size = None, device: Device = "cpu", precision: Precision = "f64", plugins: Plugins = None,
    everything: Everything = False, variant: SceneVariant = None,
) -> None:  # fmt: skip
    """Describe a scene: effects, memory, stepper and steps.

    It also lists the kinds of effects that the scene leaves out, and their cost.
    """
    from tisim.describe.explain import brief, explain, render

    runtime.init(device, precision)
    _, scene = scene_arguments.load_scene(target, size, seed, absent or (), changes or (), variant)
    with err().status("compiling"):
        explanation = explain(scene)
    out().print(render(explanation) if everything else brief(explanation))


def doctor() -> None:
    """Report processor, memory, devices and versions of this machine.

    It also times the kernel compilers that are installed.
    """
    from tisim.describe.diagnostics import findings

    table = plain_table()
    with err().status("measuring"):
        for finding in findings():
            table.add_row(finding.name, finding.value, finding.note)
    out().print(table)
