"""The commands ``cases``, ``explain``, ``check`` and ``doctor`` describe cases, a scene and the machine."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.text import Text

from tisim.backend import runtime
from tisim.cli import scene_arguments, targets
from tisim.cli.options import (
    Absent,
    Arithmetic,
    CaseName,
    Changes,
    Device,
    Plugins,
    Precision,
    SceneVariant,
    Seed,
    Size,
    Target,
    Threads,
)
from tisim.console import err, out, plain_table
from tisim.errors import RunError

VERDICTS = {True: Text("pass", "green"), False: Text("FAIL", "bold red"), None: Text("")}
"""The text printed for a check that passes, one that fails, and a value that is shown without a check."""
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


def check(
    case: CaseName, device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0,
    arithmetic: Arithmetic = "strict",
    plugins: Plugins = None,
) -> None:  # fmt: skip
    """Run the checks of a case; exit code 1 if one fails."""
    checks = targets.case(case).check()
    runtime.init(device, precision, threads, arithmetic)
    table = plain_table("check", "measured", "expected", "off by", "allowed", "")
    outcomes: list[bool | None] = []
    with err().status("checking") as status:
        for item in checks:
            # A value that is only shown has no verdict.
            ok = None if item.ok is None else bool(item.ok)
            outcomes.append(ok)
            table.add_row(item.name, *item.cells, VERDICTS[ok])
            status.update(f"checked: {item.name}")
    out().print(table)
    failed, passed = outcomes.count(False), outcomes.count(True)
    if failed:
        raise RunError(f"{failed} of {failed + passed} checks failed")


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
