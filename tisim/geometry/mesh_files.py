"""Reading of triangle meshes: STL and OBJ are read here, other formats by meshio.

A misread mesh is dangerous, because grains would fall through an unnoticed hole. Each statement of a file is
therefore checked, and a file that is damaged or truncated is refused with the line number.
"""

from __future__ import annotations

import importlib.util
import io
import math
import os
import re
import subprocess
import sys
from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np

from tisim.errors import InputError, abbreviated, printable
from tisim.files import regular_file
from tisim.geometry.polygons import MOST_CORNERS, triangulated
from tisim.geometry.triangle_grid import MOST_LISTED

MOST_BYTES = 2**31
"""Largest file that is read, bytes: as text, MOST_LISTED triangles take about 1 GB."""
Mesh = tuple[np.ndarray, np.ndarray]
"""The positions of vertices, shape (n, 3), and the vertex indices of each triangle, from 0, shape (triangles,
3)."""

STL_HEADER, STL_FACET = 84, 50
"""Sizes in a binary STL, bytes: a header of 80 bytes of comment and 4 for the number of facets, then each
facet."""
_VERTEX = ("vertex", "number", "number", "number")
FACET = ("facet", "normal", "", "", "", "outer", "loop", *_VERTEX, *_VERTEX, *_VERTEX, "endloop", "endfacet")
"""The words of a facet in a text STL. Its normal is ignored: some programs write -1.#IND for a sliver."""
UTF_8, UTF_16 = b"\xef\xbb\xbf", (b"\xff\xfe", b"\xfe\xff")
"""Byte order marks with which a text may begin."""
OBJ_FACES = ("f", "fo")
OBJ_IGNORED = frozenset(
    (
        *("vt", "vn", "vp", "g", "o", "s", "mg", "l", "p", "usemtl", "mtllib", "usemap", "maplib", "bevel"),
        *("c_interp", "d_interp", "lod", "shadow_obj", "trace_obj", "deg", "bmat", "step", "cstype"),
    )
)
"""Statements of OBJ that do not change the surface: textures, normals, groups, materials, lines, points."""
NUMBER_WORD = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
CORNER_WORD = re.compile(r"([-+]?\d{1,18})(/[-+]?\d+|//[-+]?\d+|/[-+]?\d+/[-+]?\d+)?", re.ASCII)


BY_MESHIO = """
import io, sys, numpy, meshio
from contextlib import redirect_stdout
archive = io.BytesIO()
with redirect_stdout(sys.stderr), numpy.errstate(all="ignore"):
    try:
        mesh = meshio.read(sys.argv[1])
    except MemoryError:
        sys.exit("too little memory")
    blocks = {f"{k}_{b.type}": b.data for k, b in enumerate(mesh.cells) if b.dim == 2}
    numpy.savez(archive, points=mesh.points, **blocks)
sys.stdout.buffer.write(archive.getvalue())
"""
READING_TIME, READING_RATE = 20.0, 1e5
"""Time limit for meshio: a constant, s, plus the size of the file divided by a rate, byte/s."""


class MeshFile:
    """A mesh file; messages refer to it by ``where``, its path in the scene."""

    def __init__(self, path: Path, where: str) -> None:
        self.path, self.where = path, where
        self.private = False

    def read(self) -> Mesh:
        """Return the mesh; raise InputError if the file is not a mesh, or is damaged."""
        # Reading a fifo could block for ever, and a device may have no end.
        other = regular_file.irregular(self.path)
        if other is not None:
            self.refuse("a regular file", other)
        # A scene from another user may link to a private file, so its content is not quoted in messages.
        self.private = self.path.resolve().suffix.lower() != self.path.suffix.lower()
        try:
            size = self.path.stat().st_size
            if size > MOST_BYTES:
                self.refuse(f"a file of at most {MOST_BYTES} bytes", size)
            reader = {".stl": self._stl, ".obj": self._obj}.get(self.path.suffix.lower(), self._by_meshio)
            vertices, faces = reader()
        except OSError as fault:
            self.refuse("a file that can be read", fault.strerror or str(fault))
        except MemoryError:
            self.refuse("a mesh that the memory of this machine can hold", f"{size} bytes")
        if not len(faces):
            self.refuse("a mesh with triangles", "none")
        if not np.isfinite(vertices).all():
            self.refuse("a mesh with finite coordinates", str(vertices[~np.isfinite(vertices)][0]))
        return vertices, faces

    def refuse(self, rule: str, received: object, line: int | None = None) -> NoReturn:
        text = received if isinstance(received, str) else abbreviated(received)
        if self.private:
            text = "a link to a file of another kind"
        at = "" if line is None else f", line {line}"
        message = f"{printable(self.where)} must be {rule}; received {printable(text)} "
        raise InputError(f"{message}({printable(str(self.path))}{at})") from None

    def _text(self, what: str) -> Iterator[tuple[int, str]]:
        """Yield the lines of a text with their numbers, from 1, without blank ones."""
        # Names and comments may be in any encoding; statements are ASCII.
        with self.path.open(encoding="utf-8-sig", errors="replace") as file:
            for number, line in enumerate(file, 1):
                if "\0" in line:
                    self.refuse(f"{what}, as text in UTF-8 or ASCII", "a zero byte", number)
                if stripped := line.strip():
                    yield number, stripped

    def _coordinates(self, words: list[str], line: int, rule: str) -> list[float]:
        for word in words:
            if not NUMBER_WORD.fullmatch(word) or not math.isfinite(float(word)):
                self.refuse(rule, repr(word), line)
        return [float(word) for word in words]

    def _stl(self) -> Mesh:
        with self.path.open("rb") as file:
            head, size = file.read(STL_HEADER), self.path.stat().st_size
        count = int.from_bytes(head[80:], "little")
        whole = STL_HEADER + STL_FACET * count
        # The size identifies a binary file, because some binary files begin with "solid".
        if len(head) == STL_HEADER and size == whole:
            return self._binary_stl(count)
        text = head.removeprefix(UTF_8).lstrip().lower()
        if head.startswith(UTF_16) or (text.startswith(b"solid") and b"\0" not in head):
            return self._text_stl()
        if len(head) < STL_HEADER or (b"\0" not in head and size < whole and head.isascii()):
            self.refuse("an STL file, binary or as text from 'solid' on", repr(head[:20])[1:])
        if size > whole and self._is_blank_from(whole):
            return self._binary_stl(count)
        rule = f"a binary STL of {whole} bytes, as its header announces {count} facets"
        self.refuse(rule, f"{size} bytes")

    def _binary_stl(self, count: int) -> Mesh:
        if count > MOST_LISTED:
            self.refuse(f"a mesh of at most {MOST_LISTED} triangles", count)
        facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        with self.path.open("rb") as file:
            file.seek(STL_HEADER)
            read = np.frombuffer(file.read(count * STL_FACET), facet)
        return _separate(read["corners"].reshape(-1, 3).astype(float))

    def _is_blank_from(self, begin: int) -> bool:
        with self.path.open("rb") as file:
            file.seek(begin)
            return not any(part.strip(b"\0 \r\n\t") for part in iter(lambda: file.read(2**20), b""))

    def _text_stl(self) -> Mesh:
        """Read a text with one or more solids; within a solid, line breaks are ordinary whitespace."""
        corners, words, lines = array("d"), list[str](), list[int]()
        inside, last = False, 0
        for last, line in self._text("an STL file"):
            parts = line.split()
            opening = " ".join(parts[:2]).lower()
            ends = opening.startswith(("endsolid", "end solid"))
            if ends or parts[0].lower() == "solid":
                # The rest of such a line is the name of the solid.
                if words or inside != ends:
                    self.refuse("an STL file of solids with whole facets", repr(line), last)
                inside = not ends
                continue
            if not inside:
                self.refuse("an STL file without more after its 'endsolid'", repr(line), last)
            words += parts
            lines += [last] * len(parts)
            while len(words) >= len(FACET):
                self._facet(words, lines, corners)
                del words[: len(FACET)], lines[: len(FACET)]
        if inside:
            self.refuse("an STL file that ends with 'endsolid'", "one that is cut short", last)
        return _separate(np.frombuffer(corners, float).reshape(-1, 3))

    def _facet(self, words: list[str], lines: list[int], corners: array[float]) -> None:
        """Add the corners of the facet at the beginning of these words."""
        for word, rule, line in zip(words, FACET, lines, strict=False):
            if rule == "number":
                if not NUMBER_WORD.fullmatch(word):
                    self.refuse("an STL file with three numbers after each 'vertex'", repr(word), line)
                corners.append(float(word))
            elif rule and word.lower() != rule:
                self.refuse(f"an STL file of triangles, with {rule!r} here", repr(word), line)

    def _obj(self) -> Mesh:
        vertices: list[list[float]] = []
        polygons: list[list[int]] = []
        lines: list[int] = []
        for line, statement in self._statements():
            keyword, *words = statement.split()
            keyword = keyword.lower()
            if keyword == "v":
                rule = "an OBJ file with 3, 4, 6 or 7 numbers (x y z, weight, colour) after 'v'"
                if len(words) not in (3, 4, 6, 7):
                    self.refuse(rule, repr(statement), line)
                vertices.append(self._coordinates(words, line, rule)[:3])
            elif keyword in OBJ_FACES:
                polygons.append(self._polygon(words, len(vertices), statement, line))
                lines.append(line)
            elif keyword not in OBJ_IGNORED:
                self.refuse("an OBJ file of vertices and polygons", repr(statement), line)
        for polygon, line in zip(polygons, lines, strict=True):
            if max(polygon) >= len(vertices):
                self.refuse(_own(len(vertices)), f"index {max(polygon) + 1}", line)
        places = np.array(vertices, float).reshape(-1, 3)
        return places, triangulated(places, polygons)

    def _statements(self) -> Iterator[tuple[int, str]]:
        """Yield the statements of an OBJ file with their line numbers, without comments; a line that ends in
        a backslash continues in the next."""
        begun, first = "", 0
        for number, line in self._text("an OBJ file"):
            first = first if begun else number
            statement = begun + line.partition("#")[0].strip()
            if statement.endswith("\\"):
                begun = statement[:-1] + " "
                continue
            begun = ""
            if statement:
                yield first, statement
        if begun:
            self.refuse("an OBJ file that ends after a statement", repr(begun), first)

    def _polygon(self, words: list[str], known: int, statement: str, line: int) -> list[int]:
        """Return the vertex indices of a polygon, from 0; ``known`` : number of vertices defined before
        it."""
        found = [CORNER_WORD.fullmatch(word) for word in words]
        forms = {(word.count("/"), "//" in word) for word in words}
        if len(words) > MOST_CORNERS:
            self.refuse(f"a mesh of polygons with at most {MOST_CORNERS} corners", len(words), line)
        if len(words) < 3 or None in found or len(forms) > 1:
            rule = "an OBJ file with three or more of v, v/vt, v//vn or v/vt/vn after 'f'"
            self.refuse(rule, repr(statement), line)
        indices = [int(one[1]) for one in found if one]
        for index in indices:
            if index == 0 or index < -known:
                rule = f"{_own(known)}, or -1 for the last before the face"
                self.refuse(rule, f"index {index}", line)
        return [index - 1 if index > 0 else known + index for index in indices]

    def _by_meshio(self) -> Mesh:
        if importlib.util.find_spec("meshio") is None:
            rule = 'there to read a surface other than STL or OBJ (python -m pip install "tisim[mesh]")'
            raise InputError(f"meshio must be {rule}; received none")
        with np.load(io.BytesIO(self._arrays())) as arrays:
            blocks = {name.split("_", 1)[1]: arrays[name] for name in arrays if name != "points"}
            points = np.asarray(arrays["points"], float)
        if points.ndim != 2 or points.shape[1] != 3:
            self.refuse("a mesh of vertices with three coordinates", f"shape {points.shape}")
        triangles = [np.empty((0, 3), int)]
        for kind, corners in blocks.items():
            # Leaving out other elements would leave holes in the surface.
            if kind not in ("triangle", "quad", "polygon"):
                self.refuse("of triangles or other polygons alone", kind)
            if corners.ndim != 2 or not 3 <= corners.shape[1] <= MOST_CORNERS:
                self.refuse(f"a mesh of polygons with 3 to {MOST_CORNERS} corners", f"shape {corners.shape}")
            beyond = corners[(corners < 0) | (corners >= len(points))]
            if beyond.size:
                self.refuse(_own(len(points), 0), f"index {beyond[0]}")
            triangles.append(triangulated(points, corners.tolist()))
        return points, np.concatenate(triangles)

    def _arrays(self) -> bytes:
        """Return the arrays read by meshio, as a NumPy archive."""
        # meshio runs in a separate process, because some of its readers never return for a truncated file.
        limit = READING_TIME + self.path.stat().st_size / READING_RATE
        surroundings = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        command = (sys.executable, "-P", "-c", BY_MESHIO, str(self.path))
        try:
            done = subprocess.run(command, env=surroundings, capture_output=True, timeout=limit, check=False)
        except subprocess.TimeoutExpired:
            self.refuse("a file that meshio reads to its end", f"none after {limit:.0f} s")
        if done.returncode != 0:
            told = [line for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
            self.refuse("a file that meshio reads", told[-1].strip() if told else f"code {done.returncode}")
        return done.stdout


def _own(count: int, first: int = 1) -> str:
    return f"a mesh whose faces have indices of its {count} vertices, from {first}"


def _separate(corners: np.ndarray) -> Mesh:
    """Return a mesh of triangles in which each corner is a separate vertex."""
    return corners, np.arange(len(corners)).reshape(-1, 3)
