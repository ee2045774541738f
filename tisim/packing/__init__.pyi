from .around_cylinder import RandomAroundCylinder as RandomAroundCylinder
from .clump import Clump as Clump
from .grains import GrainClass as GrainClass
from .in_duct import RandomInDuct as RandomInDuct
from .magnetic_core import MagneticCore as MagneticCore
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
    RandomInCylinder as RandomInCylinder,
)
from .placement import (
    RandomInDomain as RandomInDomain,
)
from .placement import (
    RandomSequential as RandomSequential,
)
from .random_bodies import RandomBodies as RandomBodies
from .random_bodies import random_bodies as random_bodies
from .random_bodies import wall_gaps as wall_gaps
from .size_laws import EqualSizes as EqualSizes
from .size_laws import LognormalSizes as LognormalSizes
from .size_laws import NormalSizes as NormalSizes
from .size_laws import SieveCurve as SieveCurve
from .size_laws import TruncatedSizes as TruncatedSizes
from .size_laws import UniformSizes as UniformSizes
from .size_laws import WeibullSizes as WeibullSizes
from .sizes import SizeDistribution as SizeDistribution
