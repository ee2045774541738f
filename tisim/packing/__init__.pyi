from .around_cylinder import RandomAroundCylinder as RandomAroundCylinder
from .placement import (
    Lattice as Lattice,
)
from .placement import (
    Placement as Placement,
)
from .placement import (
    RandomInBall as RandomInBall,
)
from .placement import (
    RandomInBox as RandomInBox,
)
from .placement import (
    RandomInDomain as RandomInDomain,
)
