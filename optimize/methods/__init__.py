"""Search methods, one a file; what they must do stands in optimize/methods/base.py."""
