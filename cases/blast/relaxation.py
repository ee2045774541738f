"""Does the relaxation of the ball before the blast matter (Z16 section 9)? Tables and a figure.

    python -m tisim.cases.blast.relaxation [--number 500] [--starts 10] [--out blast_relaxation.png]

The balls and their blasts are in relaxed_ball.py.
"""

from __future__ import annotations

import argparse
from contextlib import closing
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim import MeasureSeries, Simulation
from tisim.cases.blast import scene as blast
from tisim.cases.blast.figures import NO_GRAVITY, snapshot
from tisim.cases.blast.relaxed_ball import BLASTS, Relaxation, mean, relaxing, study, tables
from tisim.operators import AtRest
from tisim.plotting.cloud import directions
from tisim.plotting.scenery import window
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain

RANDOM, RELAXED = "random", "relaxed, neighbours"
COLOURS = {RANDOM: AXIS_COLOURS[0], RELAXED: AXIS_COLOURS[1], "relaxed, all pairs": AXIS_COLOURS[2]}
MARKS = {RANDOM: "o", RELAXED: "s", "relaxed, all pairs": "^"}
CLUMPS = "near field of neighbours"
INTERVAL = 0.02
"""Time between points of the history of a relaxation, s."""


def relaxation_figure(found: Relaxation) -> Figure:
    """Draw a ball before and after it has relaxed, the clouds after their blasts, the residuals during
    relaxation, and half axes over kinds and energies of blasts with 95 % intervals."""
    figure = empty(11.6, 7.4)
    rows = figure.add_gridspec(2, 1, height_ratios=(0.75, 1.0))
    upper, lower = rows[0].subgridspec(1, 4), rows[1].subgridspec(1, 3)
    relaxed = found.relaxed[RELAXED]
    before = (relaxed.start, relaxed.state)
    after = (found.clouds[CLUMPS, RANDOM], found.clouds[CLUMPS, RELAXED])
    titles = (
        "random ball", "the same, relaxed", f"random ball, {_kilojoules(blast.ENERGY)}, 1 s",
        f"relaxed ball, {_kilojoules(blast.ENERGY)}, 1 s",
    )  # fmt: skip
    tops = []
    for k, (state, title) in enumerate(zip((*before, *after), titles, strict=True)):
        axis = figure.add_subplot(upper[k])
        part = window(before if k < 2 else after)
        snapshot(axis, state, part)
        axis.set_title(title)
        tops.append(axis)
        if k % 2:
            directions(axis, part, NO_GRAVITY, share=0.1)
    residuals, kinds, energies = (figure.add_subplot(lower[k]) for k in range(3))
    history(residuals, found.number)
    by_kind(kinds, found)
    by_energy(energies, found)
    for axis in (residuals, kinds, energies):
        plain(axis)
    letters((*tops, residuals, kinds, energies), 9)
    return figure


def history(axis: Axes, number: int) -> None:
    """Draw the two ratios of ``at_rest`` over time for the ball of the first start, and their bounds."""
    scene = relaxing(number, 0, {"cutoff": blast.NEIGHBOURS})
    (rest,) = (effect for effect in scene.effects if isinstance(effect, AtRest))
    series = MeasureSeries(INTERVAL)
    with closing(Simulation(scene, 1, number)) as simulation:
        simulation.load([scene])
        simulation.run(observers=[series])
    values = series[0]
    for name, bound, colour, label in (
        ("kinetic_ratio", rest.energy, AXIS_COLOURS[0], "kinetic energy"),
        ("unbalanced_ratio", rest.unbalanced, AXIS_COLOURS[1], "unbalanced force"),
    ):
        axis.plot(values["time"], values[name], color=colour, lw=1.4, label=label)
        axis.axhline(bound, color=colour, lw=0.9, ls=":")
    axis.set(
        xlabel="time (s)", ylabel="over the attraction of touching particles", yscale="log", ylim=(1e-6, None)
    )
    axis.set_title("relaxation; dotted: at rest")
    axis.legend(frameon=False, fontsize=8)


def by_kind(axis: Axes, found: Relaxation) -> None:
    """Draw half axes along (filled) and across the field after each kind of blast from each ball."""
    labelled = set()
    for row, kind in enumerate(BLASTS):
        balls = [ball for name, ball in found.shapes if name == kind]
        for k, ball in enumerate(balls):
            y = row + 0.22 * (k - (len(balls) - 1) / 2)
            for name, fill, size in (("along", COLOURS[ball], 5), ("across", "none", 8)):
                one = mean(found.shapes[kind, ball], name)
                label = ball if name == "along" and ball not in labelled else None
                axis.errorbar(
                    one.value, y, xerr=one.half, fmt=MARKS[ball], ms=size, capsize=3, color=COLOURS[ball],
                    mfc=fill, label=label,
                )  # fmt: skip
            labelled.add(ball)
    axis.set_yticks(
        range(len(BLASTS)), [name.replace("near field of ", "near field\nof ") for name in BLASTS]
    )
    axis.set(ylim=(len(BLASTS) - 0.4, -0.6), xlim=(0, None))
    axis.set_xlabel("half axis along (filled) and across the field (m)")
    axis.set_title(f"after {_kilojoules(blast.ENERGY)}, 1 s")
    axis.legend(frameon=False, fontsize=8, loc="lower right")


def by_energy(axis: Axes, found: Relaxation) -> None:
    """Draw half axes along the field over the energy of the blast, and the work that binds a relaxed ball."""
    for ball in (RANDOM, RELAXED):
        energy = np.array([one for name, one in found.by_energy if name == ball])
        means = [mean(found.by_energy[ball, one], "along") for one in energy]
        axis.errorbar(
            energy / 1e3, [one.value for one in means], yerr=[one.half for one in means],
            fmt=MARKS[ball] + "-", ms=5, capsize=3, color=COLOURS[ball], label=ball,
        )  # fmt: skip
    bound = mean(found.balls[RELAXED], "bound").value * blast.ENERGY / 1e3
    axis.axvline(bound, color="0.4", ls=":", label="work of the near field")
    axis.set(xlabel="energy W of the blast (kJ)", ylabel="half axis along the field (m)", ylim=(0, None))
    axis.set_title("near field of neighbours, 1 s")
    axis.legend(frameon=False, fontsize=8, loc="lower right")


def _kilojoules(energy: float) -> str:
    return f"W = {energy / 1e3:g} kJ"


def main() -> None:
    """Relax and blast balls, print the tables and draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--number", type=int, default=500, help="number of particles")
    parser.add_argument("--starts", type=int, default=10, help="number of random starts")
    parser.add_argument("--out", type=Path, help="file of the figure")
    options = parser.parse_args()
    if options.starts < 2:
        parser.error(f"--starts must be at least 2 for an interval; received {options.starts}")
    found = study(options.number, range(options.starts))
    print(tables(found))
    if options.out is not None:
        relaxation_figure(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
