"""Does the valve open again? A field begins and ends; the fraction of iron and the pressure on a jam differ.

    python -m tisim.cases.valve.opens [--starts 12] [--out valve_opens.png]

L21 calls a valve successful if it jams in a field and flows again without it (section 3.3, table 3.2). It
measured three fractions of iron (table 3.2), and the pressure that a jammed valve holds (section 3.4.2).
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d
from scipy.stats import binomtest

from tisim.analysis import Mean
from tisim.cases.valve import published
from tisim.cases.valve.runs import ARRESTED, Flow, Settings, flows
from tisim.cases.valve.scene import FLOWING, GRADIENT, LENGTH, scene
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.plotting.style import empty, legend_above, letters, plain

OPENED_STARTS = 12
"""Number of starts of each setting."""
SHUT, REOPENED = 0.4e-3, 0.3e-3
"""Durations of the second phase, with the field, and of the third, without it again, s. The first lasts
FLOWING."""
NOMINAL = GRADIENT * LENGTH
"""Drag on grains at rest over the cross-section of the small valve, Pa: L21's 100 kPa over the length."""
FRACTIONS = (0.286, 0.45)
"""Volume fractions of iron of L21's mixes in addition to 0.345."""
RAISED = (1.0, 4.0, 8.0)
"""Factors by which the pressure on an arrested valve is raised. L21 raised it from 105 to more than 405 kPa,
by 3.9."""
HELD = 0.15e-3
"""Duration of the flow at the raised pressure, s."""
SMOOTH = 5
"""Number of samples over which rates are averaged in times to arrest."""
GROUP_COLOURS = ("#4477aa", "#cc6677", "#999999")
"""Colours of valves whose field ends, stays on, and of valves without a field."""
MILLI, MICRO = 1e-3, 1e-6
"""A millisecond and a microsecond, s."""


@dataclass(frozen=True)
class Count:
    """A number of starts among all, with the exact 95 % interval of the fraction (Clopper and Pearson)."""

    found: int
    starts: int

    @classmethod
    def of(cls, happened: Sequence[bool]) -> "Count":
        """Return the count of starts in which something has happened."""
        must(len(happened) > 0, "starts", "at least one", len(happened))
        return cls(sum(map(bool, happened)), len(happened))

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the fraction."""
        found = binomtest(self.found, self.starts).proportion_ci(0.95)
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        low, high = self.interval
        return f"{self.found} of {self.starts} ({low:.2f} to {high:.2f})"


@dataclass(frozen=True)
class Opening:
    """One start of a valve in three phases: its flow without a field, in the field, and without it again.

    flow : with the flow rate over time. begin, end : of the field, s. The controls have the same phases.
    """

    flow: Flow
    begin: float = FLOWING
    end: float = FLOWING + SHUT

    @property
    def before(self) -> float:
        """Return the mass flow rate at the end of the first phase, kg/s."""
        return self.flow.mean(0.0, self.begin)

    @property
    def during(self) -> float:
        """Return the mass flow rate at the end of the second phase, kg/s."""
        return self.flow.mean(self.begin, self.end)

    @property
    def after(self) -> float:
        """Return the mass flow rate at the end of the third phase, kg/s."""
        return self.flow.mean(self.end, float(self.flow.times[-1]))

    @property
    def arrested(self) -> bool:
        """Return whether less than ARRESTED of the flow is left at the end of the second phase."""
        return self.during < ARRESTED * self.before

    @property
    def flows_again(self) -> bool:
        """Return whether ARRESTED of the flow before the field, or more, is there at the end."""
        return self.after >= ARRESTED * self.before

    @property
    def opening_time(self) -> float:
        """Return the time after the end of the second phase at which half of the final flow is reached, s.

        NaN if the flow does not resume.
        """
        if not self.flows_again:
            return float("nan")
        reached = (self.flow.times > self.end) & (self.flow.rates >= self.after / 2)
        return float(self.flow.times[reached.argmax()] - self.end)

    @property
    def arrest_time(self) -> float:
        """Return the time after the beginning of the field from which on less than ARRESTED of the flow is
        left, s.

        It is a mean over SMOOTH samples that is compared. NaN if the flow is not arrested.
        """
        if not self.arrested:
            return float("nan")
        times, rates = self.flow.times, uniform_filter1d(self.flow.rates, SMOOTH, mode="nearest")
        # The rate before the last samples of the phase: later ones are averaged with the third phase.
        inside = (times >= self.begin) & (times <= self.end - SMOOTH // 2 * (times[1] - times[0]))
        faster = np.flatnonzero(inside & (rates >= ARRESTED * self.before))
        return float(times[faster[-1] + 1] - self.begin) if len(faster) else 0.0


@dataclass(frozen=True)
class Reopening:
    """A valve in three phases, from several starts, beside the same starts in other fields.

    opened : the field is switched on and off. closed : it stays on. without : there is none.
    """

    opened: Sequence[Opening]
    closed: Sequence[Opening]
    without: Sequence[Opening]

    @property
    def groups(self) -> dict[str, Sequence[Opening]]:
        """Return the three groups by name."""
        names = ("field on, then off", "field stays on", "no field")
        return dict(zip(names, (self.opened, self.closed, self.without), strict=True))


def three_phases(
    starts: int = OPENED_STARTS,
    progress: Progress = lambda part: None,
    flowing: float = FLOWING,
    lasting: float = SHUT,
    reopened: float = REOPENED,
    **settings: Any,
) -> Reopening:
    """Run a valve in three phases and its two controls from the same starts, as one batch.

    flowing, lasting, reopened : durations of the phases, s. settings : of ``scene``. RunError if a run fails.
    """
    phases = {**settings, "flowing": flowing, "lasting": lasting, "reopened": reopened}
    on = {**phases, "lasting": lasting + reopened, "reopened": 0.0}
    groups: list[Settings] = [phases, on, {**phases, "flux": 0.0}]
    done = flows([scene(**one, seed=seed) for one in groups for seed in range(starts)], progress)
    found = [Opening(one, flowing, flowing + lasting) for one in done]
    return Reopening(found[:starts], found[starts : 2 * starts], found[2 * starts :])


def arrests(
    wanted: Sequence[Settings], starts: int = OPENED_STARTS, progress: Progress = lambda part: None
) -> list[list[Opening]]:
    """Return the first two phases of valves with some settings, a list of starts for each."""
    phases: Settings = {"flowing": FLOWING, "lasting": SHUT}
    scenes = [scene(**phases, **one, seed=seed) for one in wanted for seed in range(starts)]
    done = [Opening(one) for one in flows(scenes, progress)]
    return [done[k : k + starts] for k in range(0, len(done), starts)]


@dataclass(frozen=True)
class Raised:
    """A jam under a raised pressure.

    before : mass flow rate before the field, at NOMINAL, kg/s. factor : by which the pressure is raised.
    flow : at the raised pressure.
    """

    before: float
    factor: float
    flow: Flow

    @property
    def left(self) -> float:
        """Return the final mass flow rate over the rate of an open valve at this pressure.

        The latter is the rate before the field times the factor: drag and oil speed are proportional.
        """
        return self.flow.mean(0.0, float(self.flow.times[-1])) / (self.before * self.factor)

    @property
    def held(self) -> bool:
        """Return whether the valve stays arrested."""
        return self.left < ARRESTED


def raised(
    jams: Sequence[Opening],
    factors: Sequence[float] = RAISED,
    lasting: float = HELD,
    progress: Progress = lambda part: None,
    pressure: float = NOMINAL,
    **settings: Any,
) -> list[list[Raised]]:
    """Raise the pressure on arrested valves at once, in their field; a list of starts for each factor.

    The oil of a scene has a fixed speed. A second run therefore begins from the final state of the first,
    with its contact springs and moments, and faster oil. pressure : of the first run, Pa. lasting : s.
    settings : of ``scene``, as in the first run.
    """
    scenes = [
        scene(state=one.flow.result.state, pressure=factor * pressure, flowing=0.0, lasting=lasting,
              **settings)
        for factor in factors
        for one in jams
    ]  # fmt: skip
    done = iter(flows(scenes, progress))
    return [[Raised(one.before, factor, next(done)) for one in jams] for factor in factors]


def report(found: Reopening, mixes: Sequence[Sequence[Opening]], jams: Sequence[Sequence[Raised]]) -> str:
    """Return the numbers as text.

    mixes : starts of each of FRACTIONS. jams : starts by factor.
    """
    lines = ["flow over the flow before the field, at the end of the second and the third phase:"]
    for name, group in found.groups.items():
        second, third = (Mean.of([getattr(one, when) / one.before for one in group]) for when in PHASES)
        going = Count.of([one.flows_again for one in group])
        arrested = Count.of([one.arrested for one in group])
        lines.append(f"  {name}: {second}, {third}; arrested {arrested}; flows at the end {going}")
    jammed = [one for one in found.opened if one.arrested]
    if jammed:
        lines.append(f"  of those arrested, flow again: {Count.of([one.flows_again for one in jammed])}")
    difference = Mean.of(
        [(a.after - b.after) / a.before for a, b in zip(found.opened, found.without, strict=True)]
    )
    lines.append(f"  third phase, field off again minus no field, start by start: {difference}")
    opening = [one.opening_time / MICRO for one in found.opened if one.flows_again]
    if opening:
        lines.append(f"  longest time to half of the final flow: {max(opening):.0f} µs")
    lines.append(f"arrested {SHUT / MILLI:.1f} ms after the field is switched on:")
    rows = {
        **{f"{fraction:.1%} iron": mix for fraction, mix in zip(FRACTIONS, mixes, strict=True)},
        f"{published.FRACTION:.1%} iron": found.closed,
    }
    for name, group in rows.items():
        times = sorted(one.arrest_time / MICRO for one in group if one.arrested)
        left = Mean.of([one.during / one.before for one in group])
        after = f", after {times[0]:.0f} to {times[-1]:.0f} µs" if times else ""
        lines.append(f"  {name}: {Count.of([one.arrested for one in group])}, {left} of the flow left{after}")
    lines.append(f"pressure raised on the valves whose field stays on, {HELD / MILLI:.2f} ms later:")
    for of_factor in jams:
        left = Mean.of([one.left for one in of_factor])
        name = f"  {of_factor[0].factor:g} times, {of_factor[0].factor * NOMINAL / 1e3:.0f} kPa"
        lines.append(f"{name}: held {Count.of([one.held for one in of_factor])}, {left} of the open flow")
    return "\n".join(lines)


PHASES = ("during", "after")
"""Rates at the end of the second and of the third phase."""


def picture(found: Reopening) -> Figure:
    """Draw flow rates over time, and the flow of each start at the end of the third phase."""
    figure = empty(12.0, 4.0)
    rates, ends = figure.subplots(1, 2, width_ratios=(2, 1))
    first = found.opened[0]
    rates.axvspan(first.begin / MILLI, first.end / MILLI, color="0.93", lw=0)
    rates.text((first.begin + first.end) / 2 / MILLI, 1.12, "field on", ha="center", color="0.4")
    for row, (colour, (name, group)) in enumerate(zip(GROUP_COLOURS, found.groups.items(), strict=True)):
        curves = np.array([one.flow.rates / one.before for one in group])
        times = group[0].flow.times / MILLI
        # One group is drawn as single starts too: more lines hide each other.
        if row == 0:
            rates.plot(times, curves.T, color=colour, lw=0.4, alpha=0.5)
        rates.plot(times, curves.mean(axis=0), color=colour, lw=2, label=f"{name}, mean of {len(group)}")
        final = np.array([one.after / one.before for one in group])
        mean = Mean.of(final)
        spread = np.linspace(-0.2, 0.2, len(final))
        ends.plot(row + spread, final, "o", ms=4, color=colour, alpha=0.6)
        ends.errorbar(row, mean.value, mean.half, fmt="k_", ms=16, capsize=4)
    ends.axhline(ARRESTED, color="0.5", lw=0.8, ls=":")
    ends.set_xticks(range(3), ["on, then off", "stays on", "no field"])
    ends.set(title="end of the run, by start, and 95 % interval", ylabel="part of the flow before the field")
    ends.set_ylim(-0.05, 1.2)
    rates.set(xlabel="time (ms)", ylabel="mass flow rate over that before the field", ylim=(-0.05, 1.2))
    legend_above(rates)
    for axis in (rates, ends):
        plain(axis)
    letters((rates, ends))
    return figure


def main() -> None:
    """Run the valves, print the numbers and draw the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=OPENED_STARTS, help="number of starts of each setting")
    parser.add_argument("--out", type=Path, help="file of the picture")
    options = parser.parse_args()
    must(options.starts >= 2, "starts", "at least 2, for an interval", options.starts)
    found = three_phases(options.starts)
    mixes = arrests([{"fraction": fraction} for fraction in FRACTIONS], options.starts)
    print(report(found, mixes, raised(found.closed)))
    if options.out is not None:
        picture(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
