"""Settings of the reference: ``sphinx-build -W --keep-going -n docs docs/_build``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import equation_nodes
import pair_plots
import recorded_nodes
import reference_pages

from tisim.version import __version__

project, author, copyright, release = "tisim", "the tisim authors", "the tisim authors", __version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = f"tisim {release}"
html_static_path = ["_static"]
html_css_files = ["equations.css", "coverage.css", "recordings.css"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
HIDDEN = (
    "model_config",
    "contract",
    "structure",
    "requires",
    "accuracy_parameters",
    "sweep_parameters",
    "incompatible_controls",
)
autodoc_default_options = {"exclude-members": ", ".join(HIDDEN)}
smartquotes = False
python_use_unqualified_type_names = True
# What other projects document, and what stands behind public names.
OTHERS = (
    "numpy",
    "np",
    "scipy",
    "pathlib",
    "collections",
    "typing",
    "matplotlib",
    "rich",
    "RenderableType",
    "DataFrame",
)
# Names that are imported for type checkers alone stand without their modules.
TYPES = (
    *("Bound", "Buffer", "Domain", "Item", "Materials", "NeighbourLists", "Peers", "State", "SumForces"),
    "Touching",
)
INNER = "|".join(
    (
        r"tisim\.(io\.(recording|trajectory)|packing\.(clump|region|tried_places)|engine\.particle_state|backend\.runtime)\.\w+",
        r"tisim\.(materials\.materials|components\.component|steppers\.context|state\.(bound|state)|program\.phases|pairs\.(lists|half_list)|engine\.assembly|forces\.force_sum|effects\.contact\.(granular\.parts|overlapping_pairs))\.\w+",
        r"tisim\.(effects\.base\.effect\.SceneParts|sources\.magnetic\.mutual_magnetisation\.Magnetised)",
        r"tisim\.sources\.pore_flow\.(solids|pore_flow)\.\w+",
        r"tisim\.notebook\.\w+",
        r"tisim\.(io\.reader\.RecordedWorld|report\.spectrum\.Spectrum)",
        r"(tisim\.)?optimize\.(report\.search_page|methods\.\w+|problem\.(function|constraint|statistic)|storage\.cache|analysis\.\w+)\.\w+",
    )
)
nitpick_ignore_regex = [("py:.*", INNER), *(("py:.*", rf"{package}(\..*)?") for package in (*OTHERS, *TYPES))]


def write_pages(app):
    """Write the plots, and the pages that come from the code."""
    pair_plots.write()
    reference_pages.write(Path(app.srcdir) / "reference")


def setup(app):
    """Write the pages that come from the code, read its docstrings as the plain text that they are, set
    equations, and let recordings play."""
    app.connect("builder-inited", write_pages)
    app.connect("autodoc-process-docstring", reference_pages.as_rst)
    app.connect("autodoc-process-signature", reference_pages.signature)
    app.connect("doctree-read", equation_nodes.set_blocks)
    app.connect("doctree-read", equation_nodes.set_formulas)
    for node in (equation_nodes.Equations, equation_nodes.Formula):
        app.add_node(node, html=(equation_nodes.visit, None))
    recorded_nodes.setup(app)
