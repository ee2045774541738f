"""Geometric shapes, such as planes for walls and balls for regions, shared by all packages."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
