"""Plain-text equations as MathML (docs/equations.py), in blocks and in sentences."""

# ruff: noqa: RUF001

import importlib
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture(scope="module", autouse=True)
def path():
    """Add docs, which is not a package, to the import path."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        yield


def load(name):
    return importlib.import_module(name)


def tex(element):
    """MathML converted to the notation of TeX; Greek letters stay Unicode."""
    parts = [tex(child) for child in element]
    layouts = {
        "mfrac": r"\frac{%s}{%s}", "msqrt": r"\sqrt{%s}", "msub": "%s_{%s}", "msup": "%s^{%s}",
        "msubsup": "%s_{%s}^{%s}", "munder": "%s_{%s}", "mover": r"\overset{%s}{%s}", "mtr": r"%s\\",
    }  # fmt: skip
    if element.get("class") == "text":
        return rf"\text{{{element.text}}}"
    if element.tag in layouts and element.tag not in ("msqrt", "mtr"):
        return layouts[element.tag] % tuple(parts)
    inner = (element.text or "") + "".join(parts)
    return layouts.get(element.tag, "%s") % inner


TYPICAL = {
    "F_i = -4/3 sqrt(R*) E* delta^1.5 n_ij": r"F_{i}=−\frac{4}{3}\sqrt{R^{*}}E^{*}δ^{1.5}n_{ij}",
    "v += dt/2 F/m": r"v+=\frac{dt}{2}\frac{F}{m}",
    "v- = v + dt/2m F_0": r"v^{−}=v+\frac{dt}{2m}F_{0}",
    "2 pi R gamma cos(theta) / (1 + 1.05 s) n": r"\frac{2πRγcos(θ)}{1+1.05s}n",
    "V 3 chi / (3 + chi) B / mu_0": r"\frac{V3χ}{3+χ}\frac{B}{μ_{0}}",
    "a / b / c": r"\frac{\frac{a}{b}}{c}",
    "a / b x c / d + a/b.c": r"\frac{a}{b}×\frac{c}{d}+\frac{a}{b}·c",
    "a/b/c d / e": r"\frac{\frac{\frac{a}{b}}{c}d}{e}",
    "x = G sum_j m_i m_j / d^2 n_ij": r"x=G∑_{j}\frac{m_{i}m_{j}}{d^{2}}n_{ij}",
    "T_i = m_i x B_j": "T_{i}=m_{i}×B_{j}",
    "L(x) = coth x - 1/x": r"L(x)=cothx−\frac{1}{x}",
    "(m_i.n) m_j - 3 ((v_j - v_i) . n)": "(m_{i}·n)m_{j}−3((v_{j}−v_{i})·n)",
    "m_s B/|B|": r"m_{s}\frac{B}{|B|}",
    "|F_t| <= mu |F_n|": "|F_{t}|≤μ|F_{n}|",
    "<R_i R_j> = 2 D_ij dt": "⟨R_{i}R_{j}⟩=2D_{ij}dt",
    "(alpha_1 d^-beta_1) abar": r"(α_{1}d^{−β_{1}})\overset{a}{¯}",
    "(TOL / w_0)^(1/(p K_d))": r"(\frac{\text{TOL}}{w_{0}})^{1/(pK_{d})}",
    "400 < Re <= 3e5": r"400<Re≤3×10^{5}",
    "F_i = -grad_i U,    (m.grad) B": "F_{i}=−∇_{i}U,(m·∇)B",
    "max(1 - |I_n| / (2 a H), 0)": r"max(1−\frac{|I_{n}|}{2aH},0)",
    "c = -2 f ln e / sqrt(ln^2 e + pi^2)": r"c=−\frac{2flne}{\sqrt{ln^{2}e+π^{2}}}",
    "a grain is due at t, a the area": r"\text{a grain is due at}t,a\text{the area}",
    "breaks if F_n / A > sigma_c or J > 0": r"\text{breaks if}\frac{F_{n}}{A}>σ_{c}\text{or}J>0",
    "v'_j = F'/m": r"v_{j}^{′}=\frac{F^{′}}{m}",
    "v = mean_velocity + rate * lambda": r"v=\text{mean_velocity}+\text{rate}·λ",
    "max over steps of |s| / sum_i m_i": r"max\text{over steps of}\frac{|s|}{∑_{i}m_{i}}",
    "sum m c (x) c": "∑mc⊗c",
}


@pytest.mark.parametrize("text", TYPICAL)
def test_typical_equations(text):
    assert tex(ET.fromstring(load("equations").mathml(text))) == TYPICAL[text]


@pytest.mark.parametrize(
    "text",
    [
        "a +", "a / ", "(a", "a)", "|a", "a b^", "a_", "= =", "sqrt a", "a + + b", "2 ** 3", "x: {1}",
        "gt=0", "a*b", "tisim.run(scene)", "found = optimize.run(scene)", 'read("a")', "a / / b", "",
    ],
)  # fmt: skip
def test_anything_else_is_left(text):
    with pytest.raises(load("mathml").Unset):
        load("equations").mathml(text)


def test_cases_are_behind_a_brace():
    html = load("equation_blocks").block(
        "    C = 24 / Re    Re <= 1    which is Stokes's law\n        0.5        1 < Re"
    )
    table = ET.fromstring(html).find("table")
    left, right = (tex(cell) for cell in table.find("tr"))
    assert left == "C"
    assert right == r"={\frac{24}{Re}Re≤1\text{which is Stokes's law}\\0.51<Re\\"
    assert [len(row) for row in table.iter("mtr")] == [3, 2]


def test_relations_of_lines_are_below_each_other():
    html = load("equation_blocks").block(
        "    F = -grad U,    U = m B    a dipole\n      = 2 m\n    sum_i R_i   <=  3\n    breaks if R > 1"
    )
    rows = [[tex(cell) for cell in row] for row in ET.fromstring(html).iter("tr")]
    assert [row[0] for row in rows] == ["F", "", "∑_{i}R_{i}", r"\text{breaks if}R>1"]
    assert [row[1].strip("−")[0] for row in rows[:3]] == ["=", "=", "≤"]
    assert rows[0][2] == r"\text{a dipole}"


def test_the_text_of_an_equation_can_be_read_aloud_and_searched():
    element = ET.fromstring(load("equations").mathml("a <  b"))
    assert element.get("alttext") == "a < b"


def test_no_equation_of_the_reference_stays_plain():
    """The only block that is not converted is code."""
    plain = load("equation_blocks").unset(load("reference_pages").docstrings())
    assert [line.partition(":")[0] for line in plain] == ["tisim.analysis.Mean"]


def test_only_equations_of_the_guides_are_typeset():
    blocks = load("equation_blocks")
    found = []
    for page in sorted(DOCS.rglob("*.md")):
        text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
        for block in re.findall(r"(?:^    .*\n)+", text, re.M):
            if blocks.is_equation(block):
                found.append(page.name)
                blocks.block(block)
    assert found == ["capture.md", "granular.md", "magnetism.md"]


SENTENCES = {
    "A moment of inertia of 2/5 m R^2; its spin": ["2/5 m R^2"],
    "the speed w = q B/m = 100 1/s of a (phi = 0.3)": ["w = q B/m = 100", "phi = 0.3"],
    "e = 0.5, 5 turns, and r' = r + dt (phi v' + (1 - phi) v), solved": [
        "e = 0.5",
        "r' = r + dt (phi v' + (1 - phi) v)",
    ],
    "beyond S dt^2 + 2 gamma dt = 4 m the motion grows": ["S dt^2 + 2 gamma dt = 4 m"],
    "a gap of h_c = 0.3 m from G m_i m_j / d², theta": ["h_c = 0.3", "G m_i m_j / d²", "theta"],
    "a B of 0.6 T at x -> p/x, sqrt(k/m) +- w/2 (4.11) or |F_n + 2 F|": [
        "x -> p/x",
        "sqrt(k/m) +- w/2",
        "|F_n + 2 F|",
    ],
    "1e6 J/m^2 or kg/m^3, not N^2 pairs": ["J/m^2", "kg/m^3", "N^2"],
    "With g = (0, 0, -9.81) m/s^2 and (x, y, z)": ["g = (0, 0, -9.81)", "m/s^2"],
    "m* of L21 and the f32/f64 of Z16 (6.2), 1,000 m/s, 3 .. 3, I/O, x-axis, and/or i.e. a k": ["m*"],
    "2 (phi = 1/2), else 1; 2 s - 2 with s - 1 for each": ["phi = 1/2", "2 s - 2", "s - 1"],
    "it has 1 / (1 - 2 a) times the moment": ["1 / (1 - 2 a)"],
    "L/D 20 and tests/foo.py, alpha_1 d^-beta_1 overlap": ["L/D", "alpha_1 d^-beta_1"],
}


@pytest.mark.parametrize("text", SENTENCES)
def test_formulas_are_found_in_sentences(text):
    found = list(load("inline_equations").spans(text))
    assert [text[start:end] for start, end, _ in found] == SENTENCES[text]
    for _, _, html in found:
        ET.fromstring(f"<span>{html}</span>")


def test_units_stay_upright_with_raised_powers():
    found = load("inline_equations").spans("in J/m^2 and m s^-1")
    assert [span.html for span in found] == ["J/m<sup>2</sup>", "m s<sup>−1</sup>"]


def test_fractions_in_a_sentence_are_on_its_line():
    (span,) = load("inline_equations").spans("tau = m/(6 pi mu R)")
    assert tex(ET.fromstring(span.html)) == "τ=m/(6πμR)"
    assert 'stretchy="false"' in span.html


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("the mass m of a spring T at i, inertia I", ["m", "T", "i", "I"]),
        ("position : m, shape (n, 3), in m, 3 m, N m, (m), m.", ["n"]),
        ("by A. T. Meyer, Phys. Rev. B 4; a m-file", []),
    ],
)
def test_single_letters_that_stand_for_a_quantity(text, found):
    spans = load("inline_equations").letters(text, set("mTiBnI"))
    assert [text[start:end] for start, end, _ in spans] == found


@pytest.mark.parametrize("text", ["dt", "phi", "s.mass[w, i]", "pair_force(i, j) = -pair_force(j, i)", "m/s"])
def test_code_stays_code(text):
    assert load("inline_equations").whole(text) == ""


def test_code_that_is_a_formula_is_set():
    assert tex(ET.fromstring(load("inline_equations").whole("k + 1/2"))) == "k+1/2"


def test_a_page_has_its_formulas_set():
    """In sentences and lists; not in headings, code, links and names of parameters."""
    core = pytest.importorskip("docutils.core", reason="docutils comes with the extra docs")
    nodes = load("equation_nodes")
    doctree = core.publish_doctree(
        "Page\n#####\n\nx = y\n=====\n\nA mass m of 2 rho, ``w + 1/2``, ``rho`` and `F = m <a>`__ "
        "with F = m g.\n\n- phi : the angle phi\n\nx = z\n=====\n\nNothing\n"
    )
    nodes.set_formulas(None, doctree)
    formulas = [one.astext() for one in doctree.findall(nodes.Formula)]
    assert formulas == ["m", "2 rho", "w + 1/2", "F = m g", "phi"]
    assert "phi : the angle phi" in doctree.astext()
