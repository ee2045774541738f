"""Checks of the case packing: densities and contacts beside B16 and other protocols."""

from collections.abc import Iterator

from tisim.analysis import Mean
from tisim.cases.case import Claim, Shown
from tisim.cases.packing.studies import PackedPlan, packed
from tisim.cases.packing.study_table import PackedRow

CHECK_STARTS = 5
CHECKED_ASPECTS = (1.0, 1.4, 3.0)
"""Spheres, rods near the densest aspect ratio, and longer rods."""


def check() -> Iterator[Claim | Shown]:
    """Pack 200 spheres and rods by the original method, from five starts each."""
    chosen = [PackedPlan("aspect ratio", aspect) for aspect in CHECKED_ASPECTS]
    rows = packed(chosen, "default", CHECK_STARTS)
    spheres, short, long = ([one for one in rows if one.shape == aspect] for aspect in CHECKED_ASPECTS)
    fraction = mean_of(spheres, "fraction")
    yield Claim("packing fraction of spheres", fraction, 0.59, 0.645)
    yield Shown("  beside random close packing", fraction, "0.64; B16 4.5 about 0.61")
    yield Claim("rods of Lambda = 1.4 over spheres", mean_of(short, "fraction").over(fraction), 1.05)
    over = mean_of(short, "fraction").over(mean_of(long, "fraction"))
    yield Claim("rods of Lambda = 1.4 over 3.0", over, 1.0)
    for name, group in (("spheres", spheres), ("Lambda = 1.4", short), ("Lambda = 3.0", long)):
        beside = "B16 4.5: 5.84" if group is spheres else ""
        yield Shown(f"contact number, {name}", mean_of(group, "contacts"), beside)
    for name, group in (("Lambda = 1.4", short), ("Lambda = 3.0", long)):
        yield Claim(f"nematic order S, {name}", mean_of(group, "nematic"), most=0.16)


def mean_of(rows: list[PackedRow], name: str) -> Mean:
    """Return the mean of a measure."""
    return Mean.of([getattr(one, name) for one in rows])
