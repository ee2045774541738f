"""The ratio of the actual error at the end to the requested error, for each control that takes an error.

    python tests/benchmarks/calibration.py [--figure docs/steppers_calibration.png]

The scenes are in tests/steppers/calibrated.py. For each scene and control, the table has the smallest and the
largest ratio of the error at the end to the requested error: over 1e-2 to 1e-6 for the trapezoid, to 1e-10
for collocation. The figure has a line for each scene. A second table covers collocation with its default
first step, and both methods in single precision, over 1e-2 to 1e-5.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from matplotlib import colormaps

from tests.steppers.calibrated import CHAOTIC, CONTROLS, KNOWN, collocation, ratios, trapezoid
from tests.steppers.test_calibration import BAND
from tisim.backend import runtime
from tisim.plotting.style import empty, letters, plain
from tisim.steppers import StageControl

Ratios = dict[str, dict[str, np.ndarray]]
BY_DEFAULT = collocation("run", StageControl().first)
SINGLE_PRECISION = 10.0 ** -np.arange(2, 6)


def table(ratios_by_control: Ratios) -> None:
    """Smallest and largest ratio for each scene, a column for each control."""
    print("| scene | " + " | ".join(ratios_by_control) + " |")
    print("|---" * (1 + len(ratios_by_control)) + "|")
    for scene in KNOWN:
        cells = [
            f"{values[scene].min():.1g} .. {values[scene].max():.1g}" for values in ratios_by_control.values()
        ]
        print(f"| {scene} | " + " | ".join(cells) + " |")


def draw(ratios_by_control: Ratios, path: Path) -> None:
    """A panel for each control; controls that aim at the end also show the documented band."""
    figure = empty(11.0, 7.6)
    panels = figure.subplots(2, 2, sharey=True).ravel()
    colours = colormaps["tab20"].colors
    for panel, (control, ratio) in zip(panels, ratios_by_control.items(), strict=True):
        tolerances = CONTROLS[control][1]
        for colour, (scene, values) in zip(colours, ratio.items(), strict=False):
            line = {"color": "black", "ls": "--"} if scene == CHAOTIC else {"color": colour}
            panel.loglog(tolerances, values, marker="o", ms=3, lw=1.2, label=scene, **line)
        if "run" in control:
            panel.axhspan(*BAND, color="0.9", zorder=0, label=f"within a factor of {BAND[1]:g}")
        panel.axhline(1.0, color="0.4", lw=0.8)
        panel.invert_xaxis()
        panel.set_title(control)
        panel.set_xlabel("error asked for")
        plain(panel)
    for panel in panels[::2]:
        panel.set_ylabel("error at the end / error asked for")
    letters(panels)
    # From the last panel, which has the band.
    handles, labels = panels[-1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper", fontsize=8, frameon=False)
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--figure", type=Path, default=Path("docs/steppers_calibration.png"))
    options = parser.parse_args()
    runtime.init(device="cpu", precision="f64")
    ratios_by_control = {control: ratios(*settings) for control, settings in CONTROLS.items()}
    table(ratios_by_control)
    draw(ratios_by_control, options.figure)
    errors = CONTROLS["Collocation, StageControl"][1]
    more = {"Collocation, by default": ratios(BY_DEFAULT, errors)}
    runtime.init(device="cpu", precision="f32")
    for name, make in (("Trapezoid, f32", trapezoid("run")), ("Collocation, by default, f32", BY_DEFAULT)):
        more[name] = ratios(make, SINGLE_PRECISION)
    print()
    table(more)


if __name__ == "__main__":
    main()
