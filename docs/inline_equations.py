"""Formulas in sentences, from docstrings and guides, become mathematics in the pages.

    python docs/inline_equations.py FILE...    prints the formulas that it finds in pages

A formula is a run of symbols, numbers and signs in the notation of equations.py, between words. It must hold
something that prose does not: a relation, an index or power, a function, a quotient or sum of symbols, or a
Greek letter by its name. Units are no formulas: only their powers are raised, as in kg/m^3.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from html import escape
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from equations import inline
from mathml import FUNCTIONS, GREEK, LARGE, TOKEN, Unset, is_word

UNIT = r"(?:[kMGmunp]?(?:m|s|J|N|A|T|C|Pa|W|V|Hz)|kg|g|K|rad|mol|sr|H|F)"
POWERS = r"(?:\^-?\d|[²³⁴])?"
COMPOUND = rf"(?:1/)?{UNIT}{POWERS}(?:[ /]{UNIT}{POWERS})*"
UNITS = re.compile(rf"(?<![\w^*'.)]){COMPOUND}(?![\w^(*'])")
QUANTITIES = re.compile(rf"(?<![\w^*'.)])(?:[\d.e+-]+ )*{COMPOUND}(?![\w^(*'])")
"""Units with or without numbers before them."""
LAST_UNIT = re.compile(rf"(?<=[\d)]) {COMPOUND}$|\s\({COMPOUND}\)$|\s\([\d.]+\)$")
"""After a formula: its unit, also in brackets, or its number in a publication."""
LAST_NUMBER = re.compile(r"(?<=[\w*']) [\d.]+(?:e[+-]?\d+)?$")
NUMBER_BEFORE = re.compile(r"[\d.]+ (?=\([^()]* [=<>] [^()]*\)$)")
"""A number that a bracket explains, as in: order 2 (phi = 1/2)."""
LABEL = re.compile(r"\W*(?:[A-Za-z]{1,2}\d{2,}(?:'s)?\W*)+$|\W*I/O\W*$|.*\d,\d")
"""Names of publications and number formats, such as L21 and f32, and numbers such as 1,000."""
RELATION = re.compile(r"\S\s+(?:[=<>~]|<=|>=|->)\s+\S")
QUOTIENT = re.compile(r"[A-Za-z)*'²³]\s?/\s?\(?[A-Za-z]|\d\s?/\s?[a-z(]")
EQUATION = re.compile(r" [+-] [^=<>]* [=<>] [\d.]+ \w$")
"""A sum of several quantities, equal to a number of another: 4 m in it is a product, and no length."""
SUM = re.compile(r"[A-Za-z]['*]?(?:_\w+)? [+-] [\w(]|[\w)] [+-] [A-Za-z(]")
LETTER = re.compile(
    rf"(?<![\w(.,*'^/\\\"-])[B-Zb-z](?![\w*'^/\"=-]|\.\s+\S|[ /]{UNIT}(?!\w))|(?<=\()[B-Zb-z](?=[ ,])"
)
UNIT_BEFORE = re.compile(rf"(?:\d|\b(?:in|per)|(?<!\w){UNIT}),? $")
ALONE = re.compile(r"(?:^|[,;:(|]) ?$"), re.compile(r"[,;.)|]|$")
"""What stands before and after a letter that may be a unit."""
JOURNAL = re.compile(r"\. $"), re.compile(r" \d")
MIRRORED = str.maketrans("()[]", ")(][")
CROSS = re.compile(r"[A-Za-z](?:_\w+)? x [A-Za-z]")


class Span(NamedTuple):
    """A part of a text, and its HTML."""

    start: int
    end: int
    html: str


def spans(text: str) -> Iterator[Span]:
    """Yield the formulas and the units with powers of a text."""
    found = [span for start, end in _runs(text) for span in _formulas(text, start, end)]
    for match in UNITS.finditer(text):
        is_free = not any(one.start < match.end() and match.start() < one.end for one in found)
        if "^" in match[0] and "N^" not in match[0] and is_free:
            raised = re.sub(r"\^(-?\d)", r"<sup>\1</sup>", match[0]).replace("-", "\N{MINUS SIGN}")
            found.append(Span(match.start(), match.end(), raised))
    yield from sorted(found)


def letters(text: str, symbols: set[str]) -> Iterator[Span]:
    """Yield the single letters of a text that are among some symbols, and no units, articles or initials."""
    for match in LETTER.finditer(text):
        start, end = match.span()
        before, after = text[:start], text[end:]
        is_unit = re.fullmatch(UNIT, match[0]) and ALONE[0].search(before) and ALONE[1].match(after)
        is_journal = JOURNAL[0].search(before) and JOURNAL[1].match(after)
        if match[0] in symbols and not (is_unit or is_journal or UNIT_BEFORE.search(before)):
            yield Span(start, end, inline(match[0]))


def whole(text: str) -> str:
    """Return the HTML of a text that is a formula as a whole, and more than a name; "" for any other text."""
    found = list(spans(text))
    is_formula = len(found) == 1 and (0, len(text)) == found[0][:2] and "<math" in found[0].html
    return found[0].html if is_formula and re.search(r"[\s^]", text) else ""


def _runs(text: str) -> Iterator[tuple[int, int]]:
    """Start and end of each run of chunks that words do not interrupt."""
    chunks = re.finditer(r"\S+", text)
    for is_symbols, group in groupby(chunks, key=lambda chunk: _is_symbols(chunk[0])):
        if is_symbols:
            run = list(group)
            yield run[0].start(), run[-1].end()


def _is_symbols(chunk: str) -> bool:
    """Return whether a chunk between spaces has no word and no sign that mathematics has not."""
    at, before = 0, ""
    while at < len(chunk) and not LABEL.match(chunk):
        match = TOKEN.match(chunk, at)
        if not match or (match[0] == ":" and match.end() < len(chunk)):
            return False
        if match.lastgroup == "name" and is_word(match[0]) and before not in ("_", "^"):
            return False
        at, before = match.end(), match[0]
    return at == len(chunk)


def _formulas(text: str, start: int, end: int) -> Iterator[Span]:
    """The formulas of a run, which punctuation outside brackets divides."""
    closed, first = 0, start
    for at in range(start, end + 1):
        stops = text[at : at + 1] in (",", ";", ":", ".") and text[at + 1 : at + 2].strip() == ""
        if at == end or (stops and at >= closed):
            yield from _formula(text, *_trimmed(text, first, at))
            first = at + 1
        elif text[at] in "([":
            closed = max(closed, at + _closing(text[at:end]))


def _trimmed(text: str, start: int, end: int) -> tuple[int, int]:
    """Start and end without what belongs to the sentence: articles, lone signs, brackets and units."""
    while True:
        piece = text[start:end]
        if match := re.match(r"\s+|(?:[aAI]|[+*/x.=<>~-]|[<>]=|->)\s+(?![=<>~+/^-])|[+*/.)\]=]", piece):
            start += match.end()
        elif match := re.search(r"(?:\s|^)(?:[aAI](?=$)|[+*/x.=<>~(|-]|[<>]=|->)$|[(\[]$|\s+$", piece):
            is_symbol = match[0].strip() in ("a", "A", "I") and re.search(r"[=<>~+-]\s+\w$", piece)
            if is_symbol:
                return start, end
            end -= len(match[0])
        elif match := NUMBER_BEFORE.match(piece):
            start += match.end()
        elif match := _addition(piece):
            end -= len(match[0])
        elif piece[:1] in ("(", "[") and _closing(piece) in (0, len(piece) - 1):
            start += 1
        elif piece[-1:] in (")", "]") and not _closing(piece[::-1].translate(MIRRORED)):
            end -= 1
        else:
            return start, end


def _addition(piece: str) -> re.Match[str] | None:
    """Return the unit or number at the end of a piece that is no factor in it."""
    unit = None if EQUATION.search(piece) else LAST_UNIT.search(piece)
    return unit or (None if RELATION.search(piece) else LAST_NUMBER.search(piece))


def _closing(piece: str) -> int:
    """Return the place of the bracket that closes the one at the start of a piece; 0 if there is none."""
    depth = 0
    for at, sign in enumerate(piece):
        depth += (sign in "([") - (sign in ")]")
        if depth == 0:
            return at
    return 0


def _formula(text: str, start: int, end: int) -> Iterator[Span]:
    piece = text[start:end]
    if not _is_formula(piece) or re.fullmatch(r"\s:.*", text[end:], re.S):
        return
    try:
        yield Span(start, end, inline(piece))
    except Unset:
        return


def _is_formula(piece: str) -> bool:
    """Return whether a piece holds something that prose does not."""
    names = re.findall(r"(?<![A-Za-z])[A-Za-z]+", piece)
    if names and (RELATION.search(piece) or SUM.search(piece)):
        return True
    if not re.search(r"[A-Za-z^]", QUANTITIES.sub("", piece)) and "N^" not in piece:
        return False
    if any(name in GREEK or name == "grad" for name in names):
        return True
    if any(f"{name}(" in piece for name in names if name in {*FUNCTIONS, "sqrt", *LARGE}):
        return True
    if re.search(r"[\w)*]\^|[A-Za-z]_\w|\b[A-Za-z]\*(?!\w)", piece):
        return True
    return bool(names) and any(sign.search(piece) for sign in (QUOTIENT, CROSS))


if __name__ == "__main__":
    for page in map(Path, sys.argv[1:]):
        prose = re.compile(r"^```.*?^```|^    .*?$|`[^`]*`", re.M | re.S)
        text = prose.sub("`", page.read_text(encoding="utf-8"))
        for span in spans(text):
            print(page.name, escape(" ".join(text[span.start : span.end].split()), quote=False), sep=": ")
