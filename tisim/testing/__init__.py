"""Assertions for tests of one's own laws, operators and steppers, given a scene that has them.

    from tisim.testing import assert_contracts

    def test_contracts():
        assert_contracts(scene)

Each function raises AssertionError, and names what breaks the contract of tisim/effects/base or
tisim/steppers/base.py. The scene should have particles that meet; a few particles and steps are enough.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
