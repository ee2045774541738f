"""For Sphinx: equations in pages become nodes with MathML.

Blocks of equations are found by equation_blocks.py, formulas in sentences by inline_equations.py.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from docutils import nodes
from equation_blocks import block, is_equation
from inline_equations import Span, letters, spans, whole
from mathml import Unset


class Equations(nodes.literal_block):
    """A block of equations: MathML in HTML pages, and plain text elsewhere and in the search index."""


class Formula(nodes.inline):
    """A formula in a sentence, in the same way."""


NO_PROSE = (
    nodes.literal,
    nodes.FixedTextElement,
    nodes.title,
    nodes.reference,
    nodes.raw,
    nodes.term,
    Formula,
)
SIGNATURES = ("desc_", "pending_xref", "download_reference")
"""Nodes of Sphinx whose text is of a program."""
SYMBOL = re.compile(r"(?<![A-Za-z])[A-Za-z](?![A-Za-z])")
NAMES = re.compile(r"[\w, ]+ : ")
"""Names that an item of a list describes."""


def set_blocks(_app: Any, doctree: nodes.document) -> None:
    """For Sphinx: set the blocks of a page that are equations.

    They have no language in guides. In docstrings all blocks are "text"; those that are no equations stay so.
    """
    for node in list(doctree.findall(nodes.literal_block)):
        text, language = node.astext(), node.get("language")
        if language == "text" or (language == "none" and is_equation(text)):
            try:
                node.replace_self(Equations(text, text, html=block(text), language="text"))
            except Unset:
                node["classes"].append("unset")


def set_formulas(_app: Any, doctree: nodes.document) -> None:
    """For Sphinx: set the formulas in the sentences of a page, and the code that is a formula.

    Single letters are set too, if an equation in the same section has them.
    """
    for literal in list(doctree.findall(nodes.literal)):
        if html := whole(literal.astext()):
            literal.replace_self(Formula(literal.astext(), literal.astext(), html=html))
    _divide(doctree, lambda _node, text: spans(text))
    symbols = defaultdict(set)
    for node in (*doctree.findall(Formula), *doctree.findall(Equations)):
        symbols[id(_section(node))] |= set(SYMBOL.findall(node.astext()))
    _divide(doctree, lambda node, text: letters(text, symbols[id(_section(node))]))


def _divide(doctree: nodes.document, find: Callable[[nodes.Text, str], Iterable[Span]]) -> None:
    """Divide the texts of sentences at what is found in them."""
    for text in list(doctree.findall(nodes.Text)):
        if _is_prose(text):
            parts = list(_parts(text, find))
            if any(isinstance(part, Formula) for part in parts):
                text.parent.replace(text, parts)


def _section(node: nodes.Node) -> nodes.Node:
    """Return the section, or the description of a name of a program, in which a node stands."""
    while node.parent is not None and not isinstance(node, nodes.section) and node.tagname != "desc_content":
        node = node.parent
    return node


def _is_prose(text: nodes.Text) -> bool:
    """Return whether a text stands in sentences."""
    node = text.parent
    while node is not None and node.tagname != "desc_content":
        # The sentences about a name of a program stand in desc_content.
        if isinstance(node, NO_PROSE) or node.tagname.startswith(SIGNATURES):
            return False
        node = node.parent
    return True


def _parts(node: nodes.Text, find: Callable[[nodes.Text, str], Iterable[Span]]) -> Iterator[nodes.Node]:
    """A text, divided at what is found in it, but not in the names at its beginning that it describes."""
    text = node.astext()
    names = NAMES.match(text) if node.parent.index(node) == 0 else None
    begin = names.end() if names else 0
    at = 0
    for start, end, html in find(node, text[begin:]):
        if begin + start > at:
            yield nodes.Text(text[at : begin + start])
        at = begin + end
        formula = text[begin + start : at]
        yield Formula(formula, formula, html=html)
    if at < len(text):
        yield nodes.Text(text[at:])


def visit(translator: Any, node: Equations | Formula) -> None:
    """Write the MathML of equations in place of their text."""
    translator.body.append(node["html"])
    raise nodes.SkipNode
