"""What accuracy costs in time, for any scene."""

from tisim.accuracy.quantity import Quantity
from tisim.accuracy.row import Row
from tisim.accuracy.study import Study, study

__all__ = ["Quantity", "Row", "Study", "study"]
