"""Tables with the numbers of B16 chapters 2 to 4 and the numbers of the studies, side by side."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import linregress, t

from tisim.analysis import Mean
from tisim.analysis.packings.orientational_order import random_nematic_order, random_order
from tisim.cases.packing.scene import rod
from tisim.cases.packing.studies import shortest
from tisim.cases.packing.study_table import PackedRow, Study, means, text

CONTACTS_OF_RODS = 10.0
"""Contact number of the random contact equation phi L/D = <C>/2 = 5 for thin rods."""
CONTACTS_IN_FILE = 2.0
"""Contact number at which <C>* of B16 is 0."""
WIDE_CYLINDER = 3.5
"""Diameter (D) from which the packing fraction in a cylinder is taken as linear in 1/D_cyl."""


class Compared(NamedTuple):
    """A number or a statement of B16, and the number here."""

    subject: str
    published: str
    here: str

    def __str__(self) -> str:
        return f"| {self.subject} | {self.published} | {self.here} |"


def chosen(rows: Sequence[PackedRow], **columns: Any) -> list[PackedRow]:
    """Return the rows with these values of columns."""
    return [one for one in rows if all(getattr(one, name) == value for name, value in columns.items())]


def periodic(free: Sequence[PackedRow], aspect: float) -> dict[str, Mean]:
    """Return the means of the measures of rods of an aspect ratio in a periodic box, by the original
    method."""
    rows = chosen(free, shape=aspect, method="original")
    return {name: of(rows, name) for name in ("fraction", "contacts", "nematic")}


def of(rows: Sequence[PackedRow], name: str) -> Mean:
    """Return the mean of a measure."""
    return Mean.of([getattr(one, name) for one in rows])


def scaled(one: Mean, full: Mean, low: float = CONTACTS_IN_FILE) -> Mean:
    """Return a mean as a part of the range from ``low`` to ``full``."""
    span = full.value - low
    part = (one.value - low) / span
    return Mean(part, math.hypot(one.half, part * full.half) / span)


def shortest_fraction(aspect: float, angle: float) -> float:
    """Return the packing fraction of one row of rods in the shortest wedge (2.13). angle : degrees."""
    tangent = math.tan(math.radians(angle))
    return 2 * rod(aspect).volume() / shortest(aspect, angle) ** 2 / tangent


def compared(study: Study, rows: Sequence[PackedRow], free: Sequence[PackedRow] = ()) -> list[Compared]:
    """Return the lines of a study. free : rods in a periodic box, beside which others are scaled."""
    made: Mapping[Study, Any] = {
        "aspect ratio": of_rods,
        "long rods": of_long_rods,
        "longest rods": of_long_rods,
        "moment of inertia": of_inertia,
        "inertia effort": of_inertia,
        "cylinder": lambda some: of_cylinders(some, free),
        "wedge": lambda some: of_wedges(some, free),
        "superballs": of_superballs,
        "effort": of_effort,
        "wedge effort": lambda some: of_wedge_effort(some, free),
    }
    return list(made[study](rows))


def of_rods(rows: Sequence[PackedRow]) -> Iterator[Compared]:
    old = {
        shape: mean
        for (shape,), mean in means(chosen(rows, method="original"), ("shape",), "fraction").items()
    }
    spheres = periodic(rows, 1.0)
    yield Compared("packing fraction of spheres", "0.64; 0.61 (4.5)", text(spheres["fraction"]))
    for method in dict.fromkeys(one.method for one in chosen(rows, shape=1.0)):
        both = [text(of(chosen(rows, shape=1.0, method=method), name)) for name in ("contacts", "touching")]
        subject = f"contact number of spheres, {method}"
        yield Compared(subject, "5.84 (4.5)", f"{both[0]} extrapolated, {both[1]} up to 1e-4 D")
    peak = max(old, key=lambda shape: old[shape].value)
    yield Compared("densest aspect ratio", "Fig. 2.8", f"{peak:g}, {text(old[peak])}")
    largest = max(rows, key=lambda one: one.nematic)
    at_random = random_nematic_order(largest.number)
    here = f"{largest.nematic:.3f} of {largest.number} rods; {at_random:.3f} at random"
    yield Compared("largest S", "below 0.08 of 500 rods", here)
    aspects = [shape for shape in old if chosen(rows, shape=shape, method="revised")]
    for name, what in (("fraction", "packing fraction"), ("touching", "contact number up to 1e-4 D")):
        for aspect in dict.fromkeys([*aspects[:1], *aspects[-1:]]):
            pair = [of(chosen(rows, shape=aspect, method=method), name) for method in ("revised", "original")]
            subject = f"{what}, revised minus original, Lambda = {aspect:g}"
            published = "0" if name == "fraction" else "slightly above 0 for long rods"
            yield Compared(subject, published, text(pair[0].minus(pair[1])))


def of_long_rods(rows: Sequence[PackedRow]) -> Iterator[Compared]:
    for aspect in dict.fromkeys(one.shape for one in rows):
        some = chosen(rows, shape=aspect)
        limit = CONTACTS_OF_RODS / 2 / (aspect - 1)
        yield Compared(f"packing fraction, Lambda = {aspect:g}", f"{limit:.3g}", text(of(some, "fraction")))
        yield Compared(
            f"contact number, Lambda = {aspect:g}", "Fig. 2.8b; below 9.8", text(of(some, "contacts"))
        )
        random = random_nematic_order(some[0].number)
        here = f"{text(of(some, 'nematic'))}; {random:.3f} at random"
        yield Compared(f"S, Lambda = {aspect:g}", "below 0.08", here)


def of_inertia(rows: Sequence[PackedRow]) -> Iterator[Compared]:
    for aspect in dict.fromkeys(one.shape for one in rows):
        for name, what, part in (("fraction", "phi", "2.5 %"), ("contacts", "<C>", "5 %")):
            some = {xi: mean for (xi,), mean in means(chosen(rows, shape=aspect), ("inertia",), name).items()}
            best = max(some, key=lambda xi: some[xi].value)
            near = [xi for xi in some if 0.1 <= xi <= 10]
            least = min(some[xi].value for xi in near) / some[best].value
            here = f"{100 * (1 - least):.1f} % below the largest, at xi = {best:g} I"
            yield Compared(
                f"{what} for xi = 0.1 to 10 I, Lambda = {aspect:g}", f"within {part}; largest at xi < I", here
            )


def of_cylinders(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Iterator[Compared]:
    for aspect in dict.fromkeys(one.shape for one in rows):
        full, some = periodic(free, aspect), chosen(rows, shape=aspect)
        by = {
            name: {width: mean for (width,), mean in means(some, ("width",), name).items()}
            for name in ("fraction", "contacts", "nematic")
        }
        star = {width: one.over(full["fraction"]) for width, one in by["fraction"].items()}
        least = min(star, key=lambda width: star[width].value)
        who = f"Lambda = {aspect:g}"
        yield Compared(f"least phi*, {who}", "near D_cyl = 2 D", f"{text(star[least])} at {least:g} D")
        before = min((width for width in star if width >= 2.3), key=lambda width: star[width].value)
        yield Compared(
            f"least phi* above 2.2 D, {who}", "at least 0.8", f"{text(star[before])} at {before:g} D"
        )
        contacts = [one.contacts for one in some if one.width < 2]
        yield Compared(f"<C> below 2 D, {who}", "2", text(Mean.of(contacts)))
        wide = [one for one in some if one.width >= WIDE_CYLINDER]
        fit = linregress([1 / one.width for one in wide], [one.fraction for one in wide])
        half = float(t.ppf(0.975, len(wide) - 2) * fit.intercept_stderr)
        here = f"{text(Mean(float(fit.intercept), half))}; periodic {text(full['fraction'])}"
        yield Compared(f"phi at 1/D_cyl = 0, {who}", "periodic value", here)
        if aspect > 1:
            for name, kept in (
                ("S for D_cyl >= 1.5 Lambda", lambda r: r >= 1.5),
                ("S for D_cyl <= 0.75 Lambda", lambda r: r <= 0.75),
            ):
                order = [one.nematic for one in some if kept(one.width / aspect)]
                published = "below about 0.2" if ">" in name else "above about 0.8"
                if order:
                    here = f"{min(order):.2f} to {max(order):.2f}, mean {np.mean(order):.2f}"
                    yield Compared(f"{name}, {who}", published, here)


def of_wedges(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Iterator[Compared]:
    for aspect in dict.fromkeys(one.shape for one in rows):
        some, full, who = chosen(rows, shape=aspect), periodic(free, aspect), f"Lambda = {aspect:g}"
        longest = {
            angle: max(one.width for one in chosen(some, angle=angle))
            for angle in {one.angle for one in some}
        }
        last = [one for one in some if one.width == longest[one.angle]]
        published = "about one half" if aspect <= 2 else "above 0.8"
        here = f"{text(of(last, 'aligned'))}; along any wall {text(of(last, 'with_any'))}"
        yield Compared(f"f_align, longest wedges, {who}", published, here)
        for angle in sorted(longest):
            at = chosen(last, angle=angle)
            star = scaled(of(at, "fraction"), full["fraction"], shortest_fraction(aspect, angle))
            here = f"{text(star)} at {longest[angle] / shortest(aspect, angle):.2g} l_min"
            yield Compared(f"phi*, {angle:g} degrees, {who}", "to 1", here)
        contacts = [
            scaled(of(chosen(some, width=one), "contacts"), full["contacts"])
            for one in {one.width for one in some}
        ]
        largest = max(contacts, key=lambda one: one.value)
        yield Compared(f"largest <C>*, {who}", "about 0.8", text(largest))


def of_superballs(rows: Sequence[PackedRow]) -> Iterator[Compared]:
    by = {
        name: {shape: mean for (shape,), mean in means(rows, ("shape",), name).items()}
        for name in ("fraction", "contacts", "touching", "nematic", "cubatic")
    }
    peak = max(by["fraction"], key=lambda shape: by["fraction"][shape].value)
    last, random = max(by["fraction"]), random_order(rows[0].number)
    yield Compared("packing fraction, exponent 2", "0.61", text(by["fraction"][2.0]))
    rises = f"{peak:g}, {text(by['fraction'][peak])}"
    yield Compared("densest exponent", "Fig. 4.5; first rises, then falls", rises)
    yield Compared(f"packing fraction, exponent {last:g}", "Fig. 4.5", text(by["fraction"][last]))
    for shape, published in ((2.0, "5.84"), (last, "2.1 at exponent 5")):
        at_contact = f"; {text(by['contacts'][shape])} extrapolated"
        here = text(by["touching"][shape]) + at_contact
        yield Compared(f"contact number up to 1e-4 D, exponent {shape:g}", published, here)
    highest = max(one.value for one in by["cubatic"].values())
    yield Compared("largest mean S4", "low, no trend", f"{highest:.3f}; {random.cubatic:.3f} at random")


def of_effort(rows: Sequence[PackedRow]) -> Iterator[Compared]:
    columns = ("shape", "number", "limit", "step", "tolerance")
    fraction, contacts, touching = (
        means(rows, ("method", *columns), name) for name in ("fraction", "contacts", "touching")
    )
    for key, mean in fraction.items():
        method, *numbers = key
        subject = ", ".join(f"{name} {value:g}" for name, value in zip(columns, numbers, strict=True))
        both = f"contacts {text(contacts[key])} extrapolated, {text(touching[key])} up to 1e-4 D"
        yield Compared(f"{method}, {subject}", "", f"{text(mean)}, {both}")


def of_wedge_effort(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Iterator[Compared]:
    columns = ("shape", "angle", "width", "number", "limit")
    by = {name: means(rows, columns, name) for name in ("aligned", "with_any", "fraction", "contacts")}
    for key, aligned in by["aligned"].items():
        aspect, angle, width, number, limit = key
        length = width / shortest(aspect, angle)
        subject = f"Lambda {aspect:g}, {angle:g} degrees, {length:.2g} l_min, {number} rods, {limit} attempts"
        fraction, contacts = text(by["fraction"][key]), text(by["contacts"][key])
        here = f"f_align {text(aligned)}, along any wall {text(by['with_any'][key])}"
        here += f", packing fraction {fraction}, contacts {contacts}"
        if chosen(free, shape=aspect, method="original"):
            full, low = periodic(free, aspect), shortest_fraction(aspect, angle)
            star = scaled(by["fraction"][key], full["fraction"], low)
            here += f", phi* {text(star)}, <C>* {text(scaled(by['contacts'][key], full['contacts']))}"
        yield Compared(subject, "f_align above 0.8", here)


def confined(rows: Sequence[PackedRow], free: Sequence[PackedRow]) -> Iterator[list[str]]:
    """Yield a line of headings, and for each packing in cylinders or wedges phi* and <C>* of B16 with their
    95 % intervals.

    In cylinders phi* is the packing fraction over its value in a periodic box. In wedges it is scaled to be 0
    at the packing fraction (2.13) of one row of rods, and 1 at the value in a periodic box.
    """
    yield ["Lambda", "width, D", "angle", "phi*", "<C>*"]
    # NaN, the angle of a cylinder, is not equal to itself.
    for aspect, width, angle in sorted({(one.shape, one.width, f"{one.angle:g}") for one in rows}):
        some = [one for one in rows if (one.shape, one.width, f"{one.angle:g}") == (aspect, width, angle)]
        full, fraction, contacts = periodic(free, aspect), of(some, "fraction"), of(some, "contacts")
        if angle == "nan":
            star = fraction.over(full["fraction"])
        else:
            star = scaled(fraction, full["fraction"], shortest_fraction(aspect, float(angle)))
        angle = angle.replace("nan", "-")
        yield [f"{aspect:g}", f"{width:.4g}", angle, text(star), text(scaled(contacts, full["contacts"]))]
