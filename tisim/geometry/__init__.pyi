from .plane import Plane as Plane
from .shape import Shape as Shape
