"""Figures of the case capture: of one run, and of many."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from cases import capture
from cases.capture_statistics import (
    ANGLES,
    ASPECTS,
    MICRO,
    Settings,
    even,
    fraction,
    fractions,
    isotropic,
    mean,
    results,
)
from cases.statistics import Mean
from tisim import Scene
from tisim.batches import Progress, share
from tisim.figure import empty, plain
from tisim.frames import Frames
from tisim.result import Result
from tisim.sources.cylinder import Cylinder, MagneticCylinders
from tisim.sources.sample import sample

LEAST_FORCE = 0.5e-15
"""N, of what counts as capture volume (B16 section 6.4.1)."""
FEW = 10
"""Repeats of a figure; the checks take REPEATS."""
PLANE = 181
"""Points along a side of a map."""


def cylinder(scene: Scene) -> Cylinder:
    """The one cylinder of a scene."""
    return next(e for e in scene.effects if isinstance(e, MagneticCylinders)).cylinders[0]


def outline(axis: Axes, body: Cylinder) -> None:
    """A cylinder whose axis lies in the xz plane, as seen along y. In um."""
    along = np.array([body.axis[0], body.axis[2]])
    across = np.array([-along[1], along[0]])
    a, b = 0.5 * body.length * along / MICRO, body.radius * across / MICRO
    corners = np.array([a + b, a - b, -a - b, -a + b])
    axis.fill(*corners.T, facecolor="0.75", edgecolor="0.35", lw=0.8, zorder=3)


def pictures(found: Frames) -> Mapping[str, Figure]:
    """trajectories.png: paths in the xz plane coloured by time (B16 Fig. 6.5), and captured fraction in time.

    None of a file with fewer than three frames, such as a result.h5.
    """
    if len(found) < 3:
        return {}
    frames = list(found)
    places = np.array([frame.arrays["position"] for frame in frames]) / MICRO
    figure = empty(9.4, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(0.8, 1.0))
    norm = Normalize(0.0, found.times[-1])
    pieces = np.stack([places[:-1], places[1:]], axis=2)[..., [0, 2]].reshape(-1, 2, 2)
    when = np.repeat(found.times[1:], places.shape[1])
    lines = LineCollection(list(pieces), cmap="turbo", norm=norm, lw=0.8)
    lines.set_array(when)
    left.add_collection(lines)
    outline(left, cylinder(found.scene))
    left.autoscale()
    left.set(xlabel="x, along the field (um)", ylabel="z (um)", aspect="equal")
    figure.colorbar(lines, ax=left, label="time (s)", shrink=0.8)
    state = frames[-1].arrays
    at = np.sort(state["captured_at"][state["captured_at"] >= 0])
    number = len(state["captured_at"])
    right.step(
        [0.0, *at, found.times[-1]],
        np.array([*range(len(at) + 1), len(at)]) / number,
        where="post", color="#4477aa", lw=1.6,
    )  # fmt: skip
    right.set(xlabel="time (s)", ylabel=f"captured, of {number} particles", ylim=(0, 1.02))
    plain(right)
    return {"trajectories.png": figure}


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """field.png, volume.png: of the magnet; capture.png, capture.csv: captured fractions, for particles of
    all sizes whatever ``size`` is."""
    angles: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": 20.0, "part": part}
        for n in (75, 212) for part in ("top", "side") for a in ANGLES
    ]  # fmt: skip
    sizes: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": 20.0} for n in capture.MOMENT for a in ANGLES
    ]
    aspects: list[Settings] = [
        {"nanometres": n, "angle": a, "aspect": r} for n in (50, 125, 212) for r in ASPECTS for a in ANGLES
    ]
    parts = []
    for done, settings in enumerate((angles, sizes, aspects)):
        found = results(settings, FEW, share(progress, done, 3))
        parts.append(list(zip(settings, found, strict=True)))
    return {
        "field.png": field(),
        "volume.png": volume(),
        "capture.png": captured(*parts),
        "capture.csv": table([row for part in parts for row in part]),
    }


def plane(scene: Scene, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of the xz plane, (PLANE, PLANE, 3) in m, and B (T) and its gradient (T/m) there."""
    line = np.linspace(-reach, reach, PLANE)
    x, z = np.meshgrid(line, line)
    # Off the plane of symmetry by next to nothing, so that no point lies on an edge.
    points = np.stack([x, np.full_like(x, 1e-9), z], axis=-1)
    b, slope = sample(scene.effects, "magnetic_flux_density", points.reshape(-1, 3))
    return points, b.reshape(*x.shape, 3), slope.reshape(*x.shape, 3, 3)


def field() -> Figure:
    """Field lines and |B| around a short cylinder at three angles to the field."""
    figure = empty(10.4, 3.9)
    axes = figure.subplots(1, 3, sharey=True)
    for axis, angle in zip(axes, (0.0, 45.0, 90.0), strict=True):
        scene = capture.scene(angle=angle)
        points, b, _ = plane(scene, 1.1e-3)
        line = points[0, :, 0] / MICRO
        drawn = axis.pcolormesh(line, line, np.linalg.norm(b, axis=-1), cmap="viridis", vmin=0.3, vmax=2.0,
                                shading="auto", rasterized=True)  # fmt: skip
        axis.streamplot(line, line, b[..., 0], b[..., 2], color="white", linewidth=0.6, arrowsize=0.7,
                        density=1.1)  # fmt: skip
        body = cylinder(scene)
        outline(axis, body)
        axis.patches[-1].set_facecolor("none")
        axis.patches[-1].set_edgecolor("white")
        axis.set(xlabel="x, along the field (um)", aspect="equal", title=f"axis at {angle:.0f}° to the field")
        axis.set(xlim=(line[0], line[-1]), ylim=(line[0], line[-1]))
    axes[0].set_ylabel("z (um)")
    figure.colorbar(drawn, ax=axes, label="|B| (T)", shrink=0.8)
    return figure


def volume() -> Figure:
    """Magnetic force on a particle of 50 nm towards the cylinder, where above LEAST_FORCE (B16 Fig. 6.3;
    there magnetised along the field, here as Stoner and Wohlfarth say)."""
    figure = empty(10.4, 6.6)
    grid = figure.subplots(2, 3)
    for row, aspect in zip(grid, (5 / 3, 20 / 3), strict=True):
        for axis, angle in zip(row, (0.0, 45.0, 90.0), strict=True):
            scene = capture.scene(nanometres=50, angle=angle, aspect=aspect)
            body = cylinder(scene)
            points, b, slope = plane(scene, 0.75 * body.length + 0.9e-3)
            moment = capture.MOMENT[50] * b / np.linalg.norm(b, axis=-1, keepdims=True)
            force = np.einsum("...ab,...b->...a", slope, moment)
            inward = attraction(force, points, body)
            line = points[0, :, 0] / MICRO
            shown = axis.pcolormesh(
                line, line, np.ma.masked_less(inward, LEAST_FORCE), cmap="magma_r", shading="auto",
                norm=LogNorm(LEAST_FORCE, 1e3 * LEAST_FORCE), rasterized=True,
            )  # fmt: skip
            outline(axis, body)
            axis.set(aspect="equal", xlim=(line[0], line[-1]), ylim=(line[0], line[-1]))
            axis.set_title(f"L/D = {aspect:.3g}, {angle:.0f}°", fontsize=10)
    for axis in grid[-1]:
        axis.set_xlabel("x, along the field (um)")
    for axis in grid[:, 0]:
        axis.set_ylabel("z (um)")
    figure.colorbar(shown, ax=grid, label="force towards the cylinder (N)", shrink=0.7)
    return figure


def attraction(force: np.ndarray, points: np.ndarray, body: Cylinder) -> np.ndarray:
    """Component of a force (N) towards the nearest point of a cylinder at the origin; 0 inside it."""
    axis = np.asarray(body.axis)
    z = points @ axis
    radial = points - z[..., None] * axis
    rho = np.linalg.norm(radial, axis=-1)
    over, beyond = np.maximum(rho - body.radius, 0.0), np.maximum(np.abs(z) - body.length / 2, 0.0)
    away = (over / np.maximum(rho, 1e-30))[..., None] * radial + (np.sign(z) * beyond)[..., None] * axis
    distance = np.linalg.norm(away, axis=-1)
    towards = -(force * away).sum(axis=-1) / np.maximum(distance, 1e-30)
    return np.where(distance > 0, towards, 0.0)


Group = Sequence[tuple[Mapping[str, float], Sequence[Result]]]


def captured(angles: Group, sizes: Group, aspects: Group) -> Figure:
    """Fraction in time by angle, TOP and SIDE (B16 Fig. 6.4); at the end by angle and size (6.6a), and by
    aspect ratio (6.6b), there the even mean over angles."""
    figure = empty(10.4, 8.6)
    grid = figure.subplots(3, 2)
    times = np.linspace(0.0, capture.DURATION, 101)
    colours = colormaps["viridis"](np.linspace(0.0, 0.92, len(ANGLES)))
    for k, axis in enumerate(grid[:2].flat):
        group = angles[k * len(ANGLES) : (k + 1) * len(ANGLES)]
        for (settings, found), colour in zip(group, colours, strict=True):
            curve = np.mean([[fraction(r.state, t) for t in times] for r in found], axis=0)
            axis.plot(times, curve, color=colour, lw=1.4, label=f"{settings['angle']:.0f}°")
        settings = group[0][0]
        axis.set_title(f"{settings['nanometres']} nm, {str(settings['part']).upper()}, L/D = 20", fontsize=10)
        axis.set(xlabel="time (s)", ylabel="captured fraction", ylim=(0, 1.02))
    grid[0, 0].legend(frameon=False, fontsize=8, ncols=2, title="axis to field", title_fontsize=8)
    left, right = grid[2]
    by_size(left, sizes)
    by_aspect(right, aspects)
    for axis in grid.flat:
        plain(axis)
    return figure


def bars(axis: Axes, x: Sequence[float], means: Sequence[Mean], colour: object, label: str) -> None:
    axis.errorbar(
        x, [m.value for m in means], [m.half for m in means], color=colour, lw=1.3, marker="o", ms=3,
        capsize=2, label=label,
    )  # fmt: skip


def by_size(axis: Axes, sizes: Group) -> None:
    colours = colormaps["plasma"](np.linspace(0.0, 0.88, len(capture.MOMENT)))
    for k, (n, colour) in enumerate(zip(capture.MOMENT, colours, strict=True)):
        group = sizes[k * len(ANGLES) : (k + 1) * len(ANGLES)]
        bars(axis, ANGLES, [mean(found) for _, found in group], colour, f"{n} nm")
    axis.set(xlabel="angle of the axis to the field (°)", ylabel="captured in 50 s, L/D = 20", ylim=(0, 1.02))
    axis.legend(frameon=False, fontsize=8, ncols=2)


def by_aspect(axis: Axes, aspects: Group) -> None:
    found = iter(aspects)
    for n, colour in zip((50, 125, 212), ("#228833", "#4477aa", "#cc6677"), strict=True):
        groups = [np.array([fractions(next(found)[1]) for _ in ANGLES]) for _ in ASPECTS]
        bars(axis, ASPECTS, [Mean.of(even(group)) for group in groups], colour, f"{n} nm")
        axis.plot(ASPECTS, [isotropic(group).mean() for group in groups], ":", color=colour, lw=1.2)
    axis.set(xlabel="L/D", ylabel="captured in 50 s", ylim=(0.4, 1.0), xscale="log")
    axis.set_xticks([2, 5, 10, 20], ["2", "5", "10", "20"])
    axis.minorticks_off()
    axis.set_title("even mean over angles; dotted: all directions equally likely", fontsize=9)
    axis.legend(frameon=False, fontsize=8)


def table(rows: Group) -> str:
    """All of it as CSV."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(["radius_nm", "angle_deg", "aspect", "part", "repeats", "captured", "half_width_95"])
    for settings, found in rows:
        m = mean(found)
        part = settings.get("part", "all")
        writer.writerow([settings["nanometres"], settings["angle"], settings["aspect"], part, len(found),
                         m.value, m.half])  # fmt: skip
    return text.getvalue()
