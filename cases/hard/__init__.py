"""Hard cases: scenes that are hard to integrate, each with numbers that must stay within bounds.

Each module of a family registers its cases with ``hard_case``; the first line of its docstring is the title
of the family. ``tisim hard`` lists and runs them, and ``tests/hard`` runs the same ones.
"""
