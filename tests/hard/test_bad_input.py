"""Bad input gives a message of the form "X must be Y; received Z" before anything runs, and leaves no
trace."""

import numpy as np
import pytest

import tisim
from tests.scenes import flow, scene, simulate
from tisim import Box, Cloud, InputError, Lattice, Particles, RandomAroundCylinder, Scene, Simulation
from tisim.backend import memory
from tisim.effects import Impact, Mie
from tisim.operators import Cooling, Fragmentation
from tisim.steppers import ApproachTime, FixedStep, Verlet

NAN, INF = float("nan"), float("inf")
CLOUD = {"number": 3, "radius": 0.1, "density": 1.0}
ONE = {"position": [[0, 0, 0]], "velocity": [[0, 0, 0]], "radius": 1.0, "mass": 1.0}


def particles(**changes):
    return Particles(**{**ONE, **changes})


BAD = {
    "no particles": (lambda: Cloud(**{**CLOUD, "number": 0}), "cloud.number must be greater than 0"),
    "half a particle": (lambda: Cloud(**{**CLOUD, "number": 2.5}), "cloud.number must be a whole number"),
    "negative radius": (lambda: Cloud(**{**CLOUD, "radius": -1}), "cloud.radius must be greater than 0"),
    "radius nan": (lambda: Cloud(**{**CLOUD, "radius": NAN}), "cloud.radius must be a finite number"),
    "absolute zero": (lambda: Cloud(**CLOUD, temperature=0), "cloud.temperature must be greater than 0"),
    "no mass at all": (
        lambda: Cloud(**{**CLOUD, "radius": 1e-120}),
        "cloud.radius must be 0, or of a magnitude of 1e-100 to 1e+100 m; received 1e-120",
    ),
    "radius beyond volumes": (lambda: Cloud(**{**CLOUD, "radius": 1e200}), "cloud.radius must be 0, or of"),
    "mass beyond numbers": (
        lambda: Cloud(**{**CLOUD, "density": 1e300}),
        "mass of a particle of the cloud must be from 1e-100 to 1e+100 kg; received",
    ),
    "mass of 1e-320": (lambda: particles(mass=1e-320), "particles.mass must be from 1e-100 to 1e+100 kg"),
    "mass of 1e308": (lambda: particles(mass=1e308), "particles.mass must be from 1e-100 to 1e+100 kg"),
    "a radius of 1e-300": (lambda: particles(radius=1e-300), "particles.radius must be from 1e-100 to 1e+1"),
    "a place at 1e300": (
        lambda: particles(position=[[1e300, 0, 0]]),
        "particles.position must be at most 1e+100 m from the origin; received 1e+300",
    ),
    "whole number without end": (
        lambda: particles(quantities={"temperature": [10**400]}),
        "particles.temperature must be numbers; received [a whole number of about 401 digits]",
    ),
    "text for a quantity": (
        lambda: particles(quantities={"temperature": "300"}),
        "particles.temperature must be numbers; received '300'",
    ),
    "half a surrogate pair": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=1, name="\ud800"),
        "scene.name must be text that UTF-8 can hold; received '\\ud800'",
    ),
    "more sites than a start can have": (
        lambda: Lattice(shape=(10**4,) * 3, spacing=1.0),
        "lattice.shape must be of at most 1e+08 sites together; received (10000, 10000, 10000)",
    ),
    "thickness beyond areas": (
        lambda: RandomAroundCylinder(radius=1, length=1, thickness=3e296),
        "random_around_cylinder.thickness must be 0, or of a magnitude of 1e-100 to 1e+100 m",
    ),
    "axis beyond squares": (
        lambda: RandomAroundCylinder(radius=1, length=1, thickness=1, axis=(1e200, 0, 0)),
        "random_around_cylinder.axis must be a direction",
    ),
    "a subnormal parameter": (
        lambda: Impact(hardness=1e-320),
        "impact.hardness must be 0, or of a magnitude of 2.225e-308 to 1.798e+308 Pa; received 1e-320",
    ),
    "more iterations than can be counted": (
        lambda: Impact(hardness=1, max_iterations=2**31),
        "impact.max_iterations must be less than 2147483648",
    ),
    "an exponent without end": (lambda: Mie(epsilon=1, n=1e300), "mie.n must be less than 2147483648"),
    "unknown key": (
        lambda: Cloud(**CLOUD, colour="red"),
        "cloud.colour must be a known key: number, radius, ",
    ),
    "unit in text": (
        lambda: Cloud(**{**CLOUD, "radius": "1 mm"}),
        "cloud.radius must be a number; received '1 mm'",
    ),
    "two components": (lambda: Cloud(**CLOUD, deviation=(1, 2)), "cloud.deviation"),
    "none at all": (
        lambda: Scene(particles=particles(position=[], velocity=[]), duration=1.0),
        "particles must be at least one, or inserted by an effect such as insertion_by_flux; received none",
    ),
    "empty array": (
        lambda: Scene(particles=particles(position=np.zeros((0, 3)), velocity=np.zeros((0, 3))), duration=1),
        "particles must be at least one",
    ),
    "velocities of nobody": (
        lambda: particles(position=[]),
        "particles.velocity must be one value or 0 of them",
    ),
    "mass zero": (lambda: particles(mass=0.0), "particles.mass must be greater than 0"),
    "mass negative": (lambda: particles(mass=-1.0), "particles.mass must be greater than 0"),
    "one radius negative": (lambda: particles(radius=[-1.0]), "particles.radius must be greater than 0"),
    "mass and density": (lambda: particles(density=1.0), "particles must be given mass or density; received"),
    "neither": (lambda: particles(mass=None), "particles must be given mass or density; received"),
    "position nan": (lambda: particles(position=[[0, NAN, 0]]), "particles.position"),
    "velocity inf": (lambda: particles(velocity=np.array([[0, 0, INF]])), "particles.velocity"),
    "too many velocities": (
        lambda: particles(velocity=np.zeros((2, 3))),
        "particles.velocity must be one value or 1",
    ),
    "plane": (lambda: particles(position=[[0, 0]]), "particles.position"),
    "temperature nan": (
        lambda: particles(quantities={"temperature": NAN}),
        "particles.temperature must be finite",
    ),
    "wrong shape": (
        lambda: particles(quantities={"temperature": [1.0, 2.0]}),
        "particles.temperature must be one value",
    ),
    "quantity is text": (
        lambda: particles(quantities={"temperature": "hot"}),
        "particles.temperature must be",
    ),
    "mass by the back door": (
        lambda: particles(quantities={"mass": -1.0}),
        "particles.quantities.mass must be given",
    ),
    "box inside out": (lambda: Box(low=(0, 0, 0), high=(1, 1, 0)), "box.high must be above box.low in every"),
    "box infinite": (lambda: Box(low=(0, 0, 0), high=(1, 1, INF)), "box.high.2 must be a finite number"),
    "box beyond numbers": (lambda: Box(low=(0, 0, 0), high=(1e200,) * 3), "box.high must be 0, or of"),
    "step zero": (lambda: FixedStep(dt=0), "fixed_step.dt must be at least 1e-30"),
    "limits crossed": (
        lambda: ApproachTime(shortest=1e-2),
        "approach_time.longest must be at least shortest",
    ),
    "areas crossed": (
        lambda: Impact(hardness=1, initial_area=2),
        "impact.final_area must be at least initial_area",
    ),
    "too bright": (lambda: Cooling(emissivity=1.1), "cooling.emissivity must be at most 1"),
    "threshold of one": (
        lambda: Fragmentation(surface_energy=1, grain_mass=1, threshold=1.0),
        "fragmentation.threshold must be less than 1",
    ),
    "no duration": (
        lambda: Scene(particles=Cloud(**CLOUD)),
        "scene.duration must be given (simulated time, s); received nothing",
    ),
    "duration zero": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=0),
        "scene.duration must be greater than 0",
    ),
    "duration inf": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=INF),
        "scene.duration must be a finite number",
    ),
    "seed negative": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=1, seed=-1),
        "scene.seed must be at least 0",
    ),
    "seed huge": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=1, seed=2**63),
        "scene.seed must be less than",
    ),
    "effect is text": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=1, effects="impact"),
        "scene.effects",
    ),
    "stepper is text": (
        lambda: Scene(particles=Cloud(**CLOUD), duration=1, stepper="verlet"),
        "scene.stepper",
    ),
}


@pytest.mark.parametrize(("make", "message"), BAD.values(), ids=BAD)
def test_refused_when_made(make, message):
    with pytest.raises(InputError) as fault:
        make()
    text = str(fault.value)
    assert text.startswith(message), text
    assert " must be " in text
    assert "; received " in text
    assert len(text) < 300, "says what was wrong, not everything that was given"


def from_dict(**changes):
    data = Scene(particles=Cloud(**CLOUD), duration=1.0, effects=(Impact(hardness=1.0),)).to_dict()
    return Scene.from_dict({**data, **changes})


BAD_DATA = {
    "no particles": (lambda: Scene.from_dict({"duration": 1}), "scene.particles must be given; received"),
    "particles of no kind": (lambda: from_dict(particles={"number": 3}), "particles.kind must be given"),
    "particles of unknown kind": (
        lambda: from_dict(particles={"kind": "swarm"}),
        "particles.kind must be one of",
    ),
    "particles not a table": (
        lambda: from_dict(particles=[1, 2]),
        "particles must be a table; received [1, 2]",
    ),
    "unknown effect": (lambda: from_dict(effects={"impcat": {}}), "effects.impcat.kind must be one of"),
    "effect not a table": (lambda: from_dict(effects={"impact": 3.0}), "effects.impact must be a table"),
    "effects a list": (lambda: from_dict(effects=[1]), "scene.effects must be a table of effects"),
    "unknown domain": (lambda: from_dict(domain={"kind": "torus"}), "domain.kind must be one of"),
    "unknown control": (
        lambda: from_dict(stepper={"control": {"kind": "guess"}}),
        "stepper.control.kind must be one of",
    ),
    "stepper not a table": (lambda: from_dict(stepper=1e-3), "stepper must be a table; received 0.001"),
    "unknown key": (lambda: from_dict(durration=2), "scene.durration must be a known key: name, particles, "),
    "name is a number": (lambda: from_dict(name=3), "scene.name must be text; received 3"),
}


@pytest.mark.parametrize(("make", "message"), BAD_DATA.values(), ids=BAD_DATA)
def test_data_refused(make, message):
    with pytest.raises(InputError) as fault:
        make()
    assert str(fault.value).startswith(message), str(fault.value)
    assert "; received " in str(fault.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "scene file must exist; received"),
        (b"", "scene.particles must be given; received"),
        (b"name = ", "scene file must be TOML; received"),
        (b"\xff\xfe\x00", "scene file must be TOML; received"),
        (flow(grains=4).to_toml().encode()[:400], "scene"),
    ],
    ids=["missing", "empty", "cut in a line", "binary", "cut short"],
)
def test_file_refused(tmp_path, content, message):
    file = tmp_path / "scene.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(InputError) as fault:
        Scene.from_toml(file)
    assert str(fault.value).startswith(message), str(fault.value)
    assert "; received " in str(fault.value)


def test_every_cut_of_a_scene_file_is_refused_or_read(tmp_path):
    """A scene file cut at any byte gives an InputError or a valid scene, and nothing else."""
    whole = flow(grains=2).to_toml().encode()
    file = tmp_path / "scene.toml"
    refusals = []
    for end in range(0, len(whole), 7):
        file.write_bytes(whole[:end])
        try:
            Scene.from_toml(file)
        except InputError as fault:
            refusals.append(str(fault))
    assert len(refusals) > 20
    assert all(" must " in text and "; received " in text for text in refusals)


def test_a_start_that_does_not_fit_is_refused():
    """Refused: random packings that are too dense, a random cloud in open space, and more particles than the
    capacity."""
    dense = Scene(
        particles=Cloud(number=400, radius=0.1, density=1.0),
        domain=Box(low=(0, 0, 0), high=(1, 1, 1)),
        stepper=Verlet(control=FixedStep(dt=1.0)),
        duration=1.0,
    )
    with pytest.raises(InputError, match=r"volume fraction must be at most 0.384.*; received 1\.676"):
        tisim.run(dense)
    with pytest.raises(
        InputError, match=r"domain must be bounded to hold a random cloud; received an open one"
    ):
        tisim.run(Scene(particles=Cloud(**CLOUD), duration=1.0))
    still = Verlet(control=FixedStep(dt=1.0))
    fits = Scene(particles=particles(), stepper=still, duration=1.0)
    many = Scene(
        particles=particles(position=np.zeros((5, 3)), velocity=np.zeros((5, 3))), stepper=still, duration=1.0
    )
    simulation = Simulation(fits, worlds=1)
    with pytest.raises(InputError, match=r"particles of scene 'scene' must be at most 1; received 5"):
        simulation.load([many])
    with pytest.raises(InputError, match=r"number of scenes must be 1 to 1; received 2"):
        simulation.load([fits, fits])
    with pytest.raises(InputError, match=r"number of scenes must be 1 to 1; received 0"):
        simulation.load([])
    with pytest.raises(InputError, match=r"worlds must be a whole number, at least 1; received 0"):
        Simulation(fits, worlds=0)
    simulation.close()


def test_more_than_the_machine_holds_is_refused_before_anything_runs():
    """A tiny smallest fragment would need practically unlimited slots."""
    scene = flow(seed=1, grains=20).replace({"effects.fragmentation.grain_mass": 1e-20})
    with pytest.raises(InputError, match=r"memory for 1 x \d+ particles must be within the \d+ GB"):
        Simulation(scene)


def test_more_numbers_than_a_field_can_have_are_refused_like_too_much_memory(monkeypatch):
    """The memory allocated before the refusal is freed: the next simulation can be made and runs."""
    one = scene([[0.0, 0, 0]], [[1.0, 0, 0]])
    monkeypatch.setattr(memory, "MOST_ENTRIES", 50)
    rule = r"^numbers for 1 x 64 particles must be at most 50 in each field(, with .* use)?; received \d+"
    with pytest.raises(InputError, match=rule):
        Simulation(one, capacity=64)
    monkeypatch.undo()
    (result,) = simulate([one], capacity=64)
    assert result.status.ok
