"""The inverse problem of capture: a filter of magnetised fibres that captures the most particles from a
stream.

Particles come from upstream, evenly distributed over the channel, and are captured or pass (``filter.py``).
The total length of wire is limited, so the search must choose between many short fibres and few long ones.

The search must find the conclusions of B16 for one cylinder by itself. The best cylinder is transverse: its
axis lies across the field and not along it (section 6.4.2). It is short, because the ratio of capture volume
to its own volume is larger for short cylinders (6.4.1).
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from tisim import Result
from tisim.cases.capture.filter import CHANNEL_HEIGHT, CHANNEL_WIDTH, WIRE, Filter
from tisim.cases.common.magnetic_fibre import SATURATION_MAGNETISATION
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem
from tisim.plotting.style import empty, letters, plain
from tisim.sources import MagneticCylinders, UniformFlow

MILLI = 1e-3
"""A millimetre, m."""

FIBRE_GENES = (
    Gene("flux", "T", 0.05, 1.0),
    Gene("field_angle", "degrees", 0.0, 90.0),
    Gene("aspect", "L/D", 5 / 3, 20.0, "log"),
    Gene("number", "fibres", 0.51, 12.49),
    Gene("spacing", "D", 1.2, 6.0),
)
HARD_GENE = Gene("magnetisation_angle", "degrees", 0.0, 90.0)
STREAM_GENES = (Gene("speed", "m/s", 1e-4, 1e-2, "log"), Gene("radius", "nm", 25.0, 212.0))
GENES = {
    "fraction": FIBRE_GENES,
    "hard": (*FIBRE_GENES, HARD_GENE),
    "throughput": (*FIBRE_GENES, *STREAM_GENES),
}
"""The genes of each variant of the problem."""
WANTED = {
    "fraction": "the soft fibres and the field that capture the most particles from a stream",
    "hard": "the hard magnets and the field that capture the most particles from a stream",
    "throughput": "the front of captured fraction and throughput, with free speed and particle radius",
}
"""The goal of each variant of the problem."""
MEANINGS = {
    "captured": "captured fraction of the particles",
    "throughput": "volume flow of water through the channel",
    "aspect": "length of a fibre over its diameter D",
    "spacing": "distance between the axes of neighbouring fibres",
}


def captured(result: Result) -> float:
    """Return the captured fraction of the particles."""
    return float((result.state["captured_by"] >= 0).mean())


def throughput(result: Result) -> float:
    """Return the volume flow of water through the channel, m^3/s."""
    flow = next(e for e in result.scene.effects if isinstance(e, UniformFlow))
    return flow.velocity[1] * CHANNEL_WIDTH * CHANNEL_HEIGHT


def problem(size: str = "default", variant: str = "fraction") -> Problem:
    """Return the inverse problem of a variant; only of the size "default".

    "fraction" maximises the captured fraction at FLOW_SPEED and FILTER_RADIUS with fibres of soft steel;
    "hard" does so with magnets whose direction is free. "throughput" is the front of fraction and throughput,
    with speed and radius also free.
    """
    must(variant in GENES, "variant", f"one of {', '.join(GENES)}", variant)
    fraction = Objective("captured", captured, maximise=True)
    flow = Objective("throughput", throughput, "m^3/s", maximise=True)
    return Problem(
        name=f"filter-{variant}",
        title="A filter of magnetised fibres (B16)",
        description=WANTED[variant],
        genome=Genome(GENES[variant]),
        scene=lambda design, seed: Filter(**design).scene(seed),
        objective=(fraction, flow) if variant == "throughput" else (fraction,),
        meanings=MEANINGS,
        picture=lambda scene, result: caught(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> dict[str, float]:
    """Return the properties of the best filter in the terms of B16."""
    best = Filter(**design)
    m = np.asarray(best.magnetisation())
    return {
        "fibres": float(round(best.number)),
        "length of a fibre, mm": 1e3 * best.length,
        "wire used, of what there is": round(best.number) * best.length / WIRE,
        "magnetisation to the axis, degrees": float(np.degrees(np.arctan2(m[0], m[2]))),
        "magnetisation over saturation": float(np.linalg.norm(m)) / SATURATION_MAGNETISATION,
    }


def caught(result: Result) -> Figure:
    """Draw the channel from the side and along the flow: fibres, and start and end positions of the
    particles."""
    figure = empty(10.4, 6.6)
    side, front = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 4.0))
    state, start = result.state, result.start
    stopped = state["captured_by"] >= 0
    magnets = next(e for e in result.scene.effects if isinstance(e, MagneticCylinders))
    for axis, k in ((side, 1), (front, 0)):
        for body in magnets.cylinders:
            low = np.array([body.centre[2] - body.length / 2, body.centre[k] - body.radius]) / MILLI
            box = Rectangle((low[0], low[1]), body.length / MILLI, 2 * body.radius / MILLI)
            box.set(facecolor="0.85", edgecolor="0.4", lw=0.7)
            axis.add_patch(box)
        groups = ((start, ~stopped, "0.6", "passed by"), (start, stopped, "#dd8899", "caught"),
                 (state, stopped, "#882255", "where it was caught"))  # fmt: skip
        for arrays, which, colour, name in groups:
            z, y = arrays["position"][which][:, 2], arrays["position"][which][:, k]
            axis.plot(z / MILLI, y / MILLI, "o", ms=3, color=colour, label=name)
        axis.set_ylabel(f"{'xy'[k]} (mm)")
        # Both panels have the same width, whatever their heights, so that their z axes are aligned.
        axis.set_aspect("equal", "datalim")
        plain(axis)
    side.set_title(f"from the side, the flow upwards: {stopped.mean():.0%} caught")
    side.legend(frameon=False, fontsize=8, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.02))
    front.set(xlabel="z, along the fibres (mm)")
    front.set_title("as the flow sees it")
    letters((side, front))
    return figure
