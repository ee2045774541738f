"""``tisim effects``: the index, one of them, and what is none of them."""

from tisim.engine import reference


def test_the_index_has_a_line_for_each(tisim):
    code, out, err = tisim("effects")
    assert (code, err) == (0, "")
    lines = [line.split()[:2] for line in out.splitlines()]
    for entry in reference.entries():
        assert [entry.name, entry.kind.__name__] in lines, entry.name
    titles = {family.title for family in reference.FAMILIES.values()}
    assert titles <= set(out.splitlines())


def test_one_of_them_says_all_that_is_known_of_it(tisim):
    code, out, err = tisim("effects", "impact")
    assert (code, err) == (0, "")
    assert "tisim.effects.impact.impact.Impact" in out
    assert "|I_n| = m_ij v_n^2 / (2 beta min(b_i, b_j))" in out
    assert "Z04: T. I. Zohdi, A computational framework" in out
    assert "Vickers hardness H_0" in out
    assert "particle fields: velocity (m/s), mass (kg), radius (m)" in out
    assert reference.find("impact").toml in out
    assert "needs: impact" in tisim("effects", "friction")[1]


def test_an_unknown_one_is_wrong_input(tisim):
    code, out, err = tisim("effects", "impcat")
    assert (code, out) == (2, "")
    assert err.startswith("effect must be one of agglomeration, ")
    assert err.endswith("; received 'impcat'\n")
