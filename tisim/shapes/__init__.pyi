from .ellipsoid import EllipsoidShape as EllipsoidShape
from .particle_shape import ParticleShape as ParticleShape
from .sphere import SphereShape as SphereShape
from .spherocylinder import SpherocylinderShape as SpherocylinderShape
from .superquadric import SuperquadricShape as SuperquadricShape
