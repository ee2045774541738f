from .box import BoxSurface as BoxSurface
from .cone import ConicalSurface as ConicalSurface
from .container import Container as Container
from .cylinder import CylindricalSurface as CylindricalSurface
from .disc import Disc as Disc
from .flat_containers import BoxContainer as BoxContainer
from .flat_containers import WedgeContainer as WedgeContainer
from .plane import Plane as Plane
from .revolved import (
    Barrel as Barrel,
)
from .revolved import (
    RevolvedSurface as RevolvedSurface,
)
from .round_containers import CylindricalContainer as CylindricalContainer
from .round_containers import SphericalContainer as SphericalContainer
from .shape import Shape as Shape
from .sphere import SphericalSurface as SphericalSurface
from .surface import Surface as Surface
from .triangles import TriangulatedSurface as TriangulatedSurface
