"""Hard spheres and rods."""

from tisim.effects.base import HardBodies
from tisim.effects.contact.rods import Rods


class HardRods(Rods, HardBodies):
    """Hard spherocylinders and spheres, which are spherocylinders of length 0.

    Source: B16 section 2.2.2.
    """
