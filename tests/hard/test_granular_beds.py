"""Mixtures of unlike sizes and stiffnesses, and beds that a piston hits as fast as sound in them."""

import numpy as np
import pytest

from tests.effects.contact.grains import cell
from tests.hard.granular_scenes import LAWS, LOSSY, ends, grains, kinetic, loaded, momenta
from tests.scenes import by_id, roundoff
from tisim.analysis import beds

pytestmark = pytest.mark.slow
