from .cost_study import Study as Study
from .cost_study import study as study
from .quantity import Quantity as Quantity
from .row import Row as Row
