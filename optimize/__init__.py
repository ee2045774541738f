"""tisim.optimize: inverse design, the search for a scene whose result meets given objectives.

Start a search with ``optimize.run(problem)``. Names are loaded on first use; __init__.pyi lists them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
