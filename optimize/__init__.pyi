from .evaluation.ensemble import EnsembleSettings as EnsembleSettings
from .fitness_record import FitnessRecord as FitnessRecord
from .outcome import (
    Design as Design,
)
from .outcome import (
    Outcome as Outcome,
)
from .problem.genome import (
    Gene as Gene,
)
from .problem.genome import (
    Genome as Genome,
)
from .problem.objective import Objective as Objective
from .problem.problem import Problem as Problem
from .search_file import SearchFile as SearchFile
from .search_file import read as read
from .session import run as run
from .settings import Settings as Settings
