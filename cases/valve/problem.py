"""The inverse problem of valve: find constrictions and grains that jam in the least field, or never jam.

A design is the diameter of the constriction, the diameter of the grains, and the field. A wide constriction
has a larger flow without a field, and needs a stronger field to jam. The jam is simulated from several
starts, in a field that is on from the beginning. The flow without a field is computed by ``duct.open_flow``,
not simulated.

A valve may jam from some starts and not from others. A start that misses the goal counts as MISSED times the
worst possible value. A design whose four starts include such a start is therefore worse than all designs
without one, and a search sees how many starts miss the goal.
"""

from collections.abc import Mapping

from tisim import Result, Scene
from tisim.cases.case import searched_size
from tisim.cases.common.magnetorheological_fluid import SWEPT, equal
from tisim.cases.valve import published
from tisim.cases.valve.duct import open_flow
from tisim.cases.valve.measures import duct_of, flow_rate, held_pressure, unhindered_rate
from tisim.cases.valve.runs import ARRESTED
from tisim.cases.valve.scene import GRADIENT, SEARCHED, SIZES, TITLE, D, scene
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem
from tisim.plotting.cloud import cloud
from tisim.sources import MagneticField

VARIANTS = ("front", "field", "never")
STRONGEST = 0.4
"""Upper limit of the field, T; L21 has 0.23, and 0.56 between inserts of iron (section 3.4.3)."""
THROAT_GENE, DIAMETER_GENE = Gene("throat", "m", 3.5 * D, 6 * D), Gene("diameter", "m", 0.7 * D, D)
FLUX_GENE = Gene("flux", "T", 0.02, STRONGEST)
MISSED = 4.0
"""Factor on the worst possible value for a start that misses the goal."""
MOST_ACROSS = THROAT_GENE.high / DIAMETER_GENE.low
"""Largest number of grains side by side in a constriction."""
GENES = {
    "front": (THROAT_GENE, DIAMETER_GENE, FLUX_GENE),
    "field": (THROAT_GENE, DIAMETER_GENE, FLUX_GENE),
    "never": (THROAT_GENE, DIAMETER_GENE),
}
BOUND = 23.5e-9
"""Least open flow in the variant "field", m^3/s: the flow of a constriction 4.6 of L21's largest grains
wide."""
WANTED = {
    "front": "the front of arresting field and open flow",
    "field": f"the least field that arrests the flow, for open flows of at least {1e9 * BOUND:g} mm^3/s",
    "never": f"the narrowest constriction, in grains, that a field of {published.FLUX:g} T never arrests",
}
"""The goal of each variant of the problem."""
MEANINGS = {
    "field": f"flux density that arrests the flow; {MISSED * STRONGEST:g} T for a start in which it does not",
    "open flow": "volume flow without field, by Hagen, Poiseuille, Krieger and Dougherty; 0 "
    "for a start that is not arrested",
    "width": "diameter of the constriction over diameter of the grains; "
    f"{MISSED * MOST_ACROSS:.2g} for a start that is arrested",
    "throat": "diameter of the constriction",
    "diameter": "diameter of the grains",
}


def part_left(result: Result) -> float:
    """Return the mass flow rate at the end, divided by the rate of grains that move with the oil."""
    return flow_rate(result) / unhindered_rate(result.scene, float(result.state["mass"].sum()))


def arrested(result: Result) -> bool:
    """Return whether the flow is arrested at the end: its rate is below ARRESTED of the rate of grains that
    move with the oil.

    It is measured at one instant, because these runs have no time without a field for comparison.
    """
    return part_left(result) < ARRESTED


def flux(result: Result) -> float:
    """Return the flux density of the field, T."""
    return float(next(e for e in result.scene.effects if isinstance(e, MagneticField)).constant[0])


def width(result: Result) -> float:
    """Return the diameter of the constriction divided by the diameter of the grains."""
    return duct_of(result.scene).throat / (2 * float(result.state["radius"].mean()))


def volume_rate(scene: Scene) -> float:
    """Return the volume flow rate of a valve without field, m^3/s.

    The pressure is the one that must be stopped: L21's gradient times the length of the duct.
    """
    duct = duct_of(scene)
    return open_flow(duct, GRADIENT * duct.length, published.FRACTION)


def arresting_field(result: Result) -> float:
    """Return the field if it arrests the flow, T; otherwise MISSED times the strongest field."""
    return flux(result) if arrested(result) else MISSED * STRONGEST


def arresting_flow(result: Result) -> float:
    """Return the flow without the field if the field arrests it, m^3/s; otherwise 0."""
    return volume_rate(result.scene) if arrested(result) else 0.0


def flowing_width(result: Result) -> float:
    """Return the number of grains side by side in the constriction if the flow continues.

    If it is arrested, return MISSED times the largest number.
    """
    return MISSED * MOST_ACROSS if arrested(result) else width(result)


LEAST_FIELD = Objective("field", arresting_field, "T")
OBJECTIVES = {
    "front": (LEAST_FIELD, Objective("open flow", arresting_flow, "m^3/s", maximise=True)),
    "field": (LEAST_FIELD,),
    "never": (Objective("width", flowing_width),),
}


def problem(size: str = "default", variant: str = "front") -> Problem:
    """Return the search for valves of a variant.

    The variants are the front of field and open flow, the least field at a bounded open flow, and the
    narrowest valve that never jams.
    """
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    settings = {**searched_size(size, SIZES).scene, **SEARCHED}

    def designed(design: Mapping[str, float], seed: int) -> Scene:
        one = scene(
            throat=design["throat"],
            grains=equal(design["diameter"] / 2, 1.0),
            flux=design.get("flux", published.FLUX),
            seed=seed,
            **settings,
        )
        let = volume_rate(one)
        must(variant != "field" or let >= BOUND, "open flow of the design", f"at least {BOUND:g} m^3/s", let)
        return one.replace(SWEPT)

    return Problem(
        name=f"valve-{variant}" + ("" if size == "default" else f"-{size}"),
        title=TITLE,
        description=WANTED[variant],
        genome=Genome(GENES[variant]),
        scene=designed,
        objective=OBJECTIVES[variant],
        version=2,
        meanings=MEANINGS,
        picture=lambda scene, result: cloud(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
    """Return further properties of the valve of a design."""
    return {
        "grains": float(len(result.state["radius"])),
        "grains across the constriction": width(result),
        "part of the flow that is left": part_left(result),
        "arrested, 1 for yes": float(arrested(result)),
        "pressure that the walls hold, kPa": 1e-3 * held_pressure(result),
        "open flow, mm^3/s": 1e9 * volume_rate(result.scene),
    }
