"""Assertions for tests of custom laws, operators and steppers, given a scene that uses them.

    def test_contracts():
        assert_contracts(scene)

Each function raises AssertionError with a description of the violation of the contract in tisim/effects/base
or tisim/steppers/base.py. The scene should have particles that interact; a few particles and steps are
sufficient.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
