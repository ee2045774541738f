"""Checks of a mesh before use: whether it is closed, and whether it has defects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MeshCheck:
    """Counts of the elements and defects of a mesh, in which vertices at equal positions are merged.

    triangles : faces with an area.
    degenerate : faces without area, which are left out.
    duplicates : faces with the same vertices as an earlier face.
    open_edges : edges of only one face.
    shared_edges : edges of more than two faces.
    turned_edges : edges of two faces of opposite orientation.
    """

    triangles: int
    degenerate: int
    duplicates: int
    open_edges: int
    shared_edges: int
    turned_edges: int

    @classmethod
    def of(cls, vertices: np.ndarray, faces: np.ndarray) -> MeshCheck:
        """Check the faces, shape (triangles, 3), of some vertices (m), shape (n, 3)."""
        corners = vertices[faces.astype(int)]
        whole = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any(axis=1)
        same = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)
        faces = same[faces.astype(int)]
        first = np.unique(np.sort(faces[whole], axis=1), axis=0, return_index=True)[1]
        once = faces[whole][first]
        ways = np.concatenate([once[:, [0, 1]], once[:, [1, 2]], once[:, [2, 0]]])
        edges, edge, count = np.unique(np.sort(ways, axis=1), axis=0, return_inverse=True, return_counts=True)
        # Two faces of equal orientation traverse their common edge in opposite directions.
        onward = np.bincount(edge.reshape(-1), ways[:, 0] < ways[:, 1], minlength=len(edges))
        return cls(
            triangles=int(whole.sum()),
            degenerate=int((~whole).sum()),
            duplicates=int(whole.sum()) - len(first),
            open_edges=int((count == 1).sum()),
            shared_edges=int((count > 2).sum()),
            turned_edges=int(((count == 2) & (onward != 1)).sum()),
        )

    def suspect(self) -> str:
        """Return a description of the defects; empty if there are none."""
        found = {
            "without area, which are left out": self.degenerate,
            "that are duplicates": self.duplicates,
        }
        return " and ".join(f"{number} faces {what}" for what, number in found.items() if number)

    def __str__(self) -> str:
        parts = [f"{self.triangles} triangles"]
        parts.append("closed" if not self.open_edges else f"open, with {self.open_edges} edges of one face")
        turned = f"{self.turned_edges} edges between faces of opposite orientation"
        parts.append(turned if self.turned_edges else "of one orientation")
        parts += [f"{self.shared_edges} edges of more than two faces"] if self.shared_edges else []
        return "; ".join([*parts, *filter(None, [self.suspect()])])
