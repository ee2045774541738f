"""Summary, body and source of a part, read from its docstring.

A docstring has a first sentence that says what the part is, then its equations, indented, and its
assumptions. The last paragraph names the source.
"""

from __future__ import annotations

import inspect
import re

PUBLICATIONS = {
    "Z04": "T. I. Zohdi, A computational framework for agglomeration in thermochemically reacting granular "
    "flows, Proc. R. Soc. Lond. A 460 (2004) 3421-3445, doi 10.1098/rspa.2004.1277",
    "Z13": "T. I. Zohdi, Electromagnetically-induced vibration in particulate-functionalized materials, "
    "J. Vib. Acoust. (2013), doi 10.1115/1.4023251",
    "Z16": "T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72",
    "B16": "R. J. Baars, Random porous media and magnetic separation of magnetic colloids, thesis, Utrecht "
    "University (2016)",
    "L21": "T. Leps, Simulation of magnetic granular media using open source soft sphere DEM, thesis, "
    "University of Maryland (2021)",
}
"""Works that docstrings cite in short form."""


def summary(kind: type) -> str:
    """Return the first sentence of the docstring, without its source."""
    first = " ".join(own_docstring(kind)[0].split("\n\n")[0].split())
    return re.split(r"\s*\((?=[A-Z]\d\d)|\.\s|\.$", first)[0]


def body(kind: type) -> str:
    """Return the docstring without its first sentence and its source."""
    first, *rest = own_docstring(kind)[0].split("\n\n")
    opening = " ".join(first.split())[len(summary(kind)) :].lstrip(". ")
    return "\n\n".join(part for part in (opening, *rest) if part)


def source(kind: type) -> str:
    """Return the source named in the docstring; otherwise the first work that its module cites in
    brackets."""
    if found := own_docstring(kind)[1]:
        return found
    module = " ".join((getattr(inspect.getmodule(kind), "__doc__", None) or "").split())
    cited = re.search(r"\(([A-Z]\d\d[^()]*(?:\([^)]*\)[^()]*)*)\)", module)
    return cited.group(1) if cited else ""


def own_docstring(kind: type) -> tuple[str, str]:
    """Return the docstring of a class itself: the text before its source, and the source."""
    text, _, named = inspect.cleandoc(kind.__doc__ or "").partition("Source: ")
    return text.strip(), " ".join(named.split()).removesuffix(".")
