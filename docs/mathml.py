"""Elements of MathML, and the names and signs of plain-text equations that become them."""

from __future__ import annotations

import re
from html import escape
from itertools import pairwise
from typing import NamedTuple

GREEK = dict(
    zip(
        ("alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "iota", "kappa", "lambda",
         "mu", "nu", "xi", "omicron", "pi", "rho", "final", "sigma", "tau", "upsilon", "phi", "chi", "psi",
         "omega"),
        map(chr, range(0x3B1, 0x3CA)),
        strict=True,
    )
)  # fmt: skip
GREEK["eps"] = GREEK["epsilon"]
del GREEK["final"]
GREEK |= {name.capitalize(): sign.upper() for name, sign in GREEK.items()}
FUNCTIONS = {
    "exp", "sin", "cos", "tan", "arccos", "arcsin", "arctan", "coth", "tanh", "ln", "log", "min", "max", "tr",
}  # fmt: skip
LARGE = {"sum": "∑", "integral": "∫"}
SIGNS = {
    "<=": "≤", ">=": "≥", "~": "\N{TILDE OPERATOR}", "->": "→", "-": "\N{MINUS SIGN}", "'": "\N{PRIME}",
    "+-": "±", "-+": "∓", "x": "\N{MULTIPLICATION SIGN}", ".": "·", "*": "·", "(x)": "⊗",
}  # fmt: skip
POWERS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹", "0123456789")
DIFFERENTIAL = '<mrow><mi mathvariant="normal">d'
"""The beginning of a differential."""
CLOSING = {"(": ")", "[": "]", "|": "|", "<": ">"}
JOINING = {
    "a", "and", "as", "at", "below", "by", "each", "if", "in", "is", "of", "on", "or", "over", "than", "that",
    "the", "to", "under", "up", "when", "while", "within",
}  # fmt: skip
"""Words of sentences, which no quantity is called: a fraction does not reach across them."""
TOKEN = re.compile(
    r"(?P<power>[⁰¹²³⁴⁵⁶⁷⁸⁹]+)|(?P<number>\d+(?:\.\d+)?(?:e[+-]?\d+)?)|(?P<name>[A-Za-z]+(?:'s\b)?)"
    r"|(?P<relation><=|>=|\+=|->|[=<>~:])|(?P<sign>\+-(?=\s)|-\+(?=\s)|[()\[\]|+\-*/.,;^_'])"
)


class Unset(ValueError):
    """The text is not in the notation of equations."""


class Token(NamedTuple):
    """A sign, number or word. before, after : whether a space is there."""

    kind: str
    text: str
    before: bool = True
    after: bool = True


class Part(NamedTuple):
    """A factor. role : "factor", "function", "fraction", "large", "operator", "text" or "joining" (JOINING).
    inner : MathML without the brackets around it."""

    mathml: str
    role: str = "factor"
    inner: str = ""


def tokens(text: str) -> list[Token]:
    """Return the signs, numbers, symbols and runs of words of an equation, and two ends."""
    found: list[Token] = []
    at = 0
    while at < len(text):
        if text[at].isspace():
            at += 1
            continue
        match = TOKEN.match(text, at)
        if not match:
            raise Unset(f"{text[at]} in {text}")
        kind, end = str(match.lastgroup), match.end()
        before, after = not text[at - 1 : at].strip() or at == 0, not text[end : end + 1].strip()
        if kind == "power":
            found.append(Token("sign", "^", before, False))
            found.append(Token("number", match[0].translate(POWERS), False, after))
            at = end
            continue
        if match[0] == "=" and not (before and after):
            raise Unset(f"= without spaces in {text}")
        is_run = bool(found) and found[-1].kind == "word" and before
        is_script = bool(found) and found[-1].text in ("_", "^")
        if (
            kind == "name"
            and not is_script
            and (is_word(match[0]) or _is_article(text[at:], not found or is_run))
        ):
            end = re.compile(r"(?:_\w+)*").match(text, end).end()
            kind, after = "word", not text[end : end + 1].strip()
        if kind == "word" and is_run:
            start = found.pop()
            found.append(Token(kind, f"{start.text} {text[at:end]}", start.before, after))
        else:
            found.append(Token(kind, text[at:end], before, after))
        at = end
    return [*found, Token("end", ""), Token("end", "")]


def is_word(name: str) -> bool:
    """Return whether a name is a word, and neither a symbol nor a function."""
    known = {*GREEK, *FUNCTIONS, *LARGE, "Re", "kT", "abar", "grad", "sqrt"}
    return len(name) > 1 and name not in known and not is_differential(name)


def _is_article(text: str, is_sentence: bool) -> bool:
    """Return whether a text begins with the word a, and not with a symbol."""
    match = re.match(r"a ([A-Za-z]+)", text)
    return is_sentence and bool(match) and is_word(match[1]) and match[1] not in JOINING


def is_differential(name: str) -> bool:
    """Return whether a name is d and a letter, such as dt."""
    return name[0] == "d" and name != "do" and (len(name) == 2 or name[1:] in GREEK)


def tag(name: str, *children: str, **attributes: str) -> str:
    """Return an element; an ``mrow`` of one child is that child."""
    if name == "mrow" and len(children) == 1:
        return children[0]
    given = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<{name}{given}>{''.join(children)}</{name}>"


def operator(text: str, **attributes: str) -> str:
    """Return an operator by its sign in plain text."""
    return tag("mo", escape(SIGNS.get(text, text)), **attributes)


def words(text: str) -> str:
    """Return text. A space is left between ``mi`` and an operator, which ``mtext`` has none of."""
    return tag("mi", text, **{"class": "text", "mathvariant": "normal"})


def space(width: float) -> str:
    """Return a gap, in em."""
    return f'<mspace width="{width}em"></mspace>'


def symbol(name: str) -> str:
    """Return a symbol: letters are slanted; d of differentials and abbreviations are upright."""
    if name == "kT":
        return tag("mrow", tag("mi", "k"), tag("mi", "T"))
    if name == "abar":
        return tag("mover", tag("mi", "a"), operator("¯"))
    if is_differential(name):
        return tag("mrow", tag("mi", "d", mathvariant="normal"), symbol(name[1:]))
    return tag("mi", {"grad": "∇", **GREEK}.get(name, name))


def script(text: str) -> str:
    """Return an index or exponent: a symbol, or a word as text."""
    return symbol(text) if len(text) == 1 or text in GREEK else words(text)


def number(text: str) -> str:
    """Return a number; 3e5 as three times a power of ten."""
    mantissa, _, power = text.partition("e")
    if not power:
        return tag("mn", mantissa)
    sign = [operator("-", form="prefix")] if power[0] == "-" else []
    ten = tag("msup", tag("mn", "10"), tag("mrow", *sign, tag("mn", power.lstrip("+-"))))
    return tag("mrow", tag("mn", mantissa), operator("x"), ten)


def joined(parts: list[Part]) -> str:
    """Return factors side by side, with space around text and before functions, numbers, differentials."""
    found = [parts[0].mathml]
    for before, after in pairwise(parts):
        if "operator" not in (before.role, after.role):
            if {before.role, after.role} & {"text", "joining"}:
                found.append(space(0.35))
            elif after.role == "function" or after.mathml.startswith(("<mn>", "<mfrac><mn>", DIFFERENTIAL)):
                found.append(space(0.17))
        found.append(after.mathml)
    return tag("mrow", *found)


def fraction(over: list[Part], under: Part, is_flat: bool) -> Part:
    """Return a fraction; a flat one is written in one line."""
    if is_flat:
        slash = operator("/", lspace="0", rspace="0")
        return Part(tag("mrow", joined(over), slash, under.mathml), "fraction")
    above = over[0].inner if len(over) == 1 and over[0].inner else joined(over)
    return Part(tag("mfrac", above, under.inner or under.mathml), "fraction")


def fenced(opening: str, inner: str, is_flat: bool) -> Part:
    """Return a bracket, a flat one as high as a letter; a fraction leaves round and square ones out."""
    left, right = ("⟨", "⟩") if opening == "<" else (opening, CLOSING[opening])
    height = {"stretchy": "false"} if is_flat else {}
    pairs = ((left, "prefix"), (right, "postfix"))
    fences = [operator(sign, form=form, fence="true", **height) for sign, form in pairs]
    return Part(tag("mrow", fences[0], inner, fences[1]), inner=inner if opening in ("(", "[") else "")


def scripted(base: str, under: list[str], above: list[str], is_large: bool) -> str:
    """Return a symbol with what is written below and above it on its right; of a sum, on its middle."""
    scripts = [tag("mrow", *one) for one in (under, above) if one]
    places = ("under", "over") if is_large else ("sub", "sup")
    kind = "m" + "".join(place for place, one in zip(places, (under, above), strict=True) if one)
    return tag(kind, base, *scripts) if scripts else base
