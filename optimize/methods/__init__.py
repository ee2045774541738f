"""Search methods, one in each file; their interface is defined in optimize/methods/base.py."""
