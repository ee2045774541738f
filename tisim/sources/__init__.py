"""External fields of place and time, one file each.

``tisim effects sources`` lists them in a shell, a line each. ``tisim effects NAME`` says all of one: law,
source, parameters and units.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
