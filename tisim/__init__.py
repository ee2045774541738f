"""tisim: clouds of interacting particles, simulated in batches of worlds.

Names are imported at first use, so that ``import tisim`` is fast; __init__.pyi lists them.
"""

from pathlib import Path

import lazy_loader

from tisim.version import __version__ as __version__

if not (Path(__file__).parent / "optimize").is_dir():
    # In a checkout, tisim.optimize and tisim.cases are beside this folder; in an installation, inside it.
    __path__.append(str(Path(__file__).parents[1]))

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
