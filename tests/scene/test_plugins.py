"""User-defined effects, from a file or an installed package, are found by name and included in the digest."""

import pytest

from tests.own_files import LAW
from tests.scenes import scene
from tisim import InputError, Scene
from tisim.io.run_folder import versions
from tisim.scene import plugins

ONE = ([[0, 0, 0]], [[0, 0, 0]])


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs a module as a package with an entry point."""

    def install(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        about = tmp_path / f"{name}-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (about / "entry_points.txt").write_text(f"[tisim.effects]\nlaws = {name}\n")
        monkeypatch.syspath_prepend(str(tmp_path))

    plugins._load_installed.cache_clear()
    yield install
    plugins._load_installed.cache_clear()


def data(strength=2.0):
    """A scene of one grain with the effect of LAW, as in a file."""
    return {**scene(*ONE).to_dict(), "effects": {"pull": {"strength": strength}}}


def test_an_effect_of_a_file_is_found_by_its_name(own_file):
    with pytest.raises(
        InputError,
        match=r"effects.pull.kind must be one of .*, such as .*; received 'pull'",
    ):
        Scene.from_dict(data())
    law = plugins.load(own_file("own_laws.py", LAW))
    setup = Scene.from_dict(data())
    assert setup.effects == (law.Pull(strength=2.0),)
    assert Scene.from_dict(setup.to_dict()).digest() == setup.digest()
    with pytest.raises(InputError, match=r"pull.strength must be a number; received 'x'"):
        Scene.from_dict(data("x"))


def test_a_misspelt_name_is_reported_with_similar_ones():
    misspelt = {**scene(*ONE).to_dict(), "effects": {"gravty": {}}}
    rule = r"effects.gravty.kind must be one of \d+ that 'tisim effects' lists, such as gravity, "
    with pytest.raises(InputError, match=rule + r".*; received 'gravty'"):
        Scene.from_dict(misspelt)


def test_the_digest_and_versions_name_the_file_of_an_effect(own_file):
    plain = scene(*ONE).digest()
    plugins.load(own_file("own_laws.py", LAW))
    first, before = Scene.from_dict(data()).digest(), versions()
    assert len(before["plugin own_laws"]) == 12
    plugins.load(own_file("own_laws.py", LAW.replace("-self", "-2.0 * self")))
    assert Scene.from_dict(data()).digest() != first
    assert versions()["plugin own_laws"] != before["plugin own_laws"]
    assert scene(*ONE).digest() == plain, "a plugin changes no scene that does not use it"


@pytest.mark.parametrize(
    ("name", "other"),
    [("Gravity", r"tisim\.effects\.external\.gravity\.Gravity"), ("Pull", r"own_laws\.Pull")],
)
def test_a_file_with_a_name_in_use_is_refused_completely(own_file, name, other):
    plugins.load(own_file("own_laws.py", LAW))
    path = own_file("more_laws.py", LAW.replace("Pull", name))
    message = (
        rf"^name of more_laws.{name} must be one that no other .*; received {name.lower()}, as {other} has"
    )
    with pytest.raises(InputError, match=message):
        plugins.load(path)
    assert type(Scene.from_dict(data()).effects[0]).__module__ == "own_laws"
    assert "plugin more_laws" not in versions()


def test_an_installed_package_offers_its_effects(installed):
    installed("laws_of_a_package", LAW.replace("Pull", "Tug"))
    setup = Scene.from_dict({**data(), "effects": {"tug": {"strength": 1.0}}})
    assert type(setup.effects[0]).__module__ == "laws_of_a_package"
    assert len(versions()["plugin laws_of_a_package"]) == 12
    assert "laws_of_a_package" in plugins.python_file.module_checksums(type(setup.effects[0]))


def test_an_installed_package_that_is_broken_is_reported_in_a_line(installed):
    installed("broken_laws", "import no_such_module\n")
    message = r"^plugin laws of broken_laws must be importable; received ModuleNotFoundError: No module named"
    with pytest.raises(InputError, match=message):
        Scene.from_dict(data())
