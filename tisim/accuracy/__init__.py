"""Cost studies: how the accuracy of a scene depends on the run time."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
