"""Captured fractions of particles that start in TOP and in SIDE, by angle, for two aspect ratios: B16 Fig.
6.7."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.capture.curves import CURVE_REPEATS, in_time_by_angle
from tisim.cases.capture.diffusing import Part
from tisim.cases.capture.statistics import ANGLES, CHECK_REPEATS, Settings, even, fractions, results
from tisim.cases.case import Claim
from tisim.engine.batches import Progress
from tisim.plotting.style import empty, letters, plain

PARTICLE_NANOMETRES = 125
"""The radius of the particles, nm."""
SHORT_ASPECT, LONG_ASPECT = 5 / 3, 20 / 3
"""The aspect ratios that are compared."""
START_REGIONS: tuple[Part, ...] = ("top", "side")
MINIMAL_DIFFERENCE = 0.02
"""Largest difference of mean captured fractions that counts as minimal."""


def settings() -> list[Settings]:
    """Return the settings of all runs: each aspect ratio, region and angle."""
    return [
        {"nanometres": PARTICLE_NANOMETRES, "angle": angle, "aspect": aspect, "part": part}
        for aspect in (SHORT_ASPECT, LONG_ASPECT) for part in START_REGIONS for angle in ANGLES
    ]  # fmt: skip


def check(repeats: int = CHECK_REPEATS) -> Iterator[Claim]:
    """Yield B16's findings (6.4.3): in TOP the two aspect ratios capture alike; in SIDE the shorter cylinder
    captures more at small angles to the field."""
    by_setting = np.array([fractions(group) for group in results(settings(), repeats)])
    short, long = by_setting.reshape(2, len(START_REGIONS), len(ANGLES), repeats)
    top, side = short - long
    name = f"{PARTICLE_NANOMETRES} nm, L/D 5/3 minus 20/3"
    yield Claim(
        f"{name}, TOP, uniform mean over angles", Mean.of(even(top)), -MINIMAL_DIFFERENCE, MINIMAL_DIFFERENCE
    )
    for k in (0, 1):
        yield Claim(f"{name}, SIDE, {ANGLES[k]:.0f} degrees to the field", Mean.of(side[k]), least=0.0)
    rest = Mean.of(even(side[2:]))
    yield Claim(
        f"{name}, SIDE, uniform mean over {ANGLES[2]:.0f} to 90 degrees",
        rest,
        -MINIMAL_DIFFERENCE,
        MINIMAL_DIFFERENCE,
    )


def figure(progress: Progress) -> Figure:
    """Run and draw the captured fraction over time by angle, for each aspect ratio and region."""
    return drawn(results(settings(), CURVE_REPEATS, progress))


def drawn(groups: Sequence[Sequence[Result]]) -> Figure:
    """Draw results in the order of ``settings``."""
    picture = empty(12.0, 7.0)
    grid = picture.subplots(2, 2)
    rows, each = list(zip(settings(), groups, strict=True)), len(ANGLES)
    for k, axis in enumerate(grid.flat):
        in_time_by_angle(axis, rows[k * each : (k + 1) * each])
        axis.set(xlabel="time (s)", ylabel="captured fraction", ylim=(0, 1.02))
        plain(axis)
    letters(grid.flat)
    handles, names = grid[0, 0].get_legend_handles_labels()
    picture.legend(
        handles, names, loc="outside upper center", frameon=False, ncols=len(names),
        title="angle of the axis to the field",
    )  # fmt: skip
    return picture
