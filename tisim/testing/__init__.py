"""What a test of one's own law, operator or stepper asks of it, given a scene that has it.

    from tisim.testing import assert_contracts

    def test_contracts():
        assert_contracts(scene)

Each function raises AssertionError, and names what breaks the contract of tisim/effects/base.py or
tisim/steppers/base.py. The scene should have particles that meet; few will do, and some steps.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
