from .clusters import head_to_tail as head_to_tail
from .clusters import labels as labels
from .clusters import mean_size as mean_size
from .clusters import near as near
