"""One assertion that checks all contracts of a scene."""

from tisim.scene.scene import Scene
from tisim.testing.fields import assert_fields
from tisim.testing.lists import assert_lists
from tisim.testing.pair_forces import assert_pair_forces
from tisim.testing.reach import assert_reach


def assert_contracts(scene: Scene) -> None:
    """Assert that ``assert_fields``, ``assert_reach``, ``assert_pair_forces`` and ``assert_lists`` pass for a
    scene."""
    assert_fields(scene)
    assert_reach(scene)
    assert_pair_forces(scene)
    assert_lists(scene)
