"""Changes of state between steps, one file each.

In a shell, ``tisim effects operators`` lists them, a line each, and ``tisim effects NAME`` describes one:
law, source, parameters and units.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
