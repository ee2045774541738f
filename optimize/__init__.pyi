from .analysis.calibration import (
    Calibration as Calibration,
)
from .analysis.calibration import (
    GeneEstimate as GeneEstimate,
)
from .analysis.calibration import (
    calibration as calibration,
)
from .analysis.sensitivity import (
    Sensitivity as Sensitivity,
)
from .analysis.sensitivity import (
    sensitivity as sensitivity,
)
from .ask_tell import AskTell as AskTell
from .evaluation.ensemble_settings import EnsembleSettings as EnsembleSettings
from .fitness_record import FitnessRecord as FitnessRecord
from .outcome import (
    Design as Design,
)
from .outcome import (
    Outcome as Outcome,
)
from .problem.constraint import (
    DesignConstraint as DesignConstraint,
)
from .problem.constraint import (
    ResultConstraint as ResultConstraint,
)
from .problem.genes import (
    Choice as Choice,
)
from .problem.genes import (
    Gene as Gene,
)
from .problem.genome import Genome as Genome
from .problem.given_genes import (
    DependentGene as DependentGene,
)
from .problem.given_genes import (
    FixedGene as FixedGene,
)
from .problem.objective import Objective as Objective
from .problem.problem import Problem as Problem
from .problem.statistic import (
    Expectation as Expectation,
)
from .problem.statistic import (
    Misfit as Misfit,
)
from .problem.statistic import (
    Quantile as Quantile,
)
from .problem.statistic import (
    WorstOf as WorstOf,
)
from .report.search_page import search_report as search_report
from .search_file import SearchFile as SearchFile
from .search_file import read as read
from .session import run as run
from .settings import Settings as Settings
