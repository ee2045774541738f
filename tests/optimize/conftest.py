"""Fixtures for tests of the search."""

import pytest


@pytest.fixture
def path(tmp_path):
    """Path for a new cache file."""
    return tmp_path / "cache.h5"
