from .base import Source as Source
from .base import sources as sources
from .constriction import ConstrictionFlow as ConstrictionFlow
from .couette import CouetteFlow as CouetteFlow
from .flow import (
    DarcyFlow as DarcyFlow,
)
from .flow import (
    UniformFlow as UniformFlow,
)
from .flow import (
    kozeny_carman as kozeny_carman,
)
from .magnetic.cylinder_body import Cylinder as Cylinder
from .magnetic.cylinder import MagneticCylinders as MagneticCylinders
from .magnetic.magnets import Body as Body
from .magnetic.magnets import Magnets as Magnets
from .magnetic.mutual_magnetisation import magnetise as magnetise
from .magnetic.sphere import MagneticSpheres as MagneticSpheres
from .magnetic.sphere import Sphere as Sphere
from .sampling import sample as sample
from .uniform import ElectricField as ElectricField
from .uniform import MagneticField as MagneticField
