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
from .magnetic.cylinder import MagneticCylinders as MagneticCylinders
from .magnetic.cylinder_body import Cylinder as Cylinder
from .magnetic.magnets import Body as Body
from .magnetic.magnets import Magnets as Magnets
from .magnetic.mutual_magnetisation import magnetise as magnetise
from .magnetic.sphere import MagneticSpheres as MagneticSpheres
from .magnetic.sphere import Sphere as Sphere
from .pore_flow.pore_flow import PoreFlow as PoreFlow
from .pore_flow.solids import SolidCylinder as SolidCylinder
from .pore_flow.solids import SolidSphere as SolidSphere
from .pore_flow.stokes_flow import StokesFlow as StokesFlow
from .pore_flow.stokes_flow import permeability_tensor as permeability_tensor
from .pore_flow.stokes_flow import stokes_flow as stokes_flow
from .sampling import FieldSampler as FieldSampler
from .sampling import sample as sample
from .switched import Switched as Switched
from .uniform import ElectricField as ElectricField
from .uniform import MagneticField as MagneticField
