from .evaluation.ensemble import EnsembleSettings as EnsembleSettings
from .fitness_record import FitnessRecord as FitnessRecord
from .outcome import (
    Design as Design,
)
from .outcome import (
    Outcome as Outcome,
)
from .problem.constraint import Constraint as Constraint
from .problem.genes import (
    Choice as Choice,
)
from .problem.genes import (
    Gene as Gene,
)
from .problem.genome import Genome as Genome
from .problem.given_genes import (
    Dependent as Dependent,
)
from .problem.given_genes import (
    Fixed as Fixed,
)
from .problem.objective import Objective as Objective
from .problem.problem import Problem as Problem
from .session import run as run
from .settings import Settings as Settings
