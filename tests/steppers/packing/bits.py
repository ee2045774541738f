"""The same bits of a packing alone, in a batch, and after a checkpoint."""

from tests.compare import same_arrays
from tisim import Simulation, run
from tisim.engine.checkpoint import restore, save


def same_bits(scenes, folder, steps):
    """Run three scenes as a batch; assert that the second has the same result alone, and after a checkpoint
    at some steps in a simulation of more capacity. Returns the results of the batch."""
    usual = run(scenes)
    (alone,) = run([scenes[1]])
    simulation = Simulation(scenes[0], 3, capacity=max(one.capacity() for one in scenes))
    simulation.load(scenes)
    simulation.run(steps=steps)
    save(simulation, folder / "c.h5")
    simulation.run(steps=3)
    simulation.load(scenes)
    restore(simulation, folder / "c.h5")
    simulation.run()
    for other in (alone, simulation.results()[1]):
        assert (other.time, other.work, other.measures) == (usual[1].time, usual[1].work, usual[1].measures)
        same_arrays(other.state, usual[1].state)
    simulation.close()
    return usual


def resumed(scene, folder):
    """The result of a run that is interrupted while overlaps remain, shortly before it returns to its last
    configuration without overlaps; assert that it is the result of the run without interruption."""
    simulation = Simulation(scene, 1)
    simulation.load([scene])
    while int(simulation.s.read("attempted")[0]) < 50 or not int(simulation.s.read("contractions")[0]):
        simulation.run(steps=1)
    save(simulation, folder / "c.h5")
    simulation.run()
    (expected,) = simulation.results()
    simulation.load([scene])
    restore(simulation, folder / "c.h5")
    simulation.run()
    (result,) = simulation.results()
    assert result.time == expected.time
    same_arrays(result.state, expected.state)
    simulation.close()
    return result
