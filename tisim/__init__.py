"""tisim: clouds of interacting particles, simulated in batches of worlds.

Names are loaded when they are first asked for, so that ``import tisim`` is quick; __init__.pyi lists them.
"""

import lazy_loader

from tisim.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
