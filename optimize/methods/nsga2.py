"""NSGA-II: the genetic algorithm of DEAP's operators without a surrogate."""

from __future__ import annotations

from tisim.optimize.methods.genetic import BreedingOptions, Genetic, GeneticOptions
from tisim.optimize.problem.genome import Genome


class Nsga2(Genetic):
    """NSGA-II, a short name for ``genetic`` with ``surrogate=False``.

    Source: K. Deb, A. Pratap, S. Agarwal and T. Meyarivan, IEEE Trans. Evol. Comput. 6 (2002) 182-197.
    """

    name = "nsga2"
    Options = BreedingOptions

    def __init__(self, genome: Genome, objectives: int, options: BreedingOptions, seed: int) -> None:
        super().__init__(genome, objectives, GeneticOptions(**dict(options), surrogate=False), seed)
