"""Published values of L21, chapter 2: the numbers of its tables and of the text about them.

The measurements are by C. Trendler and H. Bose, J. Magn. Magn. Mater. 293 (2005) 741, as quoted by L21. L21
does not print density and permeability of the grains; its +77.78 % and -20.99 % for pairs (section 2.2.3)
imply a permeability much larger than 1.
"""

from typing import NamedTuple

from tisim.cases.common.magnetorheological_fluid import MICRO

# Table 2.1: particle properties; TABLE_2_1 of ``cases/common/magnetorheological_fluid.py`` has the others.
YOUNG = 1e9
"""Young's modulus, Pa; L21 says that it is about 1 % of the value of iron."""
COHESION = 60e3
"""Cohesion energy density k_c, J/m^3."""

# Section 2.3: the cell and the fluid.
OIL_VISCOSITY = 10e-3
"""Dynamic viscosity of the oil, Pa s."""
FRACTION = 0.3
"""Volume fraction of the grains."""
FLUX = 0.6
"""Magnetic flux density along z, T."""
CELL_SIDE, RAFT_DEPTH = 250 * MICRO, 15 * MICRO
"""Side of the cubic cell, and thickness of the frozen layers at its bottom and top, m."""
STEP = 2e-10
"""Step, s."""
NEIGHBOUR_GAP = 8 * MICRO
"""Largest gap between surfaces over which grains magnetise each other, m (section 2.4.3)."""
MEAN_LARGE = 6.7 * MICRO
"""Mean diameter of the large grains, m."""
CHAINS_FORM = 1e5 * STEP
"""Approximate time in which chains form, s (section 2.4.1)."""
WALL_SPEEDS = (0.128, 0.064, 0.032, 0.011, 0.008, 0.004, 0.002, 0.001)
"""Successive speeds of each raft, m/s."""
SHEAR_RATES = tuple(2 * speed / (CELL_SIDE - 2 * RAFT_DEPTH) for speed in WALL_SPEEDS)
"""Shear rates between the rafts, 1/s; L21 mentions 590, 36.4 and 9."""

# Table 2.4 and section 2.4.2: yield stresses at 0.6 T, Pa.
MEASURED_YIELD = {"00:100": 44.9e3, "33:67": 50.8e3}
SIMULATED_YIELD = {"00:100": 44.1e3, "33:67": 56.3e3}
"""L21's simulated values for distributions by number; by volume it gives 49.6 kPa for 00:100."""
SEED_SPREAD = 0.029
"""Standard deviation of the yield stress over seeds, divided by its mean."""


class Cost(NamedTuple):
    """What a step of a simulation cost L21.

    step : wall time, s. cores : number in use. grains, neighbours : number of grains, and of neighbours of a
    grain whose field it feels.
    """

    step: float
    cores: int
    grains: int
    neighbours: int

    @property
    def core_time(self) -> float:
        """Return the core time of a grain and step, s."""
        return self.step * self.cores / self.grains


# Section 2.4.3. The first three on Intel E5-2680v2 of 2013, the others on E5-2699V4 of 2016.
COSTS = {
    "l21": Cost(4.64e-3, 18, 12_000, 100),
    "l21_monodisperse": Cost(3.90e-3, 18, 30_000, 25),
    "l21_volume": Cost(31e-3, 60, 60_000, 500),
    "00:100 by number, double cell": Cost(30.1e-3, 27, 93_000, 100),
    "l21_bidisperse": Cost(72e-3, 40, 200_000, 220),
    "33:67 by volume, a gap of 2 um": Cost(1152e-3, 40, 910_000, 300),
}
"""By size of the case, or in words for models that are not a size."""
