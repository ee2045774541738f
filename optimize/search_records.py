"""A search leaves its settings, versions, logbook and best designs as tables in its cache file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import deap

from optimize.outcome import Outcome
from optimize.storage.cache import Cache
from optimize.storage.record import canonical
from optimize.tables import best_columns, logbook_columns
from tisim.io.run_folder import versions


def store(cache: Cache, outcome: Outcome) -> None:
    """Put the tables of a search into the file; on return they are on the disk."""
    attributes = {
        "identity": canonical(outcome.identity).decode(),
        "settings": outcome.settings.model_dump_json(),
        "versions": json.dumps({**versions(), "deap": deap.__version__}),
        "stopped": outcome.stopped,
    }
    cache.put_table(outcome.name, {}, attributes)
    cache.put_table(f"{outcome.name}/hall_of_fame", best_columns(outcome.problem, outcome.hall))
    cache.put_table(f"{outcome.name}/logbook", logbook_columns(outcome.problem, outcome.logbook))
    cache.fold()


def searches(cache: Cache) -> dict[str, Mapping[str, Any]]:
    """Return the attributes of each search in the file, by its name."""
    tables = cache.attributes()
    return {name: attributes for name, attributes in tables.items() if "identity" in attributes}
