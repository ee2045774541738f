"""A study finds the methods and settings to compare from the declarations of the parts of a scene."""

import io
from dataclasses import replace
from types import SimpleNamespace
from typing import ClassVar

import pytest
from rich.console import Console

from tests.accuracy.scenes import KNOWN, UNKNOWN, drift, oscillator
from tests.scenes import scene
from tests.steppers.charged import accurate, charged
from tests.throwaway import Trap
from tisim import Box, InputError, Material, MaterialPair, RunError, Scene
from tisim.accuracy import Quantity, Row, Study, plot, table
from tisim.accuracy.cost_study import decades, tied
from tisim.accuracy.quantity import reference_runs, truth_by_reference
from tisim.accuracy.report import notes
from tisim.accuracy.scene_changes import exchanged, expression, finest, options, parts, softened, softening
from tisim.accuracy.sweep import methods, rivals
from tisim.cases.packing import scene as packing
from tisim.cli.scene_arguments import assignments
from tisim.components import serialization
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.effects import (
    DMT,
    JKR,
    SJKR,
    ConstantDamping,
    DipoleDipole,
    EwaldDipoleDipole,
    EwaldInducedMoment,
    Granular,
    HertzMaterial,
    Hooke,
    InducedMoment,
    MindlinForce,
    MutualInducedMoment,
    NearField,
    ParallelBond,
    RestitutionDamping,
    RollingEPSD,
    RollingSDS,
    SelfGravity,
    Tether,
    TreeGravity,
    TruncatedDipoleDipole,
    TruncatedNearField,
    TwistingSDS,
    ViscoelasticDamping,
    Walls,
    ewald_settings,
)
from tisim.geometry import Plane
from tisim.sources import MagneticField
from tisim.steppers import (
    Brownian,
    DriftLimit,
    FixedStep,
    MechanicalContraction,
    MonteCarloGrowth,
    Stepper,
    Verlet,
)

LEVELS = (2.0, 1.0, 0.0)


class Pace(FixedStep):
    """A step control with an accuracy parameter of its own."""

    error: float = parameter("", "error", 1e-4, gt=0)
    accuracy_parameters = (AccuracyParameter(error=1),)


class Sharp(Stepper):
    """A stepper of high order that the study does not know by name."""

    control: Pace
    is_alternative: ClassVar[bool] = False

    @property
    def order(self):
        return 20

    @classmethod
    def alternatives(cls, effects, dt):
        return (cls(control=Pace(dt=dt, error=1e-6)),) if cls.is_alternative else ()


class Patchy(Trap):
    """A force whose accuracy depends on its parameter ``grain``."""

    grain: float = parameter("m", "grain", 1e-3, gt=0)
    accuracy_parameters = (AccuracyParameter(grain=2),)


def methods_of(scene, numbers=(("f64", "strict"),)):
    return {m.name: m for m in methods(scene, 0.1, 1.0, LEVELS, numbers, 1)}


def test_a_new_stepper_and_its_control_declare_their_accuracy_parameters(monkeypatch):
    monkeypatch.setattr(Sharp, "is_alternative", True)
    line = methods_of(oscillator())["Sharp, Pace: error"]
    assert [s.scene.stepper.control.error for s in line.settings] == [1e-4, 1e-5, 1e-6]
    assert [s.scene.stepper.control.dt for s in line.settings] == [0.1] * 3
    assert [s.description for s in line.settings] == ["error=0.0001", "error=1e-05", "error=1e-06"]
    # It has the highest order, so it is the reference, and the scene's own stepper checks it.
    references = reference_runs(list(methods_of(oscillator()).values()), 0.0)
    assert [attempt.name for attempt in references] == ["Sharp, Pace"] * 2 + ["Verlet, FixedStep"] * 2
    assert [attempt.scene.stepper.control.error for attempt in references[:2]] == [1e-8, 1e-7]
    assert references[2].scene.stepper.control.dt == pytest.approx(oscillator().stepper.control.dt / 10)


def test_a_new_effect_declares_its_accuracy_parameters_and_is_finest_in_the_reference():
    scene = oscillator().model_copy(update={"effects": (Patchy(stiffness=1.0),)})
    line = methods_of(scene)["patchy: grain"]
    assert [s.scene.effects[0].grain for s in line.settings] == [1e-2, 3.16e-3, 1e-3]
    assert not line.converges
    assert finest(scene, -2).effects[0].grain == pytest.approx(1e-4)
    assert finest(scene, -2).stepper == scene.stepper
    reference, *_ = reference_runs(list(methods_of(scene).values()), 0.0)
    assert reference.scene.effects[0].grain == pytest.approx(1e-4)
    assert reference.scene.stepper == reference.method.at(-2).stepper


def test_the_scenes_own_method_is_first_and_is_tried_in_other_precisions():
    tried = methods_of(oscillator(), (("f64", "strict"), ("f32", "strict"), ("f64", "fast")))
    first, *others = list(tried)[:3]
    assert first == "Verlet, FixedStep: dt"
    assert others == [f"{first}, f32", f"{first}, fast"]
    single, fast = (tried[name].settings[0] for name in others)
    assert options(oscillator(), single.scene, *single.numbers)[-2:] == ["--precision", "f32"]
    assert options(oscillator(), fast.scene, *fast.numbers)[-2:] == ["--arithmetic", "fast"]


def test_only_suitable_steppers_are_tried():
    """Boris needs a magnetic field, Verlet velocity-independent forces, and implicit steppers a force."""

    def tried(scene):
        return {type(method.base.stepper).__name__ for method in methods_of(scene).values()}

    assert {"Verlet", "Trapezoid"} <= tried(oscillator())
    assert "Boris" not in tried(oscillator())
    assert {"Boris", "Trapezoid"} <= tried(charged(accurate(1e-3), 1.0))
    assert "Verlet" not in tried(charged(accurate(1e-3), 1.0))
    implicit = {
        kind.__name__ for kind in Stepper.known().values() if "implicit" in kind.__module__.split(".")
    }
    assert {"Trapezoid", "Collocation"} <= implicit
    assert "Verlet" in tried(drift())
    assert not tried(drift()) & {"Boris", *implicit}


def test_explicit_euler_is_tried_if_particles_do_not_interact():
    """Z16 uses it for such particles only."""
    euler = "Trapezoid(phi=0.0), IterationControl: longest, tolerance"
    alone = charged(accurate(1e-3), 1.0)
    assert [s.scene.stepper.phi for s in methods_of(alone)[euler].settings] == [0.0] * len(LEVELS)
    attracted = oscillator().model_copy(
        update={"effects": (*oscillator().effects, NearField(alpha1=1.0, alpha2=2.0, beta2=3))}
    )
    assert euler in methods_of(oscillator())
    assert euler.replace("0.0", "1.0") in methods_of(attracted)
    assert euler not in methods_of(attracted)


def test_settings_of_alternative_steppers_are_rounded():
    """Users paste them, and 1e3 times 0.0556 is 55.599999999999994."""
    for dt in (0.0556, 7.3e-11, 4.29e-13, 123.0):
        for effects in (oscillator().effects, charged(accurate(1e-3), 1.0).effects):
            for stepper in rivals(Verlet(control=FixedStep(dt=dt)), effects, dt):
                values = stepper.control.model_dump().values()
                rounded = [float(f"{v:.3g}") if isinstance(v, float) else v for v in values]
                assert list(values) == rounded, expression(stepper)


def test_exact_noise_is_tried_against_fast_and_a_method_is_named_by_its_choices():
    """Its name leaves out temperature and viscosity, which are no choice of method."""
    fluid = Brownian(
        temperature=298.0, viscosity=1e3, control=DriftLimit(longest=1e-3), hydrodynamics="rotne-prager",
        noise="fast",
    )  # fmt: skip
    names = list(methods_of(oscillator().model_copy(update={"stepper": fluid})))
    exact, fast = (
        "Brownian(hydrodynamics='rotne-prager')",
        "Brownian(hydrodynamics='rotne-prager', noise='fast')",
    )
    assert names[0] == f"{fast}, DriftLimit: longest, drift"
    assert f"{exact}, DriftLimit: longest, drift" in names


def test_a_cut_off_is_tried_against_the_law_without_one():
    law = NearField(alpha1=1.0, alpha2=2.0, beta2=3)
    scene = oscillator().model_copy(update={"effects": (law,)})
    cuts = [s.scene.effects[0] for s in methods_of(scene)["TruncatedNearField"].settings]
    assert all(type(cut) is TruncatedNearField for cut in cuts)
    assert [cut.cutoff for cut in cuts] == [0.1, 0.2, 0.5, 1.0]
    assert {(cut.alpha1, cut.alpha2, cut.beta2) for cut in cuts} == {(1.0, 2.0, 3)}
    arguments = options(scene, methods_of(scene)["TruncatedNearField"].settings[0].scene)
    assert arguments[:2] == ["--without", "near_field"]
    table = "{alpha1 = 1.0, alpha2 = 2.0, beta2 = 3, cutoff = 0.1}"
    assert arguments[2:] == ["--set", f"effects.truncated_near_field={table}"]
    changed = scene.without("near_field")
    assert changed.replace({"effects.truncated_near_field": cuts[0].model_dump()}).effects == (cuts[0],)
    # If the scene itself has the truncated law, it is not offered as an approximation.
    assert "TruncatedNearField" not in methods_of(scene.model_copy(update={"effects": (cuts[0],)}))


def test_a_tree_is_tried_in_place_of_all_pairs_if_the_domain_allows_it():
    """The opening angle of a tree is varied; no tree is tried in a box, which would refuse it."""
    scene = oscillator().model_copy(update={"effects": (SelfGravity(),)})
    angles = [s.scene.effects[0].opening_angle for s in methods_of(scene)["TreeGravity"].settings]
    assert angles == [0.8, 0.5, 0.3]
    box = Box(low=(-9, -9, -9), high=(9, 9, 9))
    assert "TreeGravity" not in methods_of(scene.model_copy(update={"domain": box}))
    tree = scene.model_copy(update={"effects": (TreeGravity(opening_angle=0.2),)})
    turned = methods_of(tree)["tree_gravity: opening_angle"]
    # The angles are for errors larger by factors of ten; angles of 1 and more are left out.
    assert [s.scene.effects[0].opening_angle for s in turned.settings] == [0.928, 0.431, 0.2]


def test_mutual_induction_is_tried_against_moments_of_single_particles_and_one_sweep_a_step():
    law = MutualInducedMoment(susceptibility=2.0)
    scene = oscillator().model_copy(update={"effects": (MagneticField(), law)})
    alone, once = methods_of(scene)["InducedMoment"].settings
    assert [setting.description for setting in (alone, once)] == ["InducedMoment", "sweeps=0"]
    assert alone.scene.effects[1] == InducedMoment(susceptibility=2.0)
    arguments = options(scene, alone.scene)
    assert arguments[:2] == ["--without", "mutual_induced_moment"]
    assert arguments[2:] == ["--set", "effects.induced_moment={susceptibility = 2.0}"]


def test_moments_are_cut_off_with_the_forces_and_otherwise_swept_to_a_tolerance():
    """Otherwise a scene with the exchanged law would be refused."""
    every = (MagneticField(), MutualInducedMoment(susceptibility=2.0), DipoleDipole())
    cut = {"cutoff": 2.0, "gap": 4.0}
    near = (
        MagneticField(),
        MutualInducedMoment(susceptibility=2.0, sweeps=0, **cut),
        TruncatedDipoleDipole(**cut),
    )
    known = {}
    for effects in (every, near):
        known = methods_of(oscillator().model_copy(update={"effects": effects}))
        settings = known["TruncatedDipoleDipole"].settings
        assert len(settings) > 1
        for setting in settings:
            _, moments, forces = setting.scene.effects
            assert (moments.cutoff, moments.gap) == (forces.cutoff, forces.gap)
            Scene(**dict(setting.scene))
    several = known["InducedMoment"].settings[-1]
    assert several.description == "sweeps=100"
    assert "mutual_induced_moment: tolerance" not in known
    assert "mutual_induced_moment: largest_change" in known


def test_the_accuracy_of_an_ewald_sum_is_varied_for_forces_and_moments_together():
    box = Box(low=(-4, -4, -4), high=(4, 4, 4))
    settings = ewald_settings(box, 100, 1e-3)
    effects = (
        MagneticField(),
        EwaldInducedMoment(susceptibility=2.0, **settings),
        EwaldDipoleDipole(**settings),
    )
    known = methods_of(oscillator().model_copy(update={"effects": effects, "domain": box}))
    for name in ("ewald_dipole_dipole: accuracy", "ewald_induced_moment: accuracy"):
        numbers = []
        for setting in known[name].settings:
            _, moments, forces = setting.scene.effects
            assert moments.accuracy == forces.accuracy
            numbers.append(forces.accuracy)
        assert numbers == [1e-1, 1e-2, 1e-3]


def grains(**properties):
    """A grain above a floor, with Hertz and Mindlin's law, damping and rolling resistance."""
    law = Granular(
        normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce(), rolling=RollingEPSD()
    )
    glass = Material(young=5e10, poisson=0.2, restitution=0.5, friction=0.5, rolling_friction=0.1)
    return scene(
        [[0.0, 0.0, 1.0]], [[0.0, 0.0, 0.0]], (law, Walls(planes=[Plane()])), mass=1.0, radius=0.1,
        materials={"glass": glass.model_copy(update=properties)}, duration=1.0,
        stepper=Verlet(control=FixedStep(dt=1e-6)),
    )  # fmt: skip


def test_grains_are_softened_and_steps_grow_with_the_duration_of_impacts():
    line = methods_of(grains(stiffness=1e6))["softer, in longer steps: young"]
    materials = [setting.scene.materials["glass"] for setting in line.settings]
    assert [material.young for material in materials] == [5e7, 5e8, 5e9]
    # Hooke's stiffness, which the law does not use, stays as it is.
    assert {material.stiffness for material in materials} == {1e6}
    steps = [setting.scene.stepper.control.dt for setting in line.settings]
    assert steps == pytest.approx([1e-6 * factor**0.4 for factor in (1e3, 1e2, 10)], rel=5e-3)
    assert next(s.description for s in line.settings) == "by 1000, dt=1.58e-05"
    changes = assignments(options(grains(), softened(grains(), {"young": 0.4}, 10.0))[1::2])
    assert grains().replace(changes) == softened(grains(), {"young": 0.4}, 10.0)
    linear = exchanged(grains(stiffness=1e6), "effects.granular.normal", Hooke())
    springs = methods_of(linear)["softer, in longer steps: stiffness"].settings[1].scene
    assert springs.materials["glass"].stiffness == 1e4
    assert springs.stepper.control.dt == pytest.approx(1e-5)
    assert not any(name.startswith("softer") for name in methods_of(oscillator()))


def test_grains_are_tried_with_laws_whose_parameters_their_materials_have():
    """Hooke's law needs a stiffness. No implicit stepper is tried, as contacts begin, slip and end."""
    plain = methods_of(grains())
    assert {method.base.stepper.kind() for method in plain.values()} == {"verlet"}
    tried = [setting.description for setting in plain["Granular"].settings]
    assert tried == ["rolling=None", "tangential=LinearSpring()", "tangential=MindlinDisplacement()"]
    rich = methods_of(grains(stiffness=1e6))["Granular"].settings
    assert rich[1].description == "normal=Hooke(), tangential=LinearSpring()"
    for setting in rich:
        law = setting.scene.effects[0]
        assert law.damping == RestitutionDamping()
        arguments = options(grains(), setting.scene)
        changed = grains(stiffness=1e6).replace(assignments(arguments[1::2]))
        assert changed.effects == setting.scene.effects
    # A part is left out by giving the whole law, as a file cannot express None.
    assert "rolling" not in options(grains(stiffness=1e6), rich[0].scene)[1]


def test_softer_materials_keep_the_constants_of_other_parts():
    """This is common practice. If a pair of materials has a stiffness of its own, nothing is softened."""
    own = {"damping": 1.0, "viscous_time": 1e-6, "rolling_stiffness": 1e6, "rolling_damping": 1.0,
           "twisting_friction": 0.1, "twisting_stiffness": 1e6, "twisting_damping": 1.0,
           "cohesion_energy_density": 1e3, "stiffness": 1e6}  # fmt: skip
    parts_of_law = {
        "damping": (ConstantDamping(), ViscoelasticDamping()),
        "rolling": (RollingSDS(),),
        "twisting": (TwistingSDS(),),
        "cohesion": (SJKR(),),
    }
    assert softening(grains(**own)) == {"young": 0.4}
    for place, others in parts_of_law.items():
        for other in others:
            whole = exchanged(grains(**own), f"effects.granular.{place}", other)
            assert softening(whole) == {"young": 0.4}, other
            before, after = (one.materials["glass"] for one in (whole, softened(whole, {"young": 0.4}, 10.0)))
            assert after == before.model_copy(update={"young": 5e9})
    bond = ParallelBond(young=1e9, tensile_strength=1e6, shear_strength=1e6)
    bonded = grains().model_copy(update={"effects": (*grains().effects, bond)})
    assert softened(bonded, softening(bonded), 10.0).effects == bonded.effects
    linear = exchanged(grains(**own), "effects.granular.normal", Hooke())
    for given, powers in (({"stiffness": 1e5}, {}), ({"friction": 0.1}, {"stiffness": 0.5})):
        pairs = {"glass-glass": MaterialPair(**given)}
        assert softening(linear.model_copy(update={"material_pairs": pairs})) == powers


def test_hookes_spring_does_not_replace_laws_whose_attraction_depends_on_the_overlap():
    for law, offered in (
        (Granular(), True),
        (Granular(normal=JKR()), False),
        (Granular(cohesion=SJKR()), False),
        (Granular(cohesion=DMT()), True),
    ):
        assert any(other.normal == Hooke() for other in law.approximations(1.0)) == offered, law


def test_a_part_is_exchanged_in_its_place():
    scene = oscillator()
    assert dict(parts(scene))["stepper.control"] == scene.stepper.control
    changed = exchanged(scene, "stepper.control", FixedStep(dt=0.5))
    assert changed.stepper == Verlet(control=FixedStep(dt=0.5))
    changed = exchanged(scene, "effects.tether", Tether(stiffness=(1.0, 2.0, 3.0)))
    assert changed.effects == (Tether(stiffness=(1.0, 2.0, 3.0)),)
    assert expression(changed.stepper) == f"Verlet(control=FixedStep(dt={scene.stepper.control.dt}))"


def test_an_accuracy_parameter_is_varied_by_decades_of_error():
    both = AccuracyParameter(dt=2, error=1)
    turned = both.turned(Pace(dt=1.0, error=1e-3), 1)
    assert (turned.dt, turned.error) == (3.16, 1e-2)
    assert both.turned(Pace(dt=0.123456, error=1e-3), 0).dt == 0.123456
    with pytest.raises(InputError, match=r"pace.dt must be at least 1e-30; received 0.0"):
        AccuracyParameter(dt=0.01).turned(Pace(dt=1.0), -4)


def test_whole_numbers_remain_whole():
    """Attempts decrease with the error, by a factor of 100 in a decade."""
    tries = AccuracyParameter(attempts=-0.5)
    contraction = MechanicalContraction(attempts=2000)
    assert [repr(tries.turned(contraction, k).attempts) for k in (1, 0, -1)] == ["20", "2000", "200000"]
    assert tries.turned(MechanicalContraction(attempts=60), 1).attempts == 1
    with pytest.raises(InputError, match=r"mechanical_contraction.attempts must be at least 1; received 0"):
        tries.turned(contraction, 2)
    packed = packing.scene_for("small", 0).replace({"stepper.attempts": 1234})
    named = [s.description for s in methods_of(packed)["MechanicalContraction(volume_step=1.05, halvings=3, "
             "attempts=1234): attempts"].settings]  # fmt: skip
    assert named == ["attempts=12", "attempts=1234"]


@pytest.mark.slow
def test_packing_steppers_are_compared_with_each_other():
    """The energy minimisation alone converges, to the jamming density of a start, and is the reference."""
    tried = methods_of(packing.scene_for("small", 0))
    own = "MechanicalContraction(volume_step=1.05, halvings=3, attempts=200)"
    other = own.replace("(", "(method='original', ", 1)
    assert list(tried) == [
        f"{own}: attempts", f"{own}: volume_step", f"{own}: tolerance", f"{own}: motion",
        f"{other}: attempts", f"{other}: volume_step", f"{other}: tolerance",
        "EnergyMinimisation: precision, tolerance",
        "MonteCarloGrowth(precision=0.001): precision", "MonteCarloGrowth(precision=0.001): rate",
    ]  # fmt: skip
    references = reference_runs(list(tried.values()), 0.0)
    assert [one.name for one in references] == ["EnergyMinimisation"] * 2
    assert [one.scene.stepper.tolerance for one in references] == [1e-6, 1e-5]
    ellipsoids = methods_of(packing.of_shape(packing.spheroid(1.5), "small", 0))
    assert not any("original" in name for name in ellipsoids)
    assert "EnergyMinimisation: precision, tolerance" in ellipsoids
    growing = packing.scene_for("small", 0).model_copy(update={"stepper": MonteCarloGrowth()})
    contracted = [name for name in methods_of(growing) if name.startswith("Mechanical")]
    assert contracted[0] == "MechanicalContraction(method='original', attempts=2000): attempts"


WRONG = [
    ({"repeats": 0}, "repeats must be a whole number, at least 1; received 0"),
    ({"coarser": 1.5}, "coarser must be a whole number of decades; received 1.5"),
    ({"coarser": 1, "finer": -2}, "must be at least 0; received -1"),
    ({"precisions": ("f32",)}, "precisions must be a list that begins with f64"),
    ({"arithmetics": ("fast",)}, "arithmetics must be strict, or strict and fast"),
    ({"precisions": ("f64", "f16")}, "precision must be f64 or f32; received 'f16'"),
    ({"starts": (8, 4)}, "starts must be in increasing order"),
    ({"starts": (1, 4)}, "starts must be at least 2"),
    ({"budget": 0.0}, "budget must be greater than 0"),
    (
        {"quantities": (KNOWN, type(KNOWN)("mean", KNOWN.value, random=True))},
        "must be all random or",
    ),
    ({"quantities": (UNKNOWN, UNKNOWN)}, "quantities must be quantities with different names"),
]


@pytest.mark.parametrize(("settings", "message"), WRONG, ids=[str(k) for k in range(len(WRONG))])
def test_wrong_settings_are_refused_before_anything_runs(settings, message):
    with pytest.raises(InputError, match=message):
        Study(oscillator(), **settings)


def test_a_reference_that_another_stepper_contradicts_is_not_believed(monkeypatch):
    monkeypatch.setattr(Sharp, "is_alternative", True)
    references = reference_runs(list(methods_of(oscillator()).values()), 0.0)
    number = Quantity("number", lambda result: result)

    def own(*values):
        return truth_by_reference(number, [[value] for value in values], references[: len(values)]).error

    assert own(1.0, 1.01) == pytest.approx(0.01)
    # The check differs from the reference by no more than its own two settings differ.
    assert own(1.0, 1.01, 1.2, 1.4) == pytest.approx(0.01)
    assert own(1.0, 1.01, 1.2, 1.21) == pytest.approx(0.2)


def row(name, seconds, error, off=0.0, sums=1.0):
    seconds = seconds if isinstance(seconds, tuple) else (seconds,)
    return Row(name, "", "", "", "f64", 1, seconds=seconds, sums=sums, errors=((error, off),))


def test_the_uncertainty_of_an_error_counts_in_the_choice():
    rows = [row("sure", 2.0, 5e-4, 1e-5), row("unsure", 1.0, 9e-4, 5e-4), row("slow", 3.0, 1e-6, 0.0)]
    assert [r.method for r in tied(rows, 1e-3)] == ["sure"]
    assert [r.method for r in tied(rows, 2e-3)] == ["unsure"]
    assert tied(rows, 1e-7) == []
    names_by_error = {error: best.method for error, (best,) in decades(rows).items()}
    assert names_by_error == {1e-2: "unsure", 1e-3: "sure", 1e-4: "slow", 1e-5: "slow", 1e-6: "slow"}
    assert [r.trusted() for r in rows] == [True, False, True]


def test_work_decides_between_methods_of_indistinguishable_timings():
    """Noise of 2 ms, the resolution of the clock and a single timing do not decide between methods."""
    spread = [
        row("a", (0.010, 0.012, 0.013), 1e-5, sums=20.0),
        row("b", (0.009, 0.01, 0.012), 1e-5, sums=90.0),
    ]
    clock = [row("a", (2e-4, 2e-4), 1e-5, sums=20.0), row("b", (1e-4, 1e-4), 1e-5, sums=90.0)]
    once = [row("a", 1.1, 1e-5, sums=20.0), row("b", 1.0, 1e-5, sums=90.0)]
    for rows in (spread, clock, once):
        assert [r.method for r in tied(rows, 1e-4)] == ["a", "b"]
        assert decades(rows)[1e-5] == rows
    apart = [row("a", (0.020, 0.021, 0.022), 1e-5, sums=20.0), spread[1]]
    assert [r.method for r in tied(apart, 1e-4)] == ["b"]
    # A setting that is slower and less accurate is not recommended even if its work is less.
    beaten = [row("a", (1.05e-3, 1.05e-3), 9.7e-7, sums=20.0), row("b", (6.6e-4, 6.6e-4), 4e-10, sums=90.0)]
    assert [r.method for r in tied(beaten, 1e-4)] == ["b", "a"]
    # The number of starts counts as work.
    more = replace(spread[0], starts=8)
    assert [r.method for r in tied([more, spread[1]], 1e-4)] == ["b", "a"]


def test_a_law_that_changes_nothing_is_not_chosen():
    law = row("all pairs", 2.0, 1e-5)
    for error, same in ((1e-5 + 1e-15, True), (1e-5 + 1e-10, False)):
        cut = row("cut-off", 1.0, error)
        assert cut.same_errors(law) == same
        setting = tied([law, replace(cut, same=cut.same_errors(law))], 1e-4)
        assert [r.method for r in setting] == ["all pairs" if same else "cut-off"]
    assert not law.same_errors(law)
    assert not law.same_errors(Row("failed", "", "", "", "f64", 1, failed="not finite"))


def pictured(*rows):
    """Labels of the legend, and limits of the error axis, of a study with these rows."""
    cost_study = Study(oscillator(), (KNOWN,))
    cost_study.rows = list(rows)
    figure = plot(cost_study)
    (legend,) = figure.legends
    return [" ".join(text.get_text().split()) for text in legend.get_texts()], figure.axes[0].get_ylim()


def test_failed_settings_are_in_the_legend():
    failed = Row("never", "", "", "", "f64", 1, failed="a quantity is not finite")
    labels, _ = pictured(
        row("good", 1.0, 1e-3), failed, row("at times", 1.0, 1e-2), replace(failed, method="at times")
    )
    assert labels[:3] == ["good", "never (1 of 1 failed)", "at times (1 of 2 failed)"]
    assert labels[3] == "cheapest for a power of ten of the error"
    labels, (low, high) = pictured(failed)
    assert labels == ["never (1 of 1 failed)"]
    assert 0 < low < high


def test_a_method_has_one_colour_in_all_precisions_and_arithmetics():
    numbers = (("f64", "strict"), ("f32", "strict"), ("f64", "fast"), ("f32", "fast"))
    rows = [row("other", 1.0, 1e-2)]
    for precision, arithmetic in numbers:
        name = "mine" + ", f32" * (precision == "f32") + ", fast" * (arithmetic == "fast")
        rows.append(replace(row(name, 1.0, 1e-3), precision=precision, arithmetic=arithmetic))
    cost_study = Study(oscillator(), (KNOWN,))
    cost_study.rows = rows
    lines = {line.get_label(): line for line in plot(cost_study).axes[0].get_lines()}
    own = [lines[one.method] for one in rows[1:]]
    assert {line.get_color() for line in own}.isdisjoint({lines["other"].get_color()})
    assert len({line.get_color() for line in own}) == 1
    assert [line.get_linestyle() for line in own] == ["-", "--", ":", "--"]


def test_values_of_one_parameter_are_joined_and_laws_are_not():
    turned = [replace(row("Verlet: dt", t, 1e-3), setting=f"dt={t:.3g}") for t in (1e-5, 2.5, 300.0)]
    softer = [replace(row("softer", t, 1e-3), setting=f"by {10 * t:g}, dt={t:.3g}") for t in (1.0, 1e6)]
    laws = [
        replace(row(name, k, 1e-3), setting=what)
        for name, parts in {
            "Law": ("a=None", "b=Other(), a=None"),
            "Spring": ("a=One()", "a=Other2()"),
        }.items()
        for k, what in enumerate(parts, 1)
    ]
    cost_study = Study(oscillator(), (KNOWN,))
    cost_study.rows = turned + softer + laws
    lines = {line.get_label(): line for line in plot(cost_study).axes[0].get_lines()}
    styles = [lines[name].get_linestyle() for name in ("Verlet: dt", "softer", "Law", "Spring")]
    assert styles == ["-", "-", "None", "None"]


def test_a_picture_of_large_errors_is_not_blank():
    _, (low, high) = pictured(row("far off", 1.0, 1e5), row("farther", 2.0, 1e6))
    assert low < 1e5 < high


def test_an_accuracy_that_no_setting_reaches_is_refused():
    cost_study = Study(oscillator(), (KNOWN,))
    cost_study.rows = [row("good", 1.0, 1e-3, 1e-4)]
    with pytest.raises(RunError) as error:
        cost_study.cheapest(1e-4)
    assert str(error.value) == (
        "error of known must be at least 1.1e-03, the least that was reached (good, ; finer settings go "
        "further); received 0.0001"
    )
    cost_study.rows = [Row("never", "", "", "", "f64", 1, failed="a quantity is not finite")]
    with pytest.raises(RunError, match=r"received no setting that ran: a quantity is not finite"):
        cost_study.cheapest(1.0)


def test_the_table_fits_80_columns_and_cuts_no_number():
    """Two quantities with long names, and a method with long settings."""
    many = {"seconds": (0.05,), "steps": 123456.0, "sums": 1234567.0, "rejections": 12345.0}
    long = Row("Long", "error=1e-04, tolerance=1e-05", "", "", "f64", 1, errors=((1.2e-4, 0.0),) * 2, **many)
    limits = Row(
        "Long", "longest=6.51e-05, tolerance=0.001", "", "", "f64", 1, errors=((1.0, 0.0),) * 2, **many
    )
    failed = Row("Long", "error=1e-05", "", "", "f64", 1, failed="a quantity is not finite")
    cost_study = Study(
        oscillator(), [replace(KNOWN, name=name) for name in ("positions", "centre of gravity")]
    )
    cost_study.rows = [long, limits, failed]
    console = Console(width=80, file=io.StringIO())
    console.print(table(cost_study))
    lines = console.file.getvalue().splitlines()
    assert max(map(len, lines)) <= 80
    assert any(line.startswith(" longest=6.51e-05,") for line in lines)
    (whole,) = [line for line in lines if "1.2e-04" in line]
    assert whole.split()[-8:-1] == ["0.05", "0", "123456", "1234567", "12345", "1.2e-04", "1.2e-04"]
    assert "  error=1e-05: a quantity is not finite" in lines


def test_a_useless_reference_is_reported():
    """Its own error is as large as the motion, as in a chaotic system."""
    quantity = Quantity("positions", lambda result: result.state["position"])
    for error, said in ((1e-3, False), (1.3, True)):
        truth = SimpleNamespace(error=error, source="a finer run")
        study = Study(oscillator(), [quantity])
        study.truths, study.complete = (truth,), True
        text = " ".join(notes(study))
        assert ("the reference itself is off by 1 of the motion" in text) == said


@pytest.mark.parametrize("error", [1e-4, 1e-9])
def test_options_replace_a_stepper_that_tisim_has_chosen(error):
    """It is not part of the data of the scene, so its settings cannot be given one by one."""
    chosen = oscillator().model_copy()
    automatic = type(chosen).from_dict({k: v for k, v in chosen.to_dict().items() if k != "stepper"})
    control = automatic.stepper.control.model_copy(update={"error": error})
    wanted = automatic.stepper.model_copy(update={"control": control})
    changed = type(chosen).from_dict({**automatic.to_dict(), "stepper": serialization.to_dict(wanted)})
    changes = assignments(options(automatic, changed)[1::2])
    assert automatic.replace(changes).stepper == wanted
    assert options(automatic, automatic) == []


def test_options_name_the_stepper_beside_an_exchanged_law():
    """Otherwise tisim might choose another stepper for the exchanged law than the measured one."""
    law = NearField(alpha1=1.0, alpha2=2.0, beta2=3)
    data = oscillator().model_copy(update={"effects": (law,)}).to_dict()
    automatic = Scene.from_dict({key: value for key, value in data.items() if key != "stepper"})
    other = methods_of(automatic)["TruncatedNearField"].settings[0].scene
    arguments = options(automatic, other)
    assert arguments[:2] == ["--without", "near_field"]
    changes = assignments(arguments[3::2])
    assert changes.keys() == {"stepper", "effects.truncated_near_field"}
    again = automatic.without("near_field").replace(changes)
    assert again.stepper == other.stepper
