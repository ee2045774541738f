from .contracts import assert_contracts as assert_contracts
from .fields import assert_fields as assert_fields
from .lists import assert_lists as assert_lists
from .pair_forces import assert_pair_forces as assert_pair_forces
from .reach import assert_reach as assert_reach
