"""Laws of force and of impact, one file each, by family.

``tisim effects effects`` lists them in a shell, one line each. ``tisim effects NAME`` prints one law with its
source, parameters and units.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
