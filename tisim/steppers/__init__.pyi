from .base import Stepper as Stepper
from .boris import Boris as Boris
from .brownian.brownian import Brownian as Brownian
from .brownian.drift_limit import DriftLimit as DriftLimit
from .choice import StepperChoice as StepperChoice
from .context import Step as Step
from .context import StepContext as StepContext
from .implicit.collocation import Collocation as Collocation
from .implicit.collocation import StageControl as StageControl
from .implicit.step_control import (
    ErrorControl as ErrorControl,
)
from .implicit.step_control import (
    ImplicitControl as ImplicitControl,
)
from .implicit.step_control import (
    IterationControl as IterationControl,
)
from .implicit.trapezoid import Trapezoid as Trapezoid
from .langevin import Langevin as Langevin
from .packing.energy_minimisation import EnergyMinimisation as EnergyMinimisation
from .packing.mechanical_contraction import MechanicalContraction as MechanicalContraction
from .step_control import (
    ApproachTime as ApproachTime,
)
from .step_control import (
    Controller as Controller,
)
from .step_control import (
    FixedStep as FixedStep,
)
from .step_control import (
    StepControl as StepControl,
)
from .verlet import Verlet as Verlet
