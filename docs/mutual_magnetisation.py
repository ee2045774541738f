"""Two fibres that magnetise each other: the picture of docs/magnetism.md, after B16 Figs 5.3 and 5.6.

    python docs/mutual_magnetisation.py [FOLDER]      writes magnetism_mutual.png and prints the differences

Two fibres of L/D = 10 at right angles, a tenth of a diameter apart, in 0.95 T at equal angles to x, y and z.
B16 does not give the sizes of its fibres. The field is taken on a line inside the first fibre, along its axis
and half a radius from it, and beyond its end.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from tisim.plotting import style
from tisim.sources import Cylinder, MagneticCylinders, magnetise, sample

RADIUS, LENGTH, GAP, CROSSING = 2e-4, 4e-3, 4e-5, 1.4e-3
"""Radius and length of the fibres, gap between them, and height of the second on the first (m)."""
SATURATION, FLUX = 985e3, 0.95
"""Saturation magnetisation (A/m) and applied flux density (T) of B16 section 5.6."""
PIECES = 40
"""Pieces of each fibre, for the reference."""


def fibres() -> list[Cylinder]:
    """Return both fibres, not magnetised."""
    beside = 2 * RADIUS + GAP, 0.0, CROSSING
    return [
        Cylinder(radius=RADIUS, length=LENGTH),
        Cylinder(radius=RADIUS, length=LENGTH, axis=(0.0, 1.0, 0.0), centre=beside),
    ]


def states() -> dict[str, tuple[Cylinder, ...]]:
    """Return the magnetised fibres by the name of the state, as in B16: permanent (P) or magnetisable (M)."""
    field = (FLUX / math.sqrt(3),) * 3
    along = (SATURATION / math.sqrt(3),) * 3
    bare = fibres()
    permanent = tuple(one.model_copy(update={"magnetisation": along}) for one in bare)
    mixed = [bare[0], permanent[1]]
    every = {"PP": permanent}
    for pieces in (1, PIECES):
        name = "one piece each" if pieces == 1 else f"{pieces} pieces each"
        every[f"MP, {name}"] = magnetise(mixed, field, SATURATION, math.inf, segments=pieces, permanent=[1])
        every[f"MM, {name}"] = magnetise(bare, field, SATURATION, math.inf, segments=pieces)
    return every


def line() -> np.ndarray:
    """Return heights on the line (m), at the centres of the pieces, where charges between them cancel."""
    piece = LENGTH / PIECES
    return piece * (0.5 + np.arange(int(0.75 * PIECES)))


def flux(cylinders: tuple[Cylinder, ...]) -> np.ndarray:
    """Return B with the applied field (T) on the line."""
    z = line()
    points = np.stack([0.5 * RADIUS + 0 * z, 0 * z, z], axis=1)
    return sample([MagneticCylinders(cylinders=cylinders)], "magnetic_flux_density", points)[
        0
    ] + FLUX / math.sqrt(3)


def main(folder: Path) -> None:
    """Write the picture; print the largest differences from the reference, over the field there."""
    found = {name: flux(cylinders) for name, cylinders in states().items()}
    reference, inside = found[f"MM, {PIECES} pieces each"], line() < LENGTH / 2
    near = inside & (line() > LENGTH / 2 - 2 * RADIUS)
    for name, b in found.items():
        off = np.linalg.norm(b - reference, axis=1) / np.linalg.norm(reference, axis=1)
        parts = (inside & ~near, near, ~inside)
        print(f"{name:20s} middle, near the end, beyond it:", *(f"{off[part].max():.3f}" for part in parts))
    figure = style.empty(8.0, 3.2)
    looks = {"PP": ("0.6", "--"), "MP": ("#4477aa", "-"), "MM": ("#cc3311", "-")}
    for axis, component, label in zip(figure.subplots(1, 2), (0, 2), "xz", strict=True):
        style.plain(axis)
        for name, b in found.items():
            colour, dashes = looks[name[:2]]
            rough = "one" in name
            axis.plot(
                line() / RADIUS, b[:, component], ":" if rough else dashes, color=colour, lw=1.8, label=name
            )
        axis.axvline(LENGTH / 2 / RADIUS, color="0.8", lw=1)
        axis.set(xlabel="height on the line / R", ylabel=f"$B_{label}$ (T)")
    figure.axes[0].legend(frameon=False, fontsize=8)
    figure.savefig(folder / "magnetism_mutual.png", dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
