"""Which schedule worlds run on unless one is given, by the work of a step."""

from tisim.backend.runtime import Runtime
from tisim.program.phases import Item, nested
from tisim.state.state import State

TEAM_FROM = 2000
"""Worlds with the work of so many particles are shared by threads, where there are more of these than worlds.
With 8000 grains two threads are faster than one (docs/performance.md), with 500 slower. There is a member of
a team for each half of it."""
OTHERS_OF_ONE = 40
"""Going through so many others takes as long as the rest of a step of a particle: a grain takes some 80 ns,
the force between two charges or dipoles 1 to 2 ns."""


def work_of(step: tuple[Item, ...], s: State) -> int:
    """Return the work of a world in a step, by what it has room for: so many particles that feel those near
    them alone have it."""
    # Some stand there twice, and run once.
    others = sum(phase.extent * phase.others for phase in {phase for phase, _ in nested(step)})
    return s.capacity + others // OTHERS_OF_ONE


def members(step: tuple[Item, ...], s: State, threads: int) -> int:
    """Return how many of so many threads may share a world: more would wait for each other."""
    return min(threads, max(2, 2 * work_of(step, s) // TEAM_FROM))


def choose(step: tuple[Item, ...], s: State, runtime: Runtime) -> str:
    """Return the schedule on which worlds take a step in the least time."""
    if runtime.device != "cpu" or any(phase.long for phase, _ in nested(step)):
        return "particle"
    # A thread for each world is best; fewer are shared, where that is worth waiting for each other.
    many = s.worlds >= runtime.threads
    return "world" if many or work_of(step, s) < TEAM_FROM else "team"
