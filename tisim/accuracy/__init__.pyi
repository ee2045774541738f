from .cost_study import Row as Row
from .cost_study import Study as Study
from .figure import plot as plot
from .quantity import Quantity as Quantity
from .report import table as table
from .runner import run as run
from .runner import study as study
from .storage import write as write
