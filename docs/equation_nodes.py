"""For Sphinx: blocks of equations in pages become nodes with MathML (equation_blocks.py)."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from equation_blocks import block, is_equation
from mathml import Unset


class Equations(nodes.literal_block):
    """A block of equations: MathML in HTML pages, and plain text elsewhere and in the search index."""


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


def visit(translator: Any, node: Equations) -> None:
    """Write the MathML of a block in place of its text."""
    translator.body.append(node["html"])
    raise nodes.SkipNode
