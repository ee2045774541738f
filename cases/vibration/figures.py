"""Figures of the case vibration: figures of one run, and of many runs."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.cases.case import size_named
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.vibration import scene as vibration
from tisim.cases.vibration.closed_forms import constants, resonances, response
from tisim.cases.vibration.response import (
    BEAT_DRIVE,
    FAST,
    SLOW,
    CentreOfGravityHistory,
    Sweep,
    beats,
    fast_scenes,
    recorded,
    slow_scenes,
)
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames
from tisim.plotting.style import empty, legend_above, letters, plain, quantity
from tisim.report.spectrum import Spectrum

MIN_SPECTRUM_FRAMES = 9
"""Least number of frames for a spectrum."""
HISTORY_FRAMES = 500
"""Number of frames of each of the eight histories in 0.1 s: 18 in the shortest period of the drive."""
FLOOR = 1e-4
"""Lower end of the drawn spectrum, as a fraction of its highest line; the side lobes of the window are below
it."""
PUBLISHED = {
    "w": vibration.CYCLOTRON,
    "k_m": vibration.STIFFNESS / vibration.MASS,
    "push": vibration.CHARGE * vibration.FIELD / vibration.MASS,
}
"""Parameters of ``response`` for the particles of Z13, 1/s, 1/s^2 and m/s^2."""
RUN_COLOUR, EXACT_COLOUR, MARK_COLOUR, OTHER_COLOUR = "#4477aa", "0.25", "#cc6677", "#228833"


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """response.png: the centre of gravity of a run over time, with its closed form, and its spectrum.

    Returns nothing for a file with fewer frames than MIN_SPECTRUM_FRAMES, such as a result.h5.
    """
    if len(trajectory) < MIN_SPECTRUM_FRAMES:
        return {}
    history, parameters = CentreOfGravityHistory.of(trajectory), constants(trajectory.scene)
    figure = empty(7.2, 6.8)
    above, below = figure.subplots(2, 1)
    for part, name, colour in ((np.real, "x", RUN_COLOUR), (np.imag, "y", MARK_COLOUR)):
        above.plot(history.time, part(history.place), color=colour, lw=1.6, label=f"{name}, as run")
        if parameters:
            closed = part(response(history.time, **parameters))
            label = "closed form" if name == "x" else None
            above.plot(history.time, closed, ":", color=EXACT_COLOUR, lw=1.4, label=label)
    quantity(above.xaxis, "time", "s")
    quantity(above.yaxis, "displacement of the\ncentre of gravity", "m")
    legend_above(above)
    plain(above)
    spectrum(below, history, parameters)
    below.set_title("spectrum of the displacement")
    letters((above, below))
    return {"response.png": figure}


def spectra(trajectory: Frames) -> list[Spectrum]:
    """Return the spectrum of the displacement of the centre of gravity, with both signs of the frequency, for
    the report of a run; nothing for a file with fewer frames than MIN_SPECTRUM_FRAMES."""
    if len(trajectory) < MIN_SPECTRUM_FRAMES:
        return []
    parameters = constants(trajectory.scene)
    omega, lines = CentreOfGravityHistory.of(trajectory).spectrum()
    shown = np.abs(omega) <= drawn_reach(omega, parameters)
    expected: dict[str, float] = {}
    if parameters:
        slow, fast = resonances(parameters["w"], parameters["k_m"])
        drive = parameters["omega"]
        expected = {
            "slow resonance": slow,
            "fast resonance": -fast,
            "drive": drive,
            "drive, clockwise": -drive,
        }
    title = "spectrum of the displacement of the centre of gravity"
    floor = FLOOR * float(lines[shown].max())
    return [Spectrum(title, "m", omega[shown], lines[shown], floor, expected)]


def drawn_reach(omega: np.ndarray, parameters: Mapping[str, float] | None) -> float:
    """Return the largest magnitude of the angular frequencies (1/s) that are drawn."""
    highest = float(omega.max())
    if not parameters:
        return highest
    return min(highest, 3.0 * max(*resonances(parameters["w"], parameters["k_m"]), parameters["omega"]))


def spectrum(axis: Axes, history: CentreOfGravityHistory, parameters: Mapping[str, float] | None) -> None:
    """Draw amplitudes of circular motion against its angular frequency, with the expected lines."""
    omega, lines = history.spectrum()
    axis.semilogy(omega, lines, color=RUN_COLOUR, lw=1.4)
    reach = drawn_reach(omega, parameters)
    if parameters:
        slow, fast = resonances(parameters["w"], parameters["k_m"])
        marks = (
            (slow, "resonances", OTHER_COLOUR), (-fast, None, OTHER_COLOUR),
            (parameters["omega"], r"$\pm\Omega$", MARK_COLOUR), (-parameters["omega"], None, MARK_COLOUR),
        )  # fmt: skip
        for at, label, colour in marks:
            axis.axvline(
                at, color=colour, ls="--" if colour == MARK_COLOUR else ":", lw=1.2, label=label, zorder=0
            )
        legend_above(axis)
    axis.set_xlim(-reach, reach)
    visible_lines = lines[np.abs(omega) <= reach]
    axis.set_ylim(FLOOR * visible_lines.max(), 3 * visible_lines.max())
    axis.set_xlabel("angular frequency (1/s), anticlockwise > 0")
    axis.set_ylabel("amplitude (m)")
    plain(axis)


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """resonance.png, resonance.csv: the resonance curve and beats; circles show arrays with the near field of
    the size. histories.png, histories.csv: the eight histories of Z13 Fig. 3 with this near field."""
    settings = size_named(size, vibration.SIZES).scene
    near = str(settings.get("near_field", "printed"))
    ratios = np.linspace(0.04, 2.0, 99)
    around = np.linspace(0.9, 1.1, 41)
    lots = (
        fast_scenes(np.unique(np.round(np.concatenate([ratios, around]), 6))),
        slow_scenes(np.linspace(0.05, 1.0, 96)),
        fast_scenes(vibration.RATIOS, near, sites=3),
    )
    parts = len(lots) + 1
    fast, slow, arrays = (
        Sweep.of(scenes, progress_of_part(progress, finished, parts)) for finished, scenes in enumerate(lots)
    )
    eight = recorded(lots[-1], HISTORY_FRAMES, progress_of_part(progress, len(lots), parts))
    return {
        "resonance.png": resonance_figure(slow, fast, arrays, near, beats()),
        "resonance.csv": table(
            ("one particle", slow), ("one particle", fast), (f"27, near field {near}", arrays)
        ),
        "histories.png": histories_figure(eight),
        "histories.csv": histories_table(eight),
    }


def exact_histories(histories: Sequence[CentreOfGravityHistory]) -> list[np.ndarray]:
    """Return the closed forms of the histories of Z13 Fig. 3, x + i y, m."""
    return [
        response(history.time, omega=ratio * vibration.CYCLOTRON, **PUBLISHED)
        for ratio, history in zip(vibration.RATIOS, histories, strict=True)
    ]


def histories_figure(histories: Sequence[CentreOfGravityHistory]) -> Figure:
    """Draw the displacement of the centre of gravity over time for the eight drives of Z13 Fig. 3, with its
    closed form."""
    figure = empty(10.4, 10.4)
    axes = figure.subplots(4, 2, sharex=True)
    exact = exact_histories(histories)
    for axis, ratio, history, true in zip(axes.flat, vibration.RATIOS, histories, exact, strict=True):
        for part, name, colour in ((np.real, "x", RUN_COLOUR), (np.imag, "y", MARK_COLOUR)):
            axis.plot(1e3 * history.time, part(history.place), color=colour, lw=1.4, label=f"{name}, as run")
            label = "closed form" if name == "y" else None
            axis.plot(1e3 * history.time, part(true), ":", color="k", lw=1.0, label=label)
        quantity(axis.yaxis, "displacement", "m")
        axis.set_title(rf"$\Omega$ = {ratio:g} $\omega$")
        axis.set_xlim(0.0, 1e3 * history.time[-1])
        plain(axis)
    for axis in axes[-1]:
        axis.set_xlabel("time (ms)")
    legend_above(axes[0, 1])
    letters(axes.flat)
    return figure


def histories_table(histories: Sequence[CentreOfGravityHistory]) -> str:
    """Return the largest displacement in each history, and its largest distance from the closed form, as
    CSV."""
    rows: list[list[object]] = [["omega_over_w", "peak_m", "largest_distance_from_closed_form_m"]]
    exact = exact_histories(histories)
    for ratio, history, true in zip(vibration.RATIOS, histories, exact, strict=True):
        off = float(np.abs(history.place - true).max())
        rows.append([ratio, float(np.abs(history.place).max()), off])
    return csv_text(rows)


def table(*sweeps: tuple[str, Sweep]) -> str:
    """Return the largest displacements of all sweeps as CSV."""
    rows: list[list[object]] = [
        ["particles", "duration_s", "omega_1_s", "omega_over_w", "peak_m", "closed_form_m"]
    ]
    for what, sweep in sweeps:
        for row in zip(sweep.omega, sweep.omega / vibration.CYCLOTRON, sweep.peaks, sweep.exact, strict=True):
            rows.append([what, sweep.duration, *map(float, row)])
    return csv_text(rows)


def resonance_figure(
    slow: Sweep, fast: Sweep, arrays: Sweep, near: str, history: CentreOfGravityHistory
) -> Figure:
    """Draw resonance curves around both resonances, beats with their closed form, and their spectrum."""
    figure = empty(10.4, 8.4)
    (left, right), (below, lines) = figure.subplots(2, 2)
    for axis, sweep, at, name in ((left, slow, SLOW, "slow"), (right, fast, FAST, "fast")):
        axis.semilogy(sweep.omega, sweep.exact, color=EXACT_COLOUR, lw=1.0, label="closed form")
        axis.semilogy(sweep.omega, sweep.peaks, ".", color=RUN_COLOUR, ms=5, label="one particle, as run")
        axis.axvline(
            at, color=OTHER_COLOUR, ls=":", lw=1.2, label=f"{name} resonance, {at:.4g} 1/s", zorder=0
        )
        axis.set_title(f"largest displacement within {sweep.duration:g} s")
        axis.set_xlabel(r"drive frequency $\Omega$ (1/s)")
        axis.set_ylabel("displacement of the centre of gravity (m)")
        plain(axis)
    label = f"27 particles, near field {near}:\nthe ratios of Z13 Fig. 3"
    right.semilogy(arrays.omega, arrays.peaks, "o", mfc="none", color=MARK_COLOUR, ms=8, label=label)
    for axis in (left, right):
        axis.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2)
    below.plot(1e3 * history.time, np.abs(history.velocity), color=RUN_COLOUR, lw=0.9)
    expected, period = 2 * np.pi / (FAST * (1 - BEAT_DRIVE)), history.beat_period()
    for k in range(int(history.time[-1] / expected + 0.5) + 1):
        below.axvline(1e3 * k * expected, color=OTHER_COLOUR, ls=":", lw=1.2, zorder=0)
    below.set_title(
        rf"beats at $\Omega$ = {BEAT_DRIVE:g} of the fast resonance: {1e3 * period:.2f} ms as run;"
        f"\ndotted, $2\\pi/|\\Omega - \\omega|$ = {1e3 * expected:.2f} ms"
    )  # fmt: skip
    below.set_ylabel("speed (m/s)")
    below.set_xlabel("time (ms)")
    plain(below)
    spectrum(lines, history, {**PUBLISHED, "omega": BEAT_DRIVE * FAST})
    lines.set_title("spectrum of the displacement")
    letters((left, right, below, lines))
    return figure
