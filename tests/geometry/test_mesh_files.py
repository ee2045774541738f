"""Mesh files: valid ones are read correctly, all others are refused with the position of the error."""

import os
import struct

import meshio
import numpy as np
import pytest

from tisim import InputError
from tisim.geometry import TriangulatedSurface, mesh_files

SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
VERTICES = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"


def facets(text="{}", number=2):
    """The two triangles of the square as a text STL, from -1 to 1 along x and y."""
    lines = []
    for corners in ([0, 1, 2], [0, 2, 3])[:number]:
        lines += ["  facet normal 0 0 1", "    outer loop"]
        lines += [f"      vertex {x:e} {y:e} {z:e}" for x, y, z in SQUARE[corners]]
        lines += ["    endloop", "  endfacet"]
    return text.format("\n".join(lines) + "\n")


FACET_END = "  endfacet\n  facet"
SOLID = facets("solid floor\n{}endsolid floor\n")


def binary(header=b"", number=2, count=None):
    body = b"".join(
        struct.pack("<12fH", 0, 0, 1, *SQUARE[corners].ravel(), 77)
        for corners in ([0, 1, 2], [0, 2, 3])[:number]
    )
    return header.ljust(80, b"\0") + struct.pack("<I", number if count is None else count) + body


def read(tmp_path, name, content):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return TriangulatedSurface.read(path)


def area(surface):
    a, b, c = np.moveaxis(surface.corners(), 1, 0)
    return 0.5 * np.cross(b - a, c - a)


SQUARES = {
    "plain.stl": SOLID,
    "capitals.stl": SOLID.upper(),
    "capital_suffix.STL": SOLID,
    "crlf.stl": SOLID.replace("\n", "\r\n"),
    "cr.stl": SOLID.replace("\n", "\r"),
    "mark.stl": b"\xef\xbb\xbf" + SOLID.encode(),
    "blank_first.stl": "\n\n" + SOLID,
    "blank_last.stl": SOLID + "\n\n",
    "blank_between.stl": SOLID.replace("endfacet\n", "endfacet\n\n"),
    "no_line_break.stl": SOLID.rstrip("\n"),
    "spaces.stl": SOLID.replace("outer loop", "outer \t loop "),
    "one_line.stl": "solid\n" + " ".join(facets().split()) + "\nendsolid",
    "split_lines.stl": "solid\n" + facets().replace(" ", "\n") + "endsolid",
    "two_solids.stl": SOLID.replace(FACET_END, "  endfacet\nendsolid floor\n\nsolid facet b\n  facet"),
    "end_solid.stl": SOLID.replace("endsolid", "end solid"),
    "no_normals.stl": SOLID.replace("normal 0 0 1", "normal -1.#IND nan 0"),
    "latin.stl": SOLID.replace("floor", "fu\xdfboden").encode("latin-1"),
    "binary.stl": binary(),
    "binary_solid.stl": binary(b"solid made by a program that writes binary files"),
    "binary_colour.stl": binary(b"COLOR=\x01\x02\x03\x04"),
    "binary_padded.stl": binary() + b"\0" * 64,
    "plain.obj": VERTICES + "f 1 2 3\nf 1 3 4\n",
    "capitals.obj": (VERTICES + "f 1 2 3\nf 1 3 4\n").upper(),
    "crlf.obj": (VERTICES + "f 1 2 3\nf 1 3 4").replace("\n", "\r\n"),
    "mark.obj": "\ufeff" + VERTICES + "f 1 2 3\nf 1 3 4\n",
    "latin.obj": b"# fu\xdfboden\ng fu\xdf\n" + (VERTICES + "f 1 2 3\nf 1 3 4\n").encode(),
    "parts.obj": f"mtllib a.mtl\no a\n{VERTICES}vt 0 0\nvn 0 0 1\ng a b\nusemtl c\ns off\nl 1 2\n"
    "f 1/1/1 2/1/1 3/1/1\n\n# face\nf 1//1 3//1 4//1 # end\n",
    "textures.obj": VERTICES + "vt 0 0\nf 1/1 2/1 3/1\nf 1/-1 3/-1 4/-1\n",
    "colours.obj": VERTICES.replace("0\n", "0 1 0.5 0\n") + "f 1 2 3\nf 1 3 4\n",
    "weights.obj": VERTICES.replace("0\n", "0 1.0\n") + "f 1 2 3\nf 1 3 4\n",
    "goes_on.obj": VERTICES + "f 1 2 \\\n 3\nf 1 3 4\n",
    "ahead.obj": "f 1 2 3\nf 1 3 4\n" + VERTICES,
    "negative.obj": VERTICES + "f -4 -3 -2\nf -4 -2 -1\n",
    "quad.obj": VERTICES + "f 1 2 3 4\n",
}


@pytest.mark.parametrize("name", SQUARES)
def test_each_way_to_write_a_square_is_read_as_the_square(name, tmp_path):
    surface = read(tmp_path, name, SQUARES[name])
    assert area(surface).tolist() == [[0, 0, 2]] * 2
    assert surface.vertices.tolist() == sorted(SQUARE.tolist())


def test_relative_indices_count_from_the_face(tmp_path):
    """Two squares, at 0 and 5 m; no triangle connects them."""
    faces = "f -4 -3 -2\nf -4 -2 -1\n"
    content = VERTICES + faces + VERTICES.replace("0\n", "5\n") + faces
    heights = read(tmp_path, "two.obj", content).corners()[..., 2]
    assert heights.tolist() == [[0] * 3, [0] * 3, [5] * 3, [5] * 3]


def test_non_convex_polygons_are_triangulated_inside(tmp_path):
    """An L of 3 m^2 in a tilted plane; a fan from its first vertex would extend beyond it."""
    flat = np.array([[2, 1], [1, 1], [1, 2], [0, 2], [0, 0], [2, 0]], float)
    places = flat @ np.array([[1, 0, 1], [0, 1, 1]]) / np.sqrt([1, 1, 1])
    content = "".join(f"v {x} {y} {z}\n" for x, y, z in places) + "f 1 2 3 4 5 6\n"
    pieces = area(read(tmp_path, "l.obj", content))
    assert len(pieces) == 4
    assert np.linalg.norm(pieces, axis=1).sum() == pytest.approx(3 * np.sqrt(3), rel=1e-12)
    assert np.linalg.norm(pieces.sum(axis=0)) == pytest.approx(3 * np.sqrt(3), rel=1e-12)


def test_other_formats_are_read_by_meshio(tmp_path):
    """Quadrilaterals are split; lines bound no area; a volume is no surface."""
    cells = [("line", [[0, 1]]), ("triangle", [[0, 1, 2]]), ("quad", [[0, 1, 2, 3]])]
    for name in ("mesh.vtk", "mesh.ply"):
        meshio.Mesh(SQUARE, cells[name.endswith("ply") :]).write(tmp_path / name)
        assert area(TriangulatedSurface.read(tmp_path / name)).tolist() == [[0, 0, 2]] * 3
    six = np.vstack([SQUARE, [[0, 1, 0], [1, 0, 0]]])
    meshio.Mesh(six, [("triangle", [[0, 1, 2]]), ("triangle6", [range(6)])]).write(tmp_path / "curved.vtk")
    with pytest.raises(
        InputError, match="surface must be of triangles or other polygons alone; received tri"
    ):
        TriangulatedSurface.read(tmp_path / "curved.vtk")


PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\n3 0 1 2\n3 0 2 {}\n"
)
OF_ITS_OWN = r"a mesh whose faces have indices of its 4 vertices, from {}"
FAULTS = {
    "zero.obj": (VERTICES + "f 0 1 2\n", OF_ITS_OWN.format("1, or -1 .*; received index 0 .*line 5")),
    "before.obj": (VERTICES + "f -5 -1 -2\n", OF_ITS_OWN.format("1, or -1 .*; received index -5 .*line 5")),
    "beyond.obj": (VERTICES + "f 1 2 3\nf 1 3 9\n", OF_ITS_OWN.format("1; received index 9 .*line 6")),
    "far.obj": (VERTICES + f"f 1 2 {10**17}\n", "received index 100000000000000000 .*line 5"),
    "beyond.ply": (PLY.format(7), OF_ITS_OWN.format("0; received index 7")),
    "negative.ply": (PLY.format(-1), OF_ITS_OWN.format("0; received index -1")),
    "cut.ply": (PLY[:-20], "a file that meshio reads; received "),
    "two.obj": (VERTICES + "f 1 2\n", "an OBJ file with three or more .*; received 'f 1 2' .*line 5"),
    "mixed.obj": (VERTICES + "f 1/1 2//1 3\n", "after 'f'; received 'f 1/1 2//1 3' .*line 5"),
    "word.obj": (VERTICES + "f 1 2 a\n", "after 'f'; received 'f 1 2 a' .*line 5"),
    "slash.obj": (VERTICES + "f 1/1 2/1 3/\n", "after 'f'; received 'f 1/1 2/1 3/' .*line 5"),
    "long.obj": (VERTICES + "f 1 2 " + 5000 * "3" + "\n", "after 'f'; received 'f 1 2 33.*line 5"),
    "many.obj": (VERTICES + "f " + 2000 * "1 " + "\n", "polygons with at most 1000 corners; received 2000 "),
    "flat.obj": (VERTICES + "v 0 0\n", "an OBJ file with 3, 4, 6 or 7 numbers .*; received 'v 0 0' .*line 5"),
    "nan.obj": (VERTICES + "v 0 nan 0\n", "numbers .* after 'v'; received 'nan' .*line 5"),
    "huge.obj": (VERTICES + "v 0 1e999 0\n", "numbers .* after 'v'; received '1e999' .*line 5"),
    "comma.obj": (VERTICES + "v 0 0,5 0\n", "numbers .* after 'v'; received '0,5' .*line 5"),
    "patch.obj": (VERTICES + "surf 0 1 0 1 1 2\n", "vertices and polygons; received 'surf .*line 5"),
    "cut_word.obj": (VERTICES + "ff 1 2 3\n", "vertices and polygons; received 'ff 1 2 3' .*line 5"),
    "cut.obj": (VERTICES + "f 1 2 \\", "an OBJ file that ends after a statement; received 'f 1 2"),
    "none.obj": (VERTICES, "a mesh with triangles; received none"),
    "wide.obj": (VERTICES.encode("utf-16"), "an OBJ file, as text in UTF-8 or ASCII; received a zero byte"),
    "wide.stl": (SOLID.encode("utf-16"), "an STL file, as text in UTF-8 or ASCII; received a zero byte"),
    "empty.stl": ("", "an STL file, binary or as text from 'solid' on; received ''"),
    "other.stl": (200 * "<html>", "an STL file, binary or as text from 'solid' on; received '<html>"),
    "none.stl": ("solid a\nendsolid a\n", "a mesh with triangles; received none"),
    "cut.stl": (
        SOLID[:250],
        "ends with 'endsolid'; received one that is cut short .*line 9",
    ),
    "no_end.stl": (facets("solid a\n{}"), "an STL file that ends with 'endsolid'; .*line 15"),
    "half.stl": (SOLID.replace("    endloop\n  endfacet\nends", "ends"), "whole facets; .*line 14"),
    "quad.stl": (
        SOLID.replace("    endloop", "vertex 0 0 0\n    endloop"),
        "an STL file of triangles, with 'endloop' here; received 'vertex' .*line 7",
    ),
    "comma.stl": (SOLID.replace("1.000", "1,000"), "three numbers .*; received '-1,000000e\\+00' .*line 4"),
    "two.stl": (SOLID.replace(" 0.000000e+00", ""), "three numbers .*; received 'vertex' .*line 5"),
    "infinite.stl": (SOLID.replace("e+00", "e+999"), "a mesh with finite coordinates; received .*inf"),
    "after.stl": (SOLID + "vertex 1 1 1\n", "without more after its 'endsolid'; received 'vertex"),
    "twice.stl": (
        SOLID.removesuffix("endsolid floor\n") + SOLID,
        "solids with whole facets; received 'solid floor' .*line 16",
    ),
    "binary_cut.stl": (
        binary()[:150],
        "binary STL of 184 bytes, .* announces 2 facets; received 150 bytes",
    ),
    "binary_solid_cut.stl": (binary(b"solid")[:150], "a binary STL of 184 bytes, .*; received 150 bytes"),
    "binary_more.stl": (binary() + b"more", "a binary STL of 184 bytes, .*; received 188 bytes"),
    "binary_huge.stl": (binary(count=2**31), "a binary STL of 107374182484 bytes, .*; received 184 bytes"),
    "binary_none.stl": (binary(number=0), "a mesh with triangles; received none"),
    "binary_nan.stl": (binary().replace(b"\0\0\x80?", b"\0\0\xc0\x7f"), "finite coordinates; received nan"),
    "mesh.what": ("v", "a file that meshio reads; received .*"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_file_that_is_damaged_is_refused_with_the_place(name, tmp_path, capfd):
    """The message is one line, and nothing else is printed."""
    content, message = FAULTS[name]
    with pytest.raises(InputError, match=f"^surface must be .*{message}") as refused:
        read(tmp_path, name, content)
    assert name in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "".join(capfd.readouterr()) == ""


@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_a_file_cut_anywhere_is_refused_or_the_whole_mesh(suffix, tmp_path):
    """Exceptions are the last face of an OBJ file, which has no end mark, and a word of a solid's name."""
    whole = {"stl": SOLID, "obj": VERTICES + "f 1 2 3\nf 1 3 4\n"}[suffix]
    least = whole.rindex({"stl": " floor", "obj": "\nf 1 3"}[suffix])
    for end in range(len(whole) + 1):
        try:
            surface = read(tmp_path, f"cut.{suffix}", whole[:end])
        except InputError:
            assert end < len(whole)
            continue
        assert end >= least
        assert np.isin(surface.corners(), SQUARE).all()
        assert suffix == "obj" or len(surface.corners()) == 2


def test_a_reader_that_hangs_is_stopped(tmp_path, monkeypatch):
    """meshio reads endlessly from a PLY file whose header has no end."""
    monkeypatch.setattr(mesh_files, "READING_TIME", 3.0)
    with pytest.raises(InputError, match=r"^surface must be a file that meshio reads to its end; "):
        read(tmp_path, "head.ply", PLY[:20])


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "vtk", "msh", "inp", "vtu"])
def test_noise_is_refused(suffix, tmp_path, capfd):
    """For any exception of the reader."""
    rng = np.random.default_rng(0)
    for size in (0, 1, 83, 84, 85, 1000) if suffix in ("stl", "obj") else (1000,):
        for content in (rng.bytes(size), b"solid" + rng.bytes(size)):
            with pytest.raises(InputError, match=r"^surface must be "):
                read(tmp_path, f"noise.{suffix}", content)
    assert "".join(capfd.readouterr()) == ""


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no fifos")
@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
@pytest.mark.parametrize("kind", ["fifo", "device", "folder"])
def test_only_regular_files_are_read(tmp_path, kind, suffix):
    """A fifo waits for ever, and a device has no end."""
    path = tmp_path / f"drum.{suffix}"
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.symlink_to("/dev/zero")
    with pytest.raises(InputError, match=rf"^surface must be a regular file; received a {kind} "):
        TriangulatedSurface.read(path)


@pytest.mark.parametrize("suffix", ["stl", "obj"])
def test_a_link_to_a_file_of_another_kind_is_not_quoted(tmp_path, suffix):
    """The scene may come from someone else, and the file may be private."""
    (tmp_path / "passwords").write_text("root:secret\n")
    link = tmp_path / f"drum.{suffix}"
    link.symlink_to("passwords")
    with pytest.raises(InputError, match=r"received a link to a file of another kind \(") as fault:
        TriangulatedSurface.read(link)
    assert "secret" not in str(fault.value)


def test_a_file_too_large_is_refused_unread(tmp_path):
    for suffix in ("stl", "obj", "ply"):
        path = tmp_path / f"sparse.{suffix}"
        with path.open("wb") as file:
            file.truncate(2**40)
        with pytest.raises(InputError, match=r"a file of at most 2147483648 bytes; received 1099511627776"):
            TriangulatedSurface.read(path)
