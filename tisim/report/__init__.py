"""Reports: one HTML file that shows a run in a browser, without a network or a server."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
