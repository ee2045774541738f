from . import (
    accuracy as accuracy,
)
from . import (
    analysis as analysis,
)
from . import (
    cases as cases,
)
from . import (
    effects as effects,
)
from . import (
    geometry as geometry,
)
from . import (
    operators as operators,
)
from . import (
    optimize as optimize,
)
from . import (
    packing as packing,
)
from . import (
    sources as sources,
)
from . import (
    steppers as steppers,
)
from .backend.runtime import init as init
from .engine.batches import run as run
from .engine.observer import MeasureSeries as MeasureSeries
from .engine.observer import Observer as Observer
from .engine.observer import PeriodicCheckpoint as PeriodicCheckpoint
from .engine.result import Result as Result
from .engine.result import Status as Status
from .engine.simulation import Simulation as Simulation
from .errors import InputError as InputError
from .errors import MeshWarning as MeshWarning
from .errors import RunError as RunError
from .errors import RunWarning as RunWarning
from .errors import StartWarning as StartWarning
from .io.recording import Recording as Recording
from .materials.materials import Material as Material
from .materials.materials import MaterialPair as MaterialPair
from .packing.around_cylinder import RandomAroundCylinder as RandomAroundCylinder
from .packing.clump import Clump as Clump
from .packing.grains import GrainClass as GrainClass
from .packing.placement import (
    Lattice as Lattice,
)
from .packing.placement import (
    RandomInBall as RandomInBall,
)
from .packing.placement import (
    RandomInBox as RandomInBox,
)
from .packing.placement import (
    RandomInCylinder as RandomInCylinder,
)
from .packing.placement import (
    RandomInDomain as RandomInDomain,
)
from .reading import read as read
from .scene.cloud import Cloud as Cloud
from .scene.initial_state import Particles as Particles
from .scene.initial_velocity import Blast as Blast
from .scene.scene import Box as Box
from .scene.scene import Open as Open
from .scene.scene import Scene as Scene
from .scene.scene import ShearedBox as ShearedBox
from .version import __version__ as __version__
