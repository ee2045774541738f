"""A law that does not compile gives a one-line error, with the line number in its author's file."""

import pytest

import tisim
from tests.scenes import scene
from tisim import InputError
from tisim.cli.main import main
from tisim.effects import Field, WorldField
from tisim.files import python_file
from tisim.state.fields import resolve_fields
from tisim.state.state import State
from tisim.steppers import Collocation, Trapezoid

TYPED_IN = """
from tisim.backend.taichi import ti
from tisim.effects import Force

class TypedIn(Force):
    @ti.func
    def force(self, s, w, i, t):
        return -s.position[w, i]
"""


def test_a_law_without_source_text_is_refused():
    """Such laws are typed in, or read from standard input or the command line."""
    names = {"__name__": "typed_in"}
    exec(TYPED_IN, names)
    bare = scene([[0.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]], (names["TypedIn"](),))
    message = r"TypedIn\.force must be defined in a file or in a cell of a notebook, .*; received one without"
    with pytest.raises(InputError, match=message):
        tisim.run(bare)


LAWS = """
from tisim.backend.taichi import ti
from tisim.effects import Field, Force, parameter, WorldField


class UnknownName(Force):
    k: float = parameter("N/m", "stiffness", 1.0)

    @ti.func
    def force(self, s, w, i, t):
        return -self.kk(w) * s.position[w, i]


class NotCalled(Force):
    k: float = parameter("N/m", "stiffness", 1.0)

    @ti.func
    def force(self, s, w, i, t):
        return -self.k * s.position[w, i]


class Undeclared(Force):
    @ti.func
    def force(self, s, w, i, t):
        return s.charge[w, i] * s.velocity[w, i]


class Reads(Force):
    world_fields = (WorldField("read", "counter"),)


class Again(Force):
    world_fields = (WorldField("status", "measure"),)


class OfStepper(Force):
    world_fields = (WorldField("rejections", "counter"),)


class Taken(Force):
    fields = (Field("capacity", ""),)
"""
SAID = {
    "UnknownName": r"laws\.py, line 11, in UnknownName\.force, must be code that Taichi can compile; .*'kk'",
    "NotCalled": r"laws\.py, line 19, in NotCalled\.force, must be code that Taichi can compile; .*bad op",
    "Undeclared": r"laws\.py, line 25, in Undeclared\.force, must be .*'charge' must be declared in",
    "Reads": r"^name of a field must be a Python name that nothing else in the state has; received 'read'$",
    "Taken": r"^name of .* must be a Python name that nothing else in the state has; received 'capacity'$",
    "Again": r"^name of a field must be a Python name that nothing else in the state has; received 'status'$",
}


@pytest.mark.parametrize("name", SAID)
def test_in_python(own_file, name):
    laws = python_file.load(own_file("laws.py", LAWS))
    with pytest.raises(InputError, match=SAID[name]) as error_info:
        tisim.run(scene([[0, 0, 0]], [[0, 0, 0]], (getattr(laws, name)(),)))
    assert "\n" not in str(error_info.value)


@pytest.mark.parametrize("stepper", [Trapezoid(), Collocation()])
def test_names_of_stepper_and_effect_must_differ(own_file, stepper):
    """Both would write the same counter."""
    own = python_file.load(own_file("laws.py", LAWS)).OfStepper()
    rule = (
        r"^name of a field must be a Python name that nothing else in the state has; received 'rejections'$"
    )
    with pytest.raises(InputError, match=rule):
        tisim.run(scene([[0, 0, 0]], [[0, 0, 0]], (own,), stepper=stepper))


def test_on_the_command_line(own_file, capsys):
    own_file("laws.py", LAWS)
    text = scene([[0, 0, 0]], [[0, 0, 0]], ()).to_toml() + "\n[effects.unknown_name]\n"
    own_file("wrong.toml", text)
    with pytest.raises(SystemExit) as end:
        main(["run", "wrong.toml", "--plugin", "laws.py"])
    assert end.value.code == 2
    assert "line 11, in UnknownName.force, must be code that Taichi can compile" in " ".join(
        capsys.readouterr().err.split()
    )


def test_a_method_of_the_contract_must_be_for_kernels(own_file):
    """The error is raised when the class is defined, with the line of the file given to a command."""
    plain = LAWS.replace("    @ti.func\n", "", 1)
    rule = r"UnknownName\.force must be decorated with ti\.func, as in its contract; received 'function'"
    with pytest.raises(InputError, match=rule):
        python_file.load(own_file("plain.py", plain))


def test_only_scenes_can_be_run():
    for wrong in ("scene.toml", ["scene.toml"], [None]):
        with pytest.raises(InputError, match="scenes must be a Scene or a list of them"):
            tisim.run(wrong)
    with pytest.raises(InputError, match=r"path must be text or a pathlib\.Path; received 3"):
        tisim.read(3)


@pytest.mark.parametrize("name", ["capacity", "real", "remove", "a-b"])
def test_a_particle_field_needs_a_name_of_its_own(name):
    rule = f"^name of a field must be a Python name that nothing else in the state has; received '{name}'$"
    with pytest.raises(InputError, match=rule):
        resolve_fields([Field(name, "")], State.reserved())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("push", "count"), "kind of world field push must be one of counter, measure, .*; received 'count'"),
        (("push", "measure", "N", 3), "components of world field push must be 1, or 3 for .*; received 3"),
    ],
)
def test_a_world_field_of_an_unknown_kind_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        WorldField(*arguments)


def test_every_attribute_of_a_state_is_reserved():
    """No field can replace it: ``reserved`` reads the annotations of the class."""
    one = scene([[0, 0, 0]], [[1, 0, 0]], ())
    simulation = tisim.Simulation(one)
    own = {field.name for field in (*simulation.s.fields, *simulation.s.world_fields)}
    public = {name for name in vars(simulation.s) if not name.startswith("_")}
    assert public - own <= set(simulation.s.reserved())
    simulation.close()
