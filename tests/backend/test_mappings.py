"""A process that has used up its memory mappings reports it before the driver crashes."""

import pytest

from tisim import RunError
from tisim.backend import mappings


@pytest.fixture
def system(monkeypatch, tmp_path):
    """A system that allows a process 100 mappings; the fixture sets how many are in use."""
    monkeypatch.setattr(mappings, "LIMIT", tmp_path / "limit")
    monkeypatch.setattr(mappings, "MAPPINGS", tmp_path / "maps")

    def use(number):
        mappings.LIMIT.write_text("100\n")
        mappings.MAPPINGS.write_text("7f00-7f01 rw-s /memfd:allocation\n" * number)

    return use


def test_nearly_all_are_refused(system):
    system(80)
    mappings.require_mappings()
    system(81)
    with pytest.raises(RunError, match=r"mappings of memory must stay below 100; received 81: this driver"):
        mappings.require_mappings()


def test_other_systems_have_no_such_limit(system):
    mappings.require_mappings()
