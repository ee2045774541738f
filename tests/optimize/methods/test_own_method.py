"""A user-defined search method in a Python file."""

import pytest

from tests.optimize.fake_runs import fake_problem
from tests.own_files import METHOD
from tisim import InputError
from tisim.optimize.methods.base import every, find
from tisim.optimize.settings import Settings, identity
from tisim.scene import plugins


def test_a_user_method_is_found_by_name_and_its_code_counts(own_file):
    plugins.load(own_file("my_steps.py", METHOD))
    kind = find("steps")
    settings = Settings(method="steps", options={"width": 0.2})
    assert settings.options.width == 0.2
    before = identity(fake_problem(), settings, {})
    plugins.load(
        own_file("my_steps.py", METHOD.replace("np.full(len(genome), 0.5)", "np.zeros(len(genome))"))
    )
    assert find("steps") is not kind
    assert before != identity(fake_problem(), Settings(method="steps", options={"width": 0.2}), {})
    assert "method_code" not in identity(fake_problem(), Settings(method="zohdi"), {})


def test_a_user_method_disappears_with_its_file():
    assert "steps" not in every()
    with pytest.raises(InputError, match=r"method must be one of .*, or your own \(--plugin, import\)"):
        find("steps")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"steps"', '"random"', "name of my_steps.Steps must be one that no other search method has"),
        ('    name = "steps"\n', "", "name of my_steps.Steps must be a text; received None"),
        ("    Options = Options\n", "", "Options of my_steps.Steps must be a class made of"),
    ],
)
def test_an_unusable_user_method_is_refused(own_file, old, new, message):
    plugins.load(own_file("my_steps.py", METHOD.replace(old, new)))
    with pytest.raises(InputError, match=message):
        find("zohdi")
