"""tisim.optimize: inverse design, a search for the scene whose result is wanted.

Names are loaded when they are first asked for; __init__.pyi lists them. ``optimize.run(problem)`` searches.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
