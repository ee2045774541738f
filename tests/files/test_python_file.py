"""Python files of users are imported under their own names, or refused with an error of one line."""

import functools
import inspect
import pickle
import sys

import pytest

from tests.own_files import LAW
from tisim import InputError
from tisim.effects.base import Force
from tisim.files import python_file


def test_a_file_is_imported_once_under_its_own_name(own_file):
    module = python_file.load(own_file("a_law.py", LAW))
    assert sys.modules["a_law"] is module
    assert python_file.load("a_law.py") is module
    assert pickle.loads(pickle.dumps(module.Pull(strength=2.0))) == module.Pull(strength=2.0)
    assert [file.name for file in python_file.loaded_files()] == ["a_law"]


def test_a_changed_file_is_another_and_its_old_classes_are_not_known(own_file):
    first = python_file.load(own_file("a_law.py", LAW))
    before = python_file.module_checksums(first.Pull)
    again = python_file.load(own_file("a_law.py", LAW + "\nMORE = 1\n"))
    assert again is not first
    assert python_file.module_checksums(again.Pull) != before
    assert Force.known()["pull"] is again.Pull
    assert python_file.is_superseded(first.Pull)


def test_the_loaded_text_is_compiled(own_file):
    """Taichi reads the source when it compiles, and the file may have changed by then."""
    module = python_file.load(own_file("a_law.py", LAW))
    own_file("a_law.py", "# nothing is left of it\n" * 40)
    assert inspect.getsource(module.Pull).startswith("class Pull(Force):")


def test_another_file_of_the_same_name_is_refused(own_file):
    python_file.load(own_file("a_law.py", LAW))
    own_file("elsewhere/a_law.py", LAW)
    with pytest.raises(InputError, match=r"^name of elsewhere/a_law.py must be one that no other module has"):
        python_file.load("elsewhere/a_law.py")
    own_file("numpy.py", LAW)
    with pytest.raises(InputError, match=r"must be one that no other module has; received '.*numpy"):
        python_file.load("numpy.py")


FAULTS = {
    "x = 1\nif x\n    pass\n": "line 2: SyntaxError: expected ':'",
    "\n\nraise ValueError('a\\nb')\n": "line 3: ValueError: a b",
    "def f():\n    return nothing\n\nf()\n": "line 2: NameError: name 'nothing' is not defined",
    "import no_such_module_at_all\n": "line 1: ModuleNotFoundError: No module named 'no_such_module_at_all'",
    "import sys\nsys.exit(3)\n": "line 2: SystemExit: 3",
    "from tisim.optimize import Gene\nGene('a', 'm', 2, 1)\n": "line 2: InputError: range of gene a must be",
}


@pytest.mark.parametrize("text", FAULTS)
def test_a_failed_import_is_reported_in_one_line(own_file, text):
    path = own_file("faulty.py", text)
    with pytest.raises(InputError) as fault:
        python_file.load(path)
    assert str(fault.value).startswith(f"{path.absolute()} must be a file that Python can import; received ")
    assert FAULTS[text] in str(fault.value)
    assert "\n" not in str(fault.value)
    assert "faulty" not in sys.modules
    assert python_file.loaded_files() == ()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("missing.py", r"Python file must exist; received 'missing.py'"),
        ("a.folder.py", r"Python file must be named NAME.py; received 'a.folder.py'"),
        ("folder.py", r"Python file must be a file; received 'folder.py'"),
    ],
)
def test_a_path_without_a_file_is_refused(own_file, name, message):
    own_file("folder.py/inside.txt", "")
    with pytest.raises(InputError, match=message):
        python_file.load(name)


def test_checksums_cover_code_outside_of_this_package(own_file):
    """Covered are functions, nested functions, classes with their bases, and the imports of a file."""
    python_file.load(own_file("a_law.py", LAW))
    problem = python_file.load(own_file("uses_law.py", "from a_law import Pull\ndef of(r): return 1.0\n"))
    one, two = (file.checksum for file in python_file.loaded_files())
    assert python_file.module_checksums(problem.Pull) == {"a_law": one}
    assert python_file.module_checksums(problem.of) == {"uses_law": two, "a_law": one}
    assert python_file.module_checksums(functools.partial(problem.of, 1)) == {"uses_law": two, "a_law": one}
    assert python_file.module_checksums(Force, len, python_file.load) == {}
    assert set(python_file.module_checksums(test_a_path_without_a_file_is_refused)) == {__name__}
