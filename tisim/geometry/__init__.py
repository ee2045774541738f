"""Shapes by their signed distance, such as a plane that bounds grains."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
