"""Curves of studies: packing fraction, contacts and order by shape, container and moment of inertia."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.analysis import Mean
from tisim.analysis.packings.orientational_order import random_nematic_order, random_order
from tisim.cases.packing.comparisons import (
    CONTACTS_IN_FILE,
    CONTACTS_OF_RODS,
    chosen,
    periodic,
    scaled,
    shortest_fraction,
)
from tisim.cases.packing.studies import shortest
from tisim.cases.packing.study_table import PackedRow, means
from tisim.plotting.style import empty, letters, plain

COLOURS = ("#4477aa", "#cc6677", "#228833", "#ccbb44", "#aa3377")
MEASURED = (
    ("fraction", "packing fraction"),
    ("contacts", "mean contact number"),
    ("nematic", "nematic order S"),
)
TICKS = (1, 1.5, 2, 3, 5, 10, 25, 50, 100)
"""Marked aspect ratios."""
FRACTIONS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8)
"""Marked packing fractions of long rods."""
LONGEST_SHORT = 10.0
"""Aspect ratio from which the density of thin rods is drawn, on a logarithmic axis."""
SPHERES = 0.64
"""Packing fraction of random close packing of spheres."""
PUBLISHED_SPHERES, PUBLISHED_CONTACTS = 0.61, ((2.0, 5.0), (5.84, 2.1))
"""Packing fraction of spheres, and contact numbers at two exponents, with a linear decrease between them (B16
4.5)."""
Curve = Mapping[float, Mean]
"""Means by the value on the abscissa."""


def draw(axis: Axes, curves: Mapping[str, Curve], labels: Sequence[str] | None = None) -> None:
    """Draw means with their 95 % intervals, one line for each label. labels : in the order of colours, if
    there are more than curves."""
    colours = dict(zip(labels or curves, COLOURS, strict=False))
    for label, curve in curves.items():
        half = [one.half if np.isfinite(one.half) else 0.0 for one in curve.values()]
        mean = [one.value for one in curve.values()]
        axis.errorbar(
            list(curve), mean, half, fmt="o-", ms=3, lw=1, color=colours[label], capsize=2, label=label
        )
    plain(axis)


def by(rows: Sequence[PackedRow], x: str, name: str, group: str, label: str = "{}") -> dict[str, Curve]:
    """Return curves of a measure over one column, for each value of another."""
    values = dict.fromkeys(getattr(one, group) for one in rows)
    some = {value: [one for one in rows if getattr(one, group) == value] for value in values}
    return {
        label.format(value): {key: mean for (key,), mean in means(of, (x,), name).items()}
        for value, of in some.items()
    }


def panels(rows: Sequence[PackedRow], x: str, xlabel: str, group: str, label: str) -> Figure:
    """Draw packing fraction, contact number and order over a column."""
    figure = empty(12.6, 3.9)
    axes = figure.subplots(1, len(MEASURED))
    for axis, (name, title) in zip(axes, MEASURED, strict=True):
        draw(axis, by(rows, x, name, group, label))
        axis.set(xlabel=xlabel, ylabel=title, ylim=(0, None))
    axes[0].legend(frameon=False, fontsize=8)
    letters(axes)
    return figure


def of_rods(rows: Sequence[PackedRow]) -> Figure:
    """Draw rods in a periodic box by aspect ratio (B16 Figs 2.8 and 3.3), with lines at the density of random
    close packing of spheres and of thin rods, phi L/D = 5, and at the order of as many random directions."""
    figure = panels(rows, "shape", r"aspect ratio $\Lambda = L/D + 1$", "method", "{}")
    figure.axes[0].axhline(SPHERES, color="0.6", lw=0.8)
    longest = max(one.shape for one in rows)
    if longest > LONGEST_SHORT:
        aspect = np.geomspace(LONGEST_SHORT, longest, 50)
        figure.axes[0].plot(aspect, CONTACTS_OF_RODS / 2 / (aspect - 1), color="0.6", lw=0.8, ls="--")
        figure.axes[0].set_ylim(0.8 * min(one.fraction for one in rows), 1.0)
        figure.axes[0].set_yscale("log")
        figure.axes[0].set_yticks(FRACTIONS, [f"{one:g}" for one in FRACTIONS])
        figure.axes[0].set_yticks([], minor=True)
    number = {one.shape: one.number for one in rows}
    figure.axes[2].plot(
        list(number), [random_nematic_order(one) for one in number.values()], color="0.6", lw=0.8
    )
    for axis in figure.axes:
        axis.set_xscale("log")
        axis.set_xticks([tick for tick in TICKS if tick <= longest], minor=False)
        axis.set_xticklabels([f"{tick:g}" for tick in TICKS if tick <= longest])
        axis.set_xticks([], minor=True)
    return figure


def of_superballs(rows: Sequence[PackedRow]) -> Figure:
    """Draw superballs by exponent beside the numbers of B16 (Fig. 4.5): packing fraction; contacts up to 1e-4
    D, which is the contact number of B16, and extrapolated; nematic and cubatic order, with their values in
    as many random directions."""
    figure = empty(12.6, 3.9)
    axes = figure.subplots(1, 3)
    shown = (
        {"packing fraction": "fraction"},
        {"gaps up to 1e-4 D": "touching", "extrapolated to contact": "contacts"},
        {"nematic order S2": "nematic", "cubatic order S4": "cubatic"},
    )
    for axis, measures in zip(axes, shown, strict=True):
        draw(
            axis, {label: by(rows, "shape", name, "study")["superballs"] for label, name in measures.items()}
        )
        axis.set_xlabel(r"exponent $\gamma$")
    axes[0].axhline(SPHERES, color="0.6", lw=0.8)
    axes[0].plot(2.0, PUBLISHED_SPHERES, "k+", label="B16")
    axes[1].plot(*PUBLISHED_CONTACTS, "k+--", lw=0.8, label="B16")
    random = random_order(rows[0].number)
    for order, colour in ((random.nematic, COLOURS[0]), (random.cubatic, COLOURS[1])):
        axes[2].axhline(order, color=colour, lw=0.8, ls=":")
    for axis, title in zip(axes, ("packing fraction", "mean contact number", "order"), strict=True):
        axis.set_ylabel(title)
        axis.set_ylim(bottom=0)
        axis.legend(frameon=False, fontsize=8)
    axes[0].set_ylim(bottom=min(0.55, min(one.fraction for one in rows) - 0.02))
    letters(axes)
    return figure


def of_inertia(rows: Sequence[PackedRow]) -> Figure:
    """Draw rods by xi over the moment of inertia (B16 Fig. 2.7)."""
    figure = panels(rows, "inertia", r"$\xi/I_x$", "shape", r"$\Lambda$ = {:g}")
    for axis in figure.axes:
        axis.set_xscale("log")
    return figure


def of_cylinders(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Figure:
    """Draw rods in cylinders by diameter (B16 Fig. 2.10): packing fraction over its periodic value, contacts
    between 2 and their periodic value, order, and packing fraction over 1/D_cyl with periodic values at 0.

    free : rods in a periodic box.
    """
    figure = empty(12.6, 7.0)
    axes = figure.subplots(2, 2).ravel()
    label = r"$\Lambda$ = {:g}"
    aspects = sorted({one.shape for one in rows})
    of = {aspect: chosen(rows, shape=aspect) for aspect in aspects}
    fraction, contacts, order, inverse = ({} for _ in range(4))
    for aspect, some in of.items():
        full = periodic(free, aspect)
        of_width: dict[str, dict[float, Mean]] = {
            name: {width: mean for (width,), mean in means(some, ("width",), name).items()}
            for name, _ in MEASURED
        }
        key = label.format(aspect)
        fraction[key] = {at: one.over(full["fraction"]) for at, one in of_width["fraction"].items()}
        contacts[key] = {at: scaled(one, full["contacts"]) for at, one in of_width["contacts"].items()}
        if aspect > 1:
            # Axes of spheres have no meaning.
            order[key] = {at / aspect: one for at, one in of_width["nematic"].items()}
        inverse[key] = {
            **{1 / at: one for at, one in of_width["fraction"].items()}, 0.0: full["fraction"]
        }  # fmt: skip
    drawn = (
        (fraction, r"$D_{cyl}/D$", r"$\phi^*$"),
        (contacts, r"$D_{cyl}/D$", r"$\langle C\rangle^*$"),
        (order, r"$D_{cyl}/(\Lambda D)$", "nematic order S"),
        (inverse, r"$D/D_{cyl}$", "packing fraction"),
    )
    for axis, (curves, xlabel, ylabel) in zip(axes, drawn, strict=True):
        draw(axis, curves, [label.format(aspect) for aspect in aspects])
        axis.set(xlabel=xlabel, ylabel=ylabel)
    axes[0].axhline(1.0, color="0.6", lw=0.8)
    axes[1].axhline(1.0, color="0.6", lw=0.8)
    axes[0].legend(frameon=False, fontsize=8)
    letters(axes)
    return figure


def of_wedges(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Figure:
    """Draw rods in wedges by length (B16 Figs 2.12 to 2.14): packing fraction between one row of rods (2.13)
    and its periodic value, contacts between 2 and their periodic value, and the aligned part at walls; one
    column for each angle.

    free : rods in a periodic box.
    """
    angles = sorted({one.angle for one in rows})
    measured: tuple[tuple[str, str, Callable[..., Mean]], ...] = (
        ("fraction", r"$\phi^*$", wedge_fraction),
        ("contacts", r"$\langle C\rangle^*$", wedge_contacts),
        ("aligned", r"$f_{align}$", lambda one, *_: one),
    )
    figure = empty(4.2 * len(angles), 8.4)
    axes = figure.subplots(3, len(angles), sharex=True, sharey="row", squeeze=False)
    for column, angle in zip(axes.T, angles, strict=True):
        for axis, (name, ylabel, scale) in zip(column, measured, strict=True):
            curves: dict[str, dict[float, Mean]] = {}
            for aspect in sorted({one.shape for one in rows}):
                some = means(chosen(rows, shape=aspect, angle=angle), ("width",), name)
                full = periodic(free, aspect)
                curves[rf"$\Lambda$ = {aspect:g}"] = {
                    width / shortest(aspect, angle): scale(mean, full, aspect, angle)
                    for (width,), mean in some.items()
                }
            draw(axis, curves)
            if angle == angles[0]:
                axis.set_ylabel(ylabel)
        column[0].set_title(f"angle {angle:g}°")
        column[-1].set_xlabel(r"$l_w/l_{w,min}$")
    axes[0, 0].legend(frameon=False, fontsize=8)
    letters(axes.ravel())
    return figure


def wedge_fraction(one: Mean, full: Mapping[str, Mean], aspect: float, angle: float) -> Mean:
    """Return phi* of B16: 0 at the packing fraction (2.13), 1 at the periodic value."""
    return scaled(one, full["fraction"], shortest_fraction(aspect, angle))


def wedge_contacts(one: Mean, full: Mapping[str, Mean], *_: float) -> Mean:
    """Return C* of B16: 0 at two contacts, 1 at the periodic value."""
    return scaled(one, full["contacts"], CONTACTS_IN_FILE)
