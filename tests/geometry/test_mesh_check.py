"""The report on a mesh: whether it is closed and consistently oriented, and its suspect faces."""

import numpy as np
import pytest

from tests.geometry.test_mesh_files import VERTICES, read
from tisim import MeshWarning, geometry
from tisim.describe.explained_parts import explained
from tisim.geometry.mesh_check import MeshCheck

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def counts(faces, vertices=CORNERS):
    check = MeshCheck.of(vertices, np.array(faces))
    return (check.triangles, check.degenerate, check.duplicates, check.open_edges, check.shared_edges,
            check.turned_edges)  # fmt: skip


def test_a_tetrahedron_is_closed_and_of_one_orientation():
    assert counts(TETRAHEDRON) == (4, 0, 0, 0, 0, 0)
    # Each triangle has its own vertices, as in an STL file.
    assert counts(np.arange(12).reshape(4, 3), CORNERS[TETRAHEDRON].reshape(-1, 3)) == (4, 0, 0, 0, 0, 0)


def test_mesh_defects_are_counted():
    assert counts(TETRAHEDRON[:3]) == (3, 0, 0, 3, 0, 0)
    assert counts([*TETRAHEDRON[:3], [1, 3, 2]]) == (4, 0, 0, 0, 0, 3)
    assert counts([*TETRAHEDRON, [1, 0, 2], [0, 0, 1]]) == (5, 1, 1, 0, 0, 0)
    fin = np.vstack([CORNERS, [[0, -1, 0]]])
    assert counts([*TETRAHEDRON, [0, 1, 4]], fin) == (5, 0, 0, 2, 1, 0)
    # Three vertices on a line.
    assert counts([*TETRAHEDRON, [0, 1, 4]], np.vstack([CORNERS, [[2, 0, 0]]])) == (4, 1, 0, 0, 0, 0)


def test_explain_reports_the_mesh_once():
    open_one = geometry.TriangulatedSurface(vertices=CORNERS, faces=TETRAHEDRON[:3])
    rows = [row for row in explained(open_one).parameters if row[0] == "mesh"]
    assert [row[1] for row in rows] == ["3 triangles; open, with 3 edges of one face; of one orientation"]
    assert "; closed; of one" in str(MeshCheck.of(CORNERS, TETRAHEDRON))


def test_suspect_faces_of_a_file_give_one_warning(tmp_path):
    faces = "f 1 2 3\nf 1 3 4\n"
    read(tmp_path, "open.obj", VERTICES + faces)
    twice = r"^surface: 1 faces without area, which are left out and 2 faces that are duplicates \(.*obj\)$"
    with pytest.warns(MeshWarning, match=twice) as told:
        surface = read(tmp_path, "twice.obj", VERTICES + faces + "f 2 3 1\nf 4 3 1\nf 1 1 2\n")
    assert len(told) == 1
    assert len(surface.corners()) == 4
