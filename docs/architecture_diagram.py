"""Draws architecture.svg, the picture of docs/architecture.md.

    python docs/architecture_diagram.py

Text stays text. Boxes have their own background and lines are grey, so that the picture can be read on light
and on dark pages.
"""

from collections.abc import Iterator
from html import escape
from pathlib import Path

WIDTH, LEFT, RIGHT = 760, (44, 270), (400, 344)
"""Width of the picture; left edge and width of the boxes of each column."""
TOP, HEIGHT, GAP, EDGE = 136, 66, 22, 12
"""Upper edge of the first row, height of a box, distance between rows, margin."""
STYLE = """
text { font: 14px system-ui, sans-serif; fill: #16202a; }
.title { font-weight: 600; }
.file { font: 12px ui-monospace, monospace; fill: #45525f; }
.note { fill: #7a8794; }
.step { fill: #cfe3f7; stroke: #4a7fb5; }
.part { fill: #e3efda; stroke: #6d9a55; }
.base { fill: #ece9e2; stroke: #9b927f; }
.above { fill: #fbe6c8; stroke: #c58b33; }
path { stroke: #7a8794; stroke-width: 1.6; fill: none; }
"""
Box = tuple[str, str, tuple[str, ...]]
WAY: tuple[Box, ...] = (
    ("Scene", "tisim/scene", ("plain, validated data",)),
    ("Simulation", "tisim/engine", ("a batch of scenes of one structure",)),
    ("Allocation", "tisim/engine", ("fields, parameters, bound parts",)),
    ("Assembly", "tisim/engine", ("the list of items of a step",)),
    ("Program", "tisim/program", ("kernels that repeat the step",)),
    ("Result", "tisim/engine", ("arrays, status, counts, measures",)),
)
"""The way of a scene: title, folder and text of each box."""
ROOMS: tuple[Box, ...] = (
    (
        "Parts",
        "a file for each law",
        ("effects, sources, operators, steppers,", "domains, materials, packing"),
    ),
    ("Batches", "tisim/engine", ("group scenes by structure,", "keep compiled simulations")),
    ("State", "tisim/state", ("particle fields, numbers of a world,", "parameter table")),
    ("Shared phases", "", ("pairs, forces, self_consistent,", "collisions, population")),
    ("Compiler", "tisim/backend", ("Taichi or Quadrants: device, precision,", "memory, kernels on the disk")),
    ("Files", "tisim/io", ("run folders, trajectories, checkpoints,", "read back by tisim.read")),
)
"""The room beside each box of the way."""
ABOVE: tuple[Box, Box] = (
    ("Search", "optimize", ("proposes designs, runs each from", "several seeds, stores every run")),
    ("Cost study", "tisim/accuracy", ("varies steppers, step lengths, cut-offs,", "measures error and time")),
)
GROUND = (
    "Ground",
    "tisim/numerics, components, geometry, files",
    ("random numbers, sums, elementary functions, validated data, shapes, checksums and locks",),
)
INTO = (True, True, True, True, True, False)
"""Whether the arrow leads from the room to the way."""


def box(x: int, y: int, width: int, kind: str, content: Box) -> Iterator[str]:
    """Yield a box with its title, its folder at the right, and its text."""
    title, folder, lines = content
    yield f'<rect class="{kind}" x="{x}" y="{y}" width="{width}" height="{HEIGHT}" rx="6"/>'
    yield f'<text class="title" x="{x + 12}" y="{y + 20}">{escape(title)}</text>'
    yield f'<text class="file" x="{x + width - 12}" y="{y + 20}" text-anchor="end">{escape(folder)}</text>'
    for k, line in enumerate(lines):
        yield f'<text x="{x + 12}" y="{y + 39 + 18 * k}">{escape(line)}</text>'


def arrow(*points: tuple[int, int]) -> str:
    """Return an arrow along points."""
    way = " L".join(f"{x},{y}" for x, y in points)
    return f'<path d="M{way}" marker-end="url(#tip)"/>'


def picture() -> str:
    """Return the SVG."""
    rows = [TOP + k * (HEIGHT + GAP) for k in range(len(WAY))]
    end, above, bend = rows[-1] + HEIGHT, EDGE + HEIGHT, EDGE + HEIGHT + 29
    (x, width), (beside, breadth) = LEFT, RIGHT
    middle, whole = x + width // 2, end + GAP + HEIGHT + EDGE
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {whole}" role="img">',
        "<title>The rooms of tisim and the way of a scene through them</title>",
        f"<style>{STYLE}</style>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0,0 L8,4 L0,8 z" style="fill: #7a8794; stroke: none"/></marker></defs>',
        *box(x - 28, EDGE, 350, "above", ABOVE[0]),
        *box(beside, EDGE, breadth, "above", ABOVE[1]),
    ]
    for y, step, room, into in zip(rows, WAY, ROOMS, INTO, strict=True):
        lines += [*box(x, y, width, "step", step), *box(beside, y, breadth, "part", room)]
        level, ends = y + HEIGHT // 2, (beside, x + width)
        lines.append(arrow(*((one, level) for one in (ends if into else ends[::-1]))))
        if y != rows[-1]:
            lines.append(arrow((middle, y + HEIGHT), (middle, y + HEIGHT + GAP)))
    last = rows[-1] + HEIGHT // 2
    lines += [
        arrow((middle, above), (middle, TOP)),
        arrow((beside + 20, above), (beside + 20, bend), (middle, bend), (middle, TOP)),
        arrow((x, last), (24, last), (24, above)),
        f'<text class="note" x="{middle + 8}" y="{above + 49}">scenes</text>',
        f'<text class="note" x="32" y="{above + 49}">results return</text>',
        *box(16, end + GAP, beside + breadth - 16, "base", GROUND),
        "</svg>",
    ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    (Path(__file__).parent / "architecture.svg").write_text(picture(), encoding="utf-8")
