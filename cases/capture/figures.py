"""Figures of the case capture: figures of one run, and of its magnet."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from tisim import Scene
from tisim.cases.capture import curves, regions
from tisim.cases.capture import scene as capture
from tisim.cases.common.magnetic_fibre import MICRO, Magnetised
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames
from tisim.plotting.style import TIME, empty, letters, plain
from tisim.sources import Cylinder, MagneticCylinders, sample

LEAST_FORCE = 0.5e-15
"""Least attractive force on a particle within the capture volume, N (B16 section 6.4.1)."""
PLANE, SPACE = 181, 96
"""Number of points along a side of a map, and along a side of the box in which the capture volume is
counted."""
MARKS = (-2000, 0, 2000)
"""Positions of the tick marks along both axes of the force maps, µm."""
CYLINDERS: tuple[tuple[float, Magnetised], ...] = (
    (0.0, "minimum"), (45.0, "minimum"), (45.0, "fixed"), (90.0, "minimum")
)  # fmt: skip
"""The angles (degrees) of the cylinders whose capture volumes are drawn, and how they are magnetised."""
BEYOND = 2.5e-3
"""Upper bound of the distance of the capture volume from the cylinder for particles of 50 nm, m."""


def cylinder(scene: Scene) -> Cylinder:
    """Return the one cylinder of a scene."""
    return next(e for e in scene.effects if isinstance(e, MagneticCylinders)).cylinders[0]


def outline(axis: Axes, body: Cylinder) -> None:
    """Draw a cylinder whose axis lies in the xz plane, as seen along y, in µm."""
    along = np.array(body.direction)[[0, 2]]
    across = np.array([-along[1], along[0]])
    a, b = 0.5 * body.length * along / MICRO, body.radius * across / MICRO
    corners = np.array([a + b, a - b, -a - b, -a + b])
    axis.fill(*corners.T, facecolor="0.75", edgecolor="0.35", lw=0.8, zorder=3)


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """trajectories.png: paths in the xz plane coloured by time (B16 Fig. 6.5), and captured fraction over
    time.

    Returns nothing for a file with fewer than three frames, such as a result.h5.
    """
    if len(trajectory) < 3:
        return {}
    frames = list(trajectory)
    places = np.array([frame.arrays["position"] for frame in frames]) / MICRO
    figure = empty(9.4, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(0.8, 1.0))
    norm = Normalize(0.0, trajectory.times[-1])
    pieces = np.stack([places[:-1], places[1:]], axis=2)[..., [0, 2]].reshape(-1, 2, 2)
    when = np.repeat(trajectory.times[1:], places.shape[1])
    lines = LineCollection(list(pieces), cmap=TIME, norm=norm, lw=0.8)
    lines.set_array(when)
    left.add_collection(lines)
    outline(left, cylinder(trajectory.scene))
    left.autoscale()
    left.set(xlabel="x, along the field (µm)", ylabel="z (µm)", aspect="equal")
    figure.colorbar(lines, ax=left, label="time (s)", shrink=0.8)
    state = frames[-1].arrays
    at = np.sort(state["captured_at"][state["captured_at"] >= 0])
    number = len(state["captured_at"])
    right.step(
        [0.0, *at, trajectory.times[-1]],
        np.array([*range(len(at) + 1), len(at)]) / number,
        where="post", color="#4477aa", lw=1.6,
    )  # fmt: skip
    right.set(xlabel="time (s)", ylabel=f"captured fraction of {number} particles", ylim=(0, 1.02))
    plain(right)
    left.set_title("paths, as seen along y")
    letters((left, right))
    return {"trajectories.png": figure}


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """field.png, volume.png: field and capture volume of the magnet; capture.png, capture.csv: captured
    fractions; brownian.png: Brownian fractions; regions.png: captured fractions by start region.

    The fractions are of all particle sizes, for any ``size``.
    """
    return {
        "field.png": field(),
        "volume.png": volume(),
        **curves.figures(progress_of_part(progress, 0, 2)),
        "regions.png": regions.figure(progress_of_part(progress, 1, 2)),
    }


def plane(reach: float) -> np.ndarray:
    """Return points of the xz plane up to reach (m) from the origin, (PLANE, PLANE, 3) in m."""
    line = np.linspace(-reach, reach, PLANE)
    x, z = np.meshgrid(line, line)
    # A tiny offset from the plane of symmetry, so that no point lies on an edge.
    return np.stack([x, np.full_like(x, 1e-9), z], axis=-1)


def field() -> Figure:
    """Draw field lines and |B| around a short cylinder at three angles to the field."""
    figure = empty(10.4, 3.7)
    axes = figure.subplots(1, 3, sharey=True)
    for axis, angle in zip(axes, (0.0, 45.0, 90.0), strict=True):
        scene = capture.scene(angle=angle)
        points = plane(1.1e-3)
        b, _ = sample(scene.effects, "magnetic_flux_density", points.reshape(-1, 3))
        b = b.reshape(points.shape)
        line = points[0, :, 0] / MICRO
        mesh = axis.pcolormesh(line, line, np.linalg.norm(b, axis=-1), cmap="viridis", vmin=0.3, vmax=2.0,
                                shading="auto", rasterized=True)  # fmt: skip
        axis.streamplot(line, line, b[..., 0], b[..., 2], color="white", linewidth=0.6, arrowsize=0.7,
                        density=1.1)  # fmt: skip
        body = cylinder(scene)
        outline(axis, body)
        axis.patches[-1].set_facecolor("none")
        axis.patches[-1].set_edgecolor("white")
        axis.set(xlabel="x, along the field (µm)", aspect="equal", title=f"axis at {angle:.0f}° to the field")
        axis.set(xlim=(line[0], line[-1]), ylim=(line[0], line[-1]))
    axes[0].set_ylabel("z (µm)")
    letters(axes)
    figure.colorbar(mesh, ax=axes, label="magnetic flux density |B| (T)", shrink=0.8)
    return figure


def volume() -> Figure:
    """Draw the magnetic force on a particle of 50 nm towards the cylinder, if above LEAST_FORCE (B16 Fig.
    6.3).

    The cylinder of B16's figure is magnetised along the field. The direction of least energy (Stoner and
    Wohlfarth), as in all other sections, differs from it only between 0 and 90 degrees: at 45 degrees both
    are drawn.
    """
    figure = empty(13.4, 6.8)
    grid = figure.subplots(2, len(CYLINDERS))
    for row, aspect in zip(grid, (5 / 3, 20 / 3), strict=True):
        for axis, (angle, magnetised) in zip(row, CYLINDERS, strict=True):
            scene = capture.scene(nanometres=50, angle=angle, aspect=aspect, magnetised=magnetised)
            body = cylinder(scene)
            points = plane(0.6 * body.length + 1.5e-3)
            inward = pull(scene, points)
            line = points[0, :, 0] / MICRO
            mesh = axis.pcolormesh(
                line, line, np.ma.masked_less(inward, LEAST_FORCE), cmap="magma_r", shading="auto",
                norm=LogNorm(LEAST_FORCE, 1e3 * LEAST_FORCE), rasterized=True,
            )  # fmt: skip
            outline(axis, body)
            arrow(axis, body)
            axis.set(aspect="equal", xlim=(line[0], line[-1]), ylim=(line[0], line[-1]))
            axis.set(xticks=MARKS, yticks=MARKS)
            own = capture_volume(scene)
            turned = "" if angle in (0.0, 90.0) else f", M at {magnetised_at(body):.0f}°"
            axis.set_title(f"L/D = {aspect:.3g}, {angle:.0f}°{turned}:\n{own:.1f} times its own volume")
    for axis in grid[-1]:
        axis.set_xlabel("x, along the field (µm)")
    for axis in grid[:, 0]:
        axis.set_ylabel("z (µm)")
    letters(grid.flat)
    figure.colorbar(mesh, ax=grid, label="force towards the cylinder (N)", shrink=0.7)
    return figure


def magnetised_at(body: Cylinder) -> float:
    """Return the angle between the axis and the magnetisation of a cylinder, degrees."""
    m = np.array(body.magnetisation)
    return float(np.degrees(np.arccos(np.clip(m @ np.array(body.direction) / np.linalg.norm(m), -1.0, 1.0))))


def arrow(axis: Axes, body: Cylinder) -> None:
    """Draw the direction of the magnetisation of a cylinder at its centre."""
    x, z = (
        np.array(body.magnetisation)[[0, 2]] / np.linalg.norm(body.magnetisation) * 0.5 * body.radius / MICRO
    )
    style = {"arrowstyle": "->", "color": "black", "shrinkA": 0, "shrinkB": 0}
    axis.annotate("", xy=(x, z), xytext=(-x, -z), arrowprops=style)


def pull(scene: Scene, points: np.ndarray) -> np.ndarray:
    """Return the magnetic force (N) on a particle of the scene towards its cylinder, at points (..., 3) in
    m."""
    b, slope = sample(scene.effects, "magnetic_flux_density", points.reshape(-1, 3))
    size = scene.particles.arrays(scene.domain, scene.seed)["saturation_moment"][0]
    moment = size * b / np.linalg.norm(b, axis=-1, keepdims=True)
    force = np.einsum("kab,kb->ka", slope, moment).reshape(points.shape)
    return attraction(force, points, cylinder(scene))


def capture_volume(scene: Scene) -> float:
    """Return the capture volume divided by the volume of the cylinder (B16 6.4.1).

    In the capture volume the cylinder attracts a particle with LEAST_FORCE or more. It is counted at the
    centres of cells, SPACE along each side of a box that extends BEYOND the cylinder.
    """
    body = cylinder(scene)
    half = 0.5 * body.length * np.abs(body.direction) + BEYOND
    lines = [h * ((2 * np.arange(SPACE) + 1) / SPACE - 1) for h in half]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    part = float((pull(scene, points) >= LEAST_FORCE).mean())
    return part * float(np.prod(2 * half)) / (np.pi * body.radius**2 * body.length)


def attraction(force: np.ndarray, points: np.ndarray, body: Cylinder) -> np.ndarray:
    """Return the component of a force (N) towards the nearest point of a cylinder at the origin; 0 inside
    it."""
    axis = np.asarray(body.direction)
    z = points @ axis
    radial = points - z[..., None] * axis
    rho = np.linalg.norm(radial, axis=-1)
    over, beyond = np.maximum(rho - body.radius, 0.0), np.maximum(np.abs(z) - body.length / 2, 0.0)
    away = (over / np.maximum(rho, 1e-30))[..., None] * radial + (np.sign(z) * beyond)[..., None] * axis
    distance = np.linalg.norm(away, axis=-1)
    towards = -(force * away).sum(axis=-1) / np.maximum(distance, 1e-30)
    return np.where(distance > 0, towards, 0.0)
