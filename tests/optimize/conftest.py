"""What tests of the search share."""

import pytest


@pytest.fixture
def path(tmp_path):
    """Where a cache file may be made."""
    return tmp_path / "cache.h5"
