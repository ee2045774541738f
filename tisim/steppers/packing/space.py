"""The space in which a packing stepper packs bodies: a periodic box, or a container in it."""

from tisim.backend.taichi import ti
from tisim.effects.walls.confinement import Confinement
from tisim.numerics import elementary
from tisim.program.phases import PerParticle
from tisim.state.status import WorldStatus
from tisim.steppers.context import StepContext


@ti.data_oriented
class PackingSpace:
    """A packing space is the region that bodies fill, contracted in units of D by growing bodies.

    Along most axes the region keeps its size while bodies grow. Along the scaled axes of a container it grows
    with them, and their positions too, in proportion to the distance from the centre of growth.

    walls : the confinement of the scene, a tuple of one, or an empty one in a periodic box.
    contracted : number of axes along which the region decreases in units of D.
    """

    def __init__(self, context: StepContext) -> None:
        self.domain, self.walls = context.domain, context.effects.of(Confinement)
        self.scaled = self.walls[0].data.container.scaled() if self.walls else (False, False, False)
        self.contracted = 3 - sum(self.scaled)

    @ti.func
    def volume(self, w, unit):
        """Return the volume in D^3 (f64). unit : D (m)."""
        side = self.domain.side(w)
        volume = side[0] / unit * (side[1] / unit) * (side[2] / unit)
        for one in ti.static(self.walls):
            volume = one.container.volume(w, side / unit, unit / unit)
        return ti.cast(volume, ti.f64)

    @ti.func
    def growth(self, before, after):
        """Return the ratio (f64) by which bodies grow when the volume (D^3) changes."""
        return elementary.pow(before / after, ti.cast(1.0, ti.f64) / self.contracted)

    @ti.func
    def grown(self, w, place, growth):
        """Return the position (m) of a body after it has grown by a ratio."""
        result = place
        for one in ti.static(self.walls):
            centre = self.domain.origin(w) + one.container.centre(w, self.domain.side(w))
            for k in ti.static(range(3)):
                if ti.static(self.scaled[k]):
                    # Exactly the same position if nothing has grown.
                    result[k] = place[k] + (growth - 1.0) * (place[k] - centre[k])
        return result


class CheckWidth(PerParticle):
    """This phase stops a world in which a body has become longer than half a periodic side: two bodies could
    then touch at two images at once, and only the nearest is looked at."""

    def __init__(self, context: StepContext) -> None:
        super().__init__(context.s)
        self.domain, self.joined = context.domain, context.domain.data.joined()

    @ti.func
    def run(self, w, i):
        side = self.domain.side(w)
        for k in ti.static(range(3)):
            if ti.static(self.joined[k]) and 4.0 * self.s.radius[w, i] > side[k]:
                self.s.fail(w, WorldStatus.BOX_TOO_NARROW, i)
