"""A runnable scene for each effect, source, operator, part of a contact law, stepper and step control, which
stands on its page of the reference.

    python docs/snippets.py NAME...    runs the snippets of some, or of all

Two grains touch, with the part and the effects that it needs. `EFFECTS` has the effects as Python code. All
else follows from them: imports, quantities of particles, materials and the stepper.
"""

from __future__ import annotations

import importlib
import re
import sys
from typing import Any

import tisim
from tisim.effects import Effect
from tisim.engine.assembly import needed_fields
from tisim.steppers import FixedStep, Verlet

FIELD = "MagneticField(constant=(0.0, 0.0, 0.1))"
MAGNET = "MagneticSpheres(spheres=[Sphere(centre=(0, 0, -4e-3), radius=1e-3, magnetisation=(0, 0, 1e6))])"
SOFT = "InducedMoment(susceptibility=1.0)"
EWALD = "cutoff=0.018, waves=(6, 6, 6), accuracy=0.01"
GRANULAR = "Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())"
CONTACT = "Contact(stiffness=1e9)"
IMPACT = "Impact(hardness=1e5)"
HEATING = f"{IMPACT}, Heating(heat_capacity=500.0)"
DRAG = "StokesDrag(viscosity=1e-3)"
DRIFTING = "low=(-5e-3, -5e-3, 5e-3), high=(5e-3, 5e-3, 1e-2)"
GRAINS = "grains=[GrainClass(sizes=EqualSizes(radius=5e-4), density=2500.0)], number=20"
PLATE = "planes=[Plane(point=(0, 0, 5e-5), normal=(0, 0, 1))]"

EFFECTS = {
    "agglomeration": "Impact(hardness=1.0), Agglomeration()",
    "capillary_bridge": "CapillaryBridge(surface_tension=0.072, volume=1e-12)",
    "chow_drag": "ChowDrag(density=1.2, viscosity=1.8e-5)",
    "constant_drag": "ConstantDrag(density=1.2, coefficient=0.44)",
    "contact": CONTACT,
    "contact_bond": f"{CONTACT}, ContactBond(stiffness=1e9, grip_stiffness=1e6, threshold=1e-3)",
    "contact_dissipation": f"{CONTACT}, ContactDissipation(damping=1e3)",
    "contact_friction": f"{CONTACT}, ContactFriction(stiffness=1e6, static=0.3, dynamic=0.2)",
    "contact_softening": f"{CONTACT},"
    " ContactSoftening(sensitivity=0.5, reference_temperature=300.0, floor=1e3)",
    "deformation_work": f"{HEATING}, DeformationWork()",
    "dipole_dipole": f"{FIELD}, {SOFT}, DipoleDipole()",
    "ewald_dipole_dipole": f"{FIELD}, {SOFT}, EwaldDipoleDipole({EWALD})",
    "ewald_froehlich_moment": f"{FIELD}, EwaldFroehlichMoment(susceptibility=10.0, saturation=1e6, {EWALD})",
    "ewald_induced_moment": f"{FIELD}, EwaldInducedMoment(susceptibility=1.0, {EWALD})",
    "ewald_langevin_moment": f"{FIELD}, EwaldLangevinMoment(temperature=300.0, {EWALD})",
    "fixed_moment": f"{FIELD}, FixedMoment()",
    "friction": f"{IMPACT}, Friction(coefficient=0.3)",
    "froehlich_moment": f"{FIELD}, FroehlichMoment(susceptibility=10.0, saturation=1e6)",
    "granular": GRANULAR,
    "gravity": "Gravity(acceleration=(0.0, 0.0, -9.81))",
    "heating": HEATING,
    "hertz": "Hertz(young=1e7, poisson=0.3)",
    "impact": IMPACT,
    "induced_moment": f"{FIELD}, {SOFT}",
    "langevin_moment": f"{FIELD}, LangevinMoment(temperature=300.0)",
    "lorentz": "ElectricField(constant=(1e3, 0.0, 0.0)), Lorentz()",
    "magnetic_body_force": f"{MAGNET}, MagneticBodyForce(gamma=1e-4)",
    "magnetophoresis": f"{MAGNET}, {SOFT}, Magnetophoresis()",
    "mie": "Mie(epsilon=1e-8, cutoff=2.0)",
    "morse": "Morse(depth=1e-8, alpha=1e4, cutoff=2.0)",
    "mutual_froehlich_moment": f"{FIELD}, MutualFroehlichMoment(susceptibility=10.0, saturation=1e6)",
    "mutual_induced_moment": f"{FIELD}, MutualInducedMoment(susceptibility=1.0)",
    "mutual_langevin_moment": f"{FIELD}, MutualLangevinMoment(temperature=300.0)",
    "near_field": "NearField(alpha1=1e-6, alpha2=1e-9)",
    "parallel_bond": "ParallelBond(gap=1e-4, young=1e6, tensile_strength=1e6, shear_strength=1e6)",
    "prescribed_motion": "PrescribedMotion(group=1, motion=Translation(velocity=(0.1, 0.0, 0.0))),"
    f" {CONTACT}",
    "reaction": f"{HEATING}, Reaction(energy_density=1e3)",
    "rigid_clumps": f"RigidClumps(), {CONTACT}",
    "rigid_mixture": "RigidMixture(rods=[SpherocylinderShape(length=2e-3, diameter=1e-3)],"
    f" superquadrics=[SuperquadricShape(semi_axes=(1e-3, 1e-3, 2e-3), exponents=(4, 4, 4))]), {GRANULAR}",
    "rigid_rods": f"RigidRods(rods=[SpherocylinderShape(length=2e-3, diameter=1e-3)]), {GRANULAR}",
    "rigid_superquadrics": "RigidSuperquadrics(superquadrics=[SuperquadricShape(semi_axes=(1e-3, 1e-3, 2e-3),"
    f" exponents=(4, 4, 4))]), {GRANULAR}",
    "schiller_naumann_drag": "SchillerNaumannDrag(density=1.2, viscosity=1.8e-5)",
    "self_gravity": "SelfGravity()",
    "softened_self_gravity": "SoftenedSelfGravity(softening_length=1e-4)",
    "softening": f"{HEATING}, Softening(activation_energy=300.0)",
    "stokes_drag": DRAG,
    "tether": "Tether(stiffness=(1.0, 1.0, 2.0))",
    "tree_gravity": "TreeGravity(opening_angle=0.5)",
    "truncated_dipole_dipole": f"{FIELD}, {SOFT}, TruncatedDipoleDipole(cutoff=3.0)",
    "truncated_near_field": "TruncatedNearField(alpha1=1e-6, alpha2=1e-9, cutoff=4e-3)",
    "virial": "NearField(alpha1=1e-6, alpha2=1e-9), Virial()",
    "walls": f"{GRANULAR}, Walls(planes=[Plane(point=(0, 0, -9.9e-4), normal=(0, 0, 1))])",
    "constriction_flow": "ConstrictionFlow(speed=1.0, throat_radius=1e-3, duct_radius=4e-3, length=2e-3),"
    f" {DRAG}",
    "couette_flow": "CouetteFlow(first=-2e-3, second=4e-3, first_velocity=(-1.0, 0.0, 0.0),"
    f" second_velocity=(1.0, 0.0, 0.0)), {DRAG}",
    "darcy_flow": "DarcyFlow(pressure_gradient=(0.0, 0.0, 1e3), viscosity=1e-3, porosity=0.4, diameter=1e-3),"
    f" {DRAG}",
    "electric_field": "ElectricField(amplitude=(1e3, 0.0, 0.0), omega=(1e3, 0.0, 0.0)), Lorentz()",
    "magnetic_cylinders": "MagneticCylinders(cylinders=[Cylinder(centre=(0, 0, -6e-3), radius=1e-3,"
    f" length=5e-3, magnetisation=(0, 0, 1e6))]), {SOFT}, Magnetophoresis()",
    "magnetic_field": "MagneticField(constant=(0.0, 0.0, 0.1)), Lorentz()",
    "magnetic_spheres": f"{MAGNET}, {SOFT}, Magnetophoresis()",
    "pore_flow": "PoreFlow(low=(-5e-3, -5e-3, -5e-3), high=(5e-3, 5e-3, 5e-3), cells=(16, 16, 16), speed=1.0,"
    f" viscosity=1e-3, spheres=[Sphere(centre=(0, 0, -3e-3), radius=1.5e-3)]), {DRAG}",
    "uniform_flow": f"UniformFlow(velocity=(1.0, 0.0, 0.0)), {DRAG}",
    "at_rest": "Gravity(), AtRest(time=2e-4)",
    "capture": "MagneticCylinders(cylinders=[Cylinder(centre=(0, 0, -1.5e-3), radius=1e-3,"
    " length=5e-3, magnetisation=(0, 0, 1e6))]), Capture()",
    "compacted": "Compacted(low=(-5e-3, -5e-3, -5e-3), high=(5e-3, 5e-3, 5e-3), fraction=0.6, interval=1e-4)",
    "cooling": f"{HEATING}, Cooling(convection=10.0)",
    "fragmentation": f"{IMPACT}, Fragmentation(surface_energy=1e-4, grain_mass=1e-6)",
    "inlet": "UniformFlow(velocity=(0.0, 0.0, 1.0)),"
    " Inlet(low=(-5e-3, -5e-3, 0), high=(5e-3, 5e-3, 1e-4), direction=(0, 0, 1), end=5e-4)",
    "insertion_by_flux": f"InsertionByFlux({DRIFTING}, {GRAINS}, flux=0.1)",
    "insertion_by_fraction": f"InsertionByFraction({DRIFTING}, {GRAINS}, fraction=0.05, interval=1e-4)",
    "join_group": "PrescribedMotion(group=1),"
    " JoinGroup(group=1, planes=[Plane(point=(0, 0, 5e-5), normal=(0, 0, -1))], time=1e-4)",
    "mean_force": f"{CONTACT}, MeanForce(begin=1e-4)",
    "outflow": f"Outflow({PLATE})",
    "outlet": f"Outlet({PLATE})",
    "passage": f"Passage({PLATE})",
    "peak_displacement": f"{CONTACT}, PeakDisplacement()",
    "peak_height": "Gravity(), PeakHeight(direction=(1.0, 0.0, 0.0))",
    "reflecting_walls": "Gravity(), ReflectingWalls(planes=[Plane(point=(0, 0, -1e-3), normal=(0, 0, 1))])",
    "permanent_moment": f"{FIELD}, PermanentMoment(magnetisation=1e5), Magnetophoresis()",
    "constant_damping": "Granular(normal=Hooke(), damping=ConstantDamping())",
    "dmt": "Granular(normal=HertzMaterial(), damping=RestitutionDamping(), cohesion=DMT())",
    "hertz_material": "Granular(normal=HertzMaterial(), damping=RestitutionDamping())",
    "hooke": "Granular(normal=Hooke(), damping=RestitutionDamping())",
    "jkr": "Granular(normal=JKR(), damping=RestitutionDamping())",
    "linear_spring": "Granular(normal=Hooke(), damping=RestitutionDamping(), tangential=LinearSpring())",
    "mindlin_displacement": GRANULAR.replace("MindlinForce", "MindlinDisplacement"),
    "mindlin_force": GRANULAR,
    "restitution_damping": "Granular(normal=HertzMaterial(), damping=RestitutionDamping())",
    "rolling_cdt": f"{GRANULAR[:-1]}, rolling=RollingCDT())",
    "rolling_epsd": f"{GRANULAR[:-1]}, rolling=RollingEPSD())",
    "rolling_sds": f"{GRANULAR[:-1]}, rolling=RollingSDS())",
    "sjkr": "Granular(normal=HertzMaterial(), damping=RestitutionDamping(), cohesion=SJKR())",
    "twisting_marshall": f"{GRANULAR[:-1]}, twisting=TwistingMarshall())",
    "twisting_sds": f"{GRANULAR[:-1]}, twisting=TwistingSDS())",
    "viscoelastic_damping": "Granular(normal=HertzMaterial(), damping=ViscoelasticDamping())",
    "viscous_friction": GRANULAR.replace("MindlinForce", "ViscousFriction"),
    "boris": "MagneticField(constant=(0.0, 0.0, 0.1)), Lorentz()",
    "approach_time": IMPACT,
} | dict.fromkeys(
    ("brownian", "collocation", "langevin", "trapezoid", "verlet", "drift_limit", "error_control",
     "fixed_step", "iteration_control", "stage_control"),
    "Tether(stiffness=(1.0, 1.0, 2.0))",
)  # fmt: skip
"""The effects of the scene of each part."""
COLLOID = "Brownian(temperature=300.0, viscosity=1e-3, control=DriftLimit(longest=1e-6))"
STEPPERS = {
    "brownian": COLLOID,
    "drift_limit": COLLOID,
    "langevin": "Langevin(temperature=300.0, viscosity=1e-3, control=FixedStep(dt=1e-6))",
    "collocation": "Collocation(control=StageControl(error=1e-6))",
    "stage_control": "Collocation(control=StageControl(error=1e-6))",
    "trapezoid": "Trapezoid(control=ErrorControl(error=1e-6))",
    "error_control": "Trapezoid(control=ErrorControl(error=1e-6))",
    "iteration_control": "Trapezoid(control=IterationControl(tolerance=1e-6))",
    "approach_time": "Verlet(control=ApproachTime())",
}
"""The steppers of scenes that need another one than Verlet's, or Boris's for charges in magnetic fields."""
PROPERTIES = {
    "young": "1e7", "poisson": "0.25", "stiffness": "1e3", "restitution": "0.5", "damping": "0.01",
    "viscous_time": "1e-6", "friction": "0.5", "rolling_friction": "0.1", "rolling_stiffness": "100.0",
    "rolling_damping": "0.01", "twisting_friction": "1e-4", "twisting_stiffness": "1e-4",
    "twisting_damping": "1e-8", "surface_energy": "0.01", "cohesion_energy_density": "1e4",
}  # fmt: skip
"""Properties of a material, for contact laws that need them."""
TEMPERATURES = ("heating", "deformation_work", "reaction", "softening", "contact_softening", "cooling")
MEASURES = (
    "virial", "at_rest", "compacted", "insertion_by_flux", "insertion_by_fraction", "outflow", "passage",
    "peak_displacement",
)  # fmt: skip
COUNTERS = ("agglomeration", "impact", "capture", "fragmentation", "inlet", "join_group", "outlet")
"""Parts whose temperatures, measures or counters are printed. For others it is moments or velocities."""
QUANTITIES = {
    "temperature": "300.0", "charge": "1e-6", "saturation_moment": "1e-6", "domain_moment": "1e-18",
    "group": "[1, 0]", "spin": "[[100.0, 0, 50.0], [0, 0, 0]]",
}  # fmt: skip
"""Quantities of particles that are given if an effect needs them."""
GIVEN = {
    "rigid_clumps": """particles=tisim.Particles.of_clumps(
        tisim.Clump(
            centres=[(0, 0, 0), (1e-3, 0, 0)],
            radii=[1e-3, 8e-4],
            density=2500.0,
        ),
        position=[[0, 0, 0], [2.85e-3, 0, 2e-4]],
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]],
    )""",
    "rigid_mixture": """particles=tisim.Particles.of_shapes(
        (
            SpherocylinderShape(length=2e-3, diameter=1e-3),
            SuperquadricShape(semi_axes=(1e-3, 1e-3, 2e-3), exponents=(4, 4, 4)),
        ),
        position=[[0, 0, 0], [1.49e-3, 0, 1e-4]],
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]],
        orientation=[[1, 0, 0, 0], [0.8, 0.6, 0, 0]],
        shape=[0, 1],
        density=2500.0,
    )""",
    "rigid_rods": """particles=tisim.Particles.of_shapes(
        SpherocylinderShape(length=2e-3, diameter=1e-3),
        position=[[0, 0, 0], [9.9e-4, 0, 1e-4]],
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]],
        orientation=[[1, 0, 0, 0], [0.8, 0.6, 0, 0]],
        density=2500.0,
    )""",
    "rigid_superquadrics": """particles=tisim.Particles.of_shapes(
        SuperquadricShape(semi_axes=(1e-3, 1e-3, 2e-3), exponents=(4, 4, 4)),
        position=[[0, 0, 0], [1.99e-3, 0, 1e-4]],
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]],
        orientation=[[1, 0, 0, 0], [0.8, 0.6, 0, 0]],
        density=2500.0,
    )""",
}
"""Particles that are no two grains."""

WIDTH = 84
"""Characters of a line that a page has room for."""


def snippet(name: str) -> str:
    """Return the Python code of the scene of a part, or "" if it has none."""
    if name not in EFFECTS:
        return ""
    calls, made = EFFECTS[name], effects(name)
    usual = "Boris" if any(effect.gyrates(made) for effect in made) else "Verlet"
    stepper = STEPPERS.get(name, f"{usual}(control=FixedStep(dt=1e-5))")
    given = [GIVEN.get(name) or _particles(made)]
    if "Ewald" in calls:
        given.append("domain=tisim.Box(low=(-0.02, -0.02, -0.02), high=(0.02, 0.02, 0.02))")
    if properties := _properties(made):
        values = ", ".join(f"{key}={value}" for key, value in properties.items())
        given.append(_broken(f'materials={{"glass": tisim.Material({values})}}', 4))
    given += [
        _broken(f"effects=({calls},)" if len(made) == 1 else f"effects=({calls})", 4),
        _broken(f"stepper={stepper}", 4),
        "duration=1e-3",
    ]
    lines = "".join(f"    {one},\n" for one in given)
    return (
        f"{_imports(f'{calls} {stepper}')}\n"
        f"scene = tisim.Scene(\n{lines})\nresult = tisim.run(scene)\nprint({_shown(name)})\n"
    )


def effects(name: str) -> tuple[Effect, ...]:
    """Return the effects of the scene of a part."""
    made: tuple[Effect, ...] = eval(f"({EFFECTS[name]},)", _names(EFFECTS[name]))
    return made


def materials(name: str) -> dict[str, tisim.Material]:
    """Return the materials of the scene of a part."""
    values = {key: float(value) for key, value in _properties(effects(name)).items()}
    return {"glass": tisim.Material(**values)} if values else {}


def _properties(effects: tuple[Effect, ...]) -> dict[str, str]:
    """The properties of a material that effects need."""
    parts = [getattr(effect, field) for effect in effects for field in type(effect).model_fields]
    needed = {name for part in parts for name in getattr(part, "uses", ())}
    return {name: value for name, value in PROPERTIES.items() if name in needed}


def _particles(effects: tuple[Effect, ...]) -> str:
    """Two grains that touch, with the quantities that effects need."""
    stepper = Verlet(control=FixedStep(dt=1e-5))
    needed = {need if isinstance(need, str) else need.name for need in needed_fields(effects, stepper)}
    quantities = ", ".join(f'"{name}": {value}' for name, value in QUANTITIES.items() if name in needed)
    return f"""particles=tisim.Particles(
        position=[[0, 0, 0], [1.99e-3, 0, 1e-4]],
        velocity=[[0.1, 0, 0], [-0.1, 0, 0]],
        radius=1e-3,
        density=2500.0,
{f"        quantities={{{quantities}}},{chr(10)}" if quantities else ""}    )"""


def _names(code: str) -> dict[str, Any]:
    """The public objects that code calls, by name."""
    return {name: getattr(importlib.import_module(module), name) for module, name in _homes(code)}


def _homes(code: str) -> list[tuple[str, str]]:
    """Package and name of each public class that code calls."""
    packages = ("effects", "sources", "operators", "steppers", "packing", "geometry", "shapes")
    found = []
    for name in sorted(set(re.findall(r"\b(?<!\.)[A-Z]\w+(?=\()", code))):
        homes = (f"tisim.{one}" for one in packages if hasattr(importlib.import_module(f"tisim.{one}"), name))
        found.append((next(homes, "tisim"), name))
    return sorted(found)


def _imports(code: str) -> str:
    """The import statements of code."""
    lines: dict[str, list[str]] = {}
    for module, name in _homes(code):
        lines.setdefault(module, []).append(name)
    rows = []
    for module, names in lines.items():
        start, listed = f"from {module} import ", ", ".join(names)
        fits = len(start + listed) < WIDTH
        rows.append(start + (listed if fits else _broken(f"({listed})", 0, width=0)))
    return "\n".join(("import tisim", *rows, ""))


def _broken(code: str, indent: int, width: int = WIDTH) -> str:
    """A call, tuple, list or dictionary with an item in each line, unless it is short enough for one line."""
    if len(code) + indent < width:
        return code
    start = next((k for k, sign in enumerate(code) if sign in "([{"), len(code) - 1) + 1
    depth, items = 0, [""]
    for sign in code[start:-1]:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            items.append("")
        else:
            items[-1] += sign
    inner = " " * (indent + 4)
    rows = (f"{inner}{_broken(one, indent + 4)},\n" for item in items if (one := item.strip()))
    return f"{code[:start]}\n{''.join(rows)}{' ' * indent}{code[-1]}"


def _shown(name: str) -> str:
    """The expression that a snippet prints: the result that the part is for."""
    if name in MEASURES or name in COUNTERS:
        return "result.measures" if name in MEASURES else "result.work"
    others = {"mean_force": "mean_force", "peak_height": "peak_height"}
    if STEPPERS.get(name) == COLLOID:
        return 'result.state["position"]'
    if name.startswith(("rolling_", "twisting_")):
        return 'result.state["spin"]'
    moment = "moment" if name.endswith("_moment") else "velocity"
    quantity = others.get(name, "temperature" if name in TEMPERATURES else moment)
    return f'result.state["{quantity}"]'


if __name__ == "__main__":
    for name in sys.argv[1:] or EFFECTS:
        print(f"# {name}")
        exec(snippet(name), {})
