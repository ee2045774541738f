"""The version of tisim, recorded in results."""

__version__ = "0.1.0"
