"""The version of tisim; results say it."""

__version__ = "0.1.0"
