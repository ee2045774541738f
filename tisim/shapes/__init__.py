"""Shapes of particles: volume, moments of inertia, and the shortest distance of a pair in kernels."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
