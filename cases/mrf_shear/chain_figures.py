"""Figure and numbers of chains that are followed while a cell is sheared."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tisim.analysis import Mean, nearest_image, periodic_sides
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.mrf_shear.chains import FRAMES, Followed
from tisim.cases.mrf_shear.measures import extent
from tisim.cases.mrf_shear.morphology import widths
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, STRAIN
from tisim.numerics.statistics import half_width
from tisim.plotting.cloud import directions, panel
from tisim.plotting.look import FROM_THE_SIDE
from tisim.plotting.style import empty, letters, plain
from tisim.rendering.camera import Window
from tisim.scene.initial_state import Arrays

CHAIN, JOINED, OTHERS = "#cc3311", "#228833", "0.82"
"""Colours of the grains of a chain, of grains to which it attaches itself, and of others."""
SHOWN = (0, FRAMES // 2, FRAMES)
"""Frames that are drawn."""
MICRONS = 1e6
"""Micrometres in a metre."""
STATES: dict[str, Callable[[Followed], Arrays]] = {
    "without_a_field": lambda one: one.result.start,
    "at_first": lambda one: one.state(0),
    "at_the_end": lambda one: one.state(-1),
}
"""The states of a cell in which widths are measured, by name: the initial state, and the first and the last
frame."""


def chain_table(sheared: Sequence[Followed], still: Sequence[Followed]) -> str:
    """Return the measures of sheared cells, and of cells that are not sheared, as CSV: mean, half of its
    interval, and the value of each start."""
    rows: list[list[object]] = [["cell", "measure", "mean", "half_interval", "of_each_start"]]
    for name, cells in (("sheared", sheared), ("not sheared", still)):
        for measure, values in measures(cells):
            mean, each = Mean.of(values), " ".join(f"{one:.4g}" for one in values)
            rows.append([name, measure, f"{mean.value:.4g}", f"{mean.half:.3g}", each])
    return csv_text(rows)


def measures(cells: Sequence[Followed]) -> Iterator[tuple[str, list[float]]]:
    """Yield the name of each measure of followed cells, and its value for each."""
    of_cell: dict[str, Callable[[Followed], float]] = {
        "broken_contacts_per_free_grain": lambda one: one.broken,
        "formed_contacts_per_free_grain": lambda one: one.formed,
        "chains_at_first": lambda one: float(one.spanning[0]),
        "chains_at_the_end": lambda one: float(one.spanning[-1]),
        "mean_life_of_a_chain_over_the_time": lambda one: one.lifetime,
        "chains_unbroken_at_the_end": lambda one: float(one.unbroken[-1]),
        "fraction_of_grains_that_change_chains": lambda one: one.reattached,
    }
    for name, measure in of_cell.items():
        yield name, [measure(one) for one in cells]
    for when, state in STATES.items():
        each = [widths(state(one), one.result.scene.domain) for one in cells]
        for name in ("structures", "gaps"):
            yield f"width_of_{name}_{when}_um", [MICRONS * getattr(one, name) for one in each]


def reattachment_figure(cells: Sequence[Followed], still: Sequence[Followed]) -> Figure:
    """Draw a chain of the first sheared cell at the start of shear and later, as L21 Fig. 2.10 does, and the
    number of chains of all cells by strain.

    still : cells that are not sheared.
    """
    figure = empty(12.6, 4.2)
    axes = figure.subplots(1, 4, width_ratios=(1.0, 1.0, 1.0, 1.35))
    for axis, frame in zip(axes[:3], SHOWN, strict=True):
        draw_chain(axis, cells[0], frame)
        axis.set_title(f"strain {STRAIN * cells[0].part[frame]:g}")
    draw_numbers(axes[3], cells, still)
    letters(axes)
    return figure


def draw_chain(axis: Axes, cell: Followed, frame: int) -> None:
    """Draw a slice of a cell along the flow, two large grains thick, about its shortest chain.

    The grains of the chain are red. Grains with a new link to one of them are green.
    """
    chain = cell.shortest_chain()
    sides, height = periodic_sides(cell.result.scene.domain), extent(cell.result.scene.domain)[2]
    position, radius = cell.positions[frame], cell.result.state["radius"]
    # The middle of the chain stays in the middle of the picture.
    from_middle = nearest_image(position - position[chain[len(chain) // 2]], sides)
    links = cell.new_links(frame)
    joined = np.setdiff1d(links[np.isin(links, chain).any(axis=1)], chain)
    beside = np.flatnonzero(np.abs(from_middle[:, 1]) < 2 * LARGE_RADIUS)
    others = np.setdiff1d(beside, np.concatenate([chain, joined]))
    place = np.column_stack([from_middle[:, :2], position[:, 2]])
    part = Window(-sides[0, 0] / 2, 0.0, float(sides[0, 0]), float(height))
    # The chain is in front of the others, so that it can be seen.
    for grains, colour in ((others, OTHERS), (joined, JOINED), (chain, CHAIN)):
        state = {"position": place[grains], "radius": radius[grains]}
        panel(axis, state, part, colour=np.tile(to_rgb(colour), (len(grains), 1)), look=FROM_THE_SIDE)
    directions(axis, part, np.zeros(3), camera=FROM_THE_SIDE.camera)
    pairs, shown = cell.pairs(frame), np.concatenate([chain, joined])
    # The contacts of the chain.
    for i, j in pairs[np.isin(pairs, chain).any(axis=1) & np.isin(pairs, shown).all(axis=1)]:
        ends = place[i] + np.array([np.zeros(3), nearest_image(position[[j]] - position[[i]], sides)[0]])
        axis.plot(ends[:, 0], ends[:, 2], color="0.1", lw=1.2, zorder=4)


def draw_numbers(axis: Axes, cells: Sequence[Followed], still: Sequence[Followed]) -> None:
    """Draw the number of chains by strain, all of them and those that are unbroken, with 95 % intervals; and
    unbroken ones in cells that are not sheared, at equal times."""
    strain = STRAIN * cells[0].part
    lines: tuple[tuple[str, str, list[np.ndarray]], ...] = (
        ("all", "#4477aa", [one.spanning for one in cells]),
        ("of contacts unbroken since strain 0", CHAIN, [one.unbroken for one in cells]),
        ("the same, without shear", "0.4", [one.unbroken for one in still]),
    )
    for label, colour, numbers in lines:
        mean, half = np.mean(numbers, axis=0), half_width(np.array(numbers, float))
        axis.plot(strain, mean, color=colour, label=label)
        axis.fill_between(strain, np.maximum(mean - half, 0.0), mean + half, color=colour, alpha=0.2, lw=0)
    axis.set(xlabel="strain", ylabel="chains side by side", title="chains from raft to raft")
    # Room for the legend above the lines.
    axis.set_ylim(0.0, 1.5 * max(one.spanning.max() for one in cells))
    axis.yaxis.set_major_locator(MaxNLocator(integer=True))
    axis.legend(frameon=False, fontsize=8, loc="upper left")
    plain(axis)
