from .base import Operator as Operator
from .capture import Capture as Capture
from .cooling import Cooling as Cooling
from .fragmentation import Fragmentation as Fragmentation
from .peak_displacement import PeakDisplacement as PeakDisplacement
