"""``tisim effects``: the index, a single effect, and unknown names."""

import re
import sys
from textwrap import fill

import pytest

from tests.own_files import LAW
from tisim.describe import reference


def test_the_index_has_a_whole_line_for_each(tisim):
    code, out, err = tisim("effects")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    for entry in reference.entries():
        (line,) = [line for line in lines if line.split()[:1] == [entry.name]]
        words = re.split("  +", line)
        assert words == [entry.name, entry.kind.__name__, entry.summary, *filter(None, [entry.source])]
    titles = {family.title for family in reference.FAMILIES.values()}
    assert titles <= set(lines)
    assert len(lines) == len(reference.entries()) + 2 * len(titles) + 1


def test_on_a_terminal_lines_end_between_words(tisim, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    _, out, _ = tisim("effects", "impact")
    listed = out[out.index("Effects\n") :].splitlines()[1:-1]
    assert len(listed) == len(reference.groups()["impact"])
    for line, entry in zip(listed, reference.groups()["impact"], strict=True):
        assert len(line) <= 80
        words = re.split("  +", line, maxsplit=2)[2].removesuffix(" ...").split()
        assert words == f"{entry.summary} {entry.source}".split()[: len(words)]


def test_on_a_terminal_paragraphs_and_equations_fit(tisim, monkeypatch):
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "dumb")
    for name in ("impact", "hertz", "dipole_dipole"):
        _, out, _ = tisim("effects", name)
        before = out[: out.index("\n\nSource: ")]
        assert max(map(len, before.splitlines())) <= 80, name
        _, _, *paragraphs = before.split("\n\n")
        for text in paragraphs:
            if not text.startswith("    "):
                assert " ".join(text.split()) in " ".join(reference.find(name).kind.__doc__.split())
                assert text == fill(text, 80)
        equations = [line for line in before.splitlines() if line.startswith("    ")]
        assert not {"(3.1)", "force", "(4.12)", "E"} & {line.split(maxsplit=1)[0] for line in equations}


@pytest.mark.parametrize("group", ["operators", "sources", "steppers", "step_controls", "pair", "magnetic"])
def test_a_family_or_a_subpackage_is_listed(tisim, group):
    code, out, err = tisim("effects", group)
    assert (code, err) == (0, "")
    members = {
        entry.name
        for entry in reference.entries()
        if entry.family == group
        or entry.kind.__module__.startswith(f"tisim.effects.{group}.")
        or entry.kind.__module__.startswith(f"tisim.sources.{group}.")
    }
    titles = [family.title for family in reference.FAMILIES.values()]
    assert {line.split()[0] for line in out.splitlines() if line and line not in titles} == members
    assert group not in reference.names()


def test_an_entry_prints_its_whole_description(tisim):
    code, out, err = tisim("effects", "impact")
    assert (code, err) == (0, "")
    assert "tisim.effects.impact.impact.Impact" in out
    assert "|I_n| = m_ij v_n^2 / (2 beta min(b_i, b_j))" in out
    assert "Z04: T. I. Zohdi, A computational framework" in out
    assert "Vickers hardness H_0" in out
    assert "particle fields: velocity (m/s), mass (kg), radius (m)" in out
    assert reference.find("impact").toml in out
    assert "\nsoftening " in out, "those of the subpackage of this name"
    assert "needs: impact" in tisim("effects", "friction")[1]


def test_plugin_effects_are_listed_in_their_family(tisim, own_file):
    own_file("own_laws.py", LAW)
    code, out, err = tisim("effects", "effects", "--plugin", "own_laws.py")
    assert (code, err) == (0, "")
    assert [line for line in out.splitlines() if line.startswith("pull ")]
    assert "own_laws.Pull" in tisim("effects", "pull", "--plugin", "own_laws.py")[1]


def test_an_unknown_name_is_wrong_input(tisim):
    code, out, err = tisim("effects", "impcat")
    assert (code, out) == (2, "")
    assert err.startswith("part must be one of ")
    assert " that 'tisim effects' lists, such as impact, " in err
    assert err.endswith("; received 'impcat'; did you mean 'impact'?\n")
    assert tisim("effects", "operatrs")[2].endswith("; received 'operatrs'; did you mean 'operators'?\n")
