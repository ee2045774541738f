"""Z04's genetic algorithm, restarted around the best design whenever it has converged."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import Field

from tisim.optimize.methods.breeding_settings import Breeding
from tisim.optimize.methods.individual import Individual
from tisim.optimize.methods.zohdi import Zohdi
from tisim.optimize.problem.genome import Genome, SearchBox


class RestartOptions(Breeding):
    """The settings of ``zohdi``, and the criteria for restarts.

    stalled : number of generations without improvement after which the search counts as converged.
    smallest : if the search box would become narrower than this, the next restart uses the whole range.

    The box shrinks by recentre_factor at each restart, and does not move in between (recentre_every = 0).
    """

    recentre_every: int = Field(0, ge=0, le=0)
    stalled: int = Field(4, ge=1)
    smallest: float = Field(0.05, gt=0, le=1)


class Restart(Zohdi):
    """Z04 section 7, option: "Rescale and restart the search around best design every few generations".

    ``zohdi`` draws only its fresh individuals from the rescaled box. Here the whole population except the
    best design is drawn anew from it; the other parents and their offspring are discarded.
    """

    name = "restart"
    Options = RestartOptions
    options: RestartOptions

    def __init__(self, genome: Genome, objectives: int, options: RestartOptions, seed: int) -> None:
        super().__init__(genome, objectives, options, seed)
        self.best: tuple[float, ...] = ()
        self.stagnation = 0

    def tell(self, population: list[Individual], hall: Sequence[Individual]) -> None:
        if hall:
            better = not self.best or hall[0].fitness.values < self.best
            self.best, self.stagnation = hall[0].fitness.values, 0 if better else self.stagnation + 1
        self.moved = self.stagnation >= self.options.stalled
        if not self.moved:
            self.next_population = self.breeder.next_generation(population)
            return
        self.stagnation = 0
        if self.width * self.options.recentre_factor < self.options.smallest:
            self.breeder.box = SearchBox.full(len(hall[0]))
        else:
            self.breeder.recentre(hall[0])
        self.next_population = [hall[0], *self.breeder.first()[1:]]
