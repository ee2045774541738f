"""The page of a search: one HTML file that shows its designs in a browser, without a network.

It is made from the folder of the search alone. Clouds of designs are runs that are made for the page
(``recorded_designs``), because a search keeps the values of its runs, and no particles.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tisim.errors import InputError, must
from tisim.files.atomic import replace_file
from tisim.optimize.report.recorded_designs import RecordedDesign
from tisim.optimize.report.search_data import Row, SearchData, read_search
from tisim.optimize.report.search_facts import convergence, designs_facts, progress, run_quantities
from tisim.optimize.tables import FEASIBLE
from tisim.report.page import SEARCH_SCRIPTS, WATCHED_SEARCH_SCRIPTS, Page, Section, copied_text, table
from tisim.report.run_report import LONGEST_TOML
from tisim.report.scenery import colour_maps
from tisim.report.viewer_data import SIZE_LIMIT
from tisim.version import __version__

CHOSEN_DESIGN = (
    '<aside id="chosen" aria-label="Chosen design"></aside><p id="told" class="unseen" role="status"></p>'
    '<a id="shown" href="#chosen" aria-label="To the chosen design"></a>'
)
"""The places of the panel of the chosen design, and of its short form: for screen readers, and on narrow
pages."""


@dataclass(frozen=True)
class SearchPageOptions:
    """The choices for the page of a search.

    limit : largest size of the file, MB. The designs with the worst fitness are left out until it is kept,
        and the page says so.
    scenes : scenes of designs as TOML, by the indices of the designs.
    recorded : runs of designs.
    """

    limit: float = SIZE_LIMIT
    scenes: Mapping[int, str] | None = None
    recorded: Sequence[RecordedDesign] = ()

    def __post_init__(self) -> None:
        must(0.5 <= self.limit < math.inf, "limit", "at least 0.5 MB, and finite", self.limit)


def search_report(
    folder: str | Path, to: str | Path, search: str | None = None, options: SearchPageOptions | None = None
) -> Path:
    """Write the page of a search: one HTML file that a browser shows without a network; return its path.

    folder : of the search, or its search.h5. to : file to write, replaced if it exists. search : its name, if
    several share the folder; by default the one that ended last.

    Raise InputError if there is no search, or if the limit is too small; RunError if the disk is full.
    """
    path = Path(to)
    replace_file(path, search_html(read_search(folder, search), options).encode())
    return path


def search_html(
    data: SearchData, options: SearchPageOptions | None = None, live: Mapping[str, Any] | None = None
) -> str:
    """Return the page of a search as HTML. InputError if the limit is too small for a single design.

    live : plain data for the script of a page that is watched; None for a file.
    """
    chosen = options or SearchPageOptions()
    kept = list(range(len(data)))
    while True:
        page = search_page(data, chosen, kept)
        if live is not None:
            facts = {**page.facts, "live": live}
            page = replace(page, facts=facts, scripts=WATCHED_SEARCH_SCRIPTS, connects=True)
        html = page.html()
        size = len(html.encode())
        if size <= 1e6 * chosen.limit:
            return html
        if len(kept) < 2:
            raise InputError(
                f"limit must be large enough for the recorded designs, such as {2e-6 * size:.3g} MB; "
                f"received {chosen.limit:g} MB"
            )
        kept = _best(data, kept, int(0.9 * len(kept) * min(1.0, 1e6 * chosen.limit / size)) or 1)


def search_page(data: SearchData, options: SearchPageOptions, kept: Sequence[int]) -> Page:
    """Return the page of a search with some of its designs, by increasing index."""
    recordings, blobs = [], []
    for one in options.recorded:
        if one.design in kept:
            recordings.append({"design": kept.index(one.design), "about": one.about, **one.facts})
            blobs.append(one.data)
    several = len(data.objectives) > 1
    scenes = {kept.index(k): toml for k, toml in _scenes(data, options).items() if k in kept}
    facts = {
        "name": data.name, "several": several, "generations": list(data.logbook.get("gen", ())),
        "convergence": list(convergence(data)), "progress": list(progress(data)),
        "designs": designs_facts(data, kept), "quantities": run_quantities(data), "maps": colour_maps(),
        "recordings": recordings, "scenes": scenes, "command": _command(data),
    }  # fmt: skip
    notices = list(_notices(data))
    if len(kept) < len(data):
        some = f"the best {len(kept)} of {len(data)} designs"
        notices.append(f"To keep this file below {options.limit:g} MB, it has {some}.")
    ended = {"": "not ended", "interrupted": "interrupted", "target": "target reached"}
    return Page(
        title=data.title,
        state="unfinished" if data.stopped in ("", "interrupted") else "ok",
        verdict=ended.get(data.stopped, f"ended by {data.stopped}"),
        summary=_summary(data),
        facts=facts,
        recording=b"".join(blobs),
        notices=notices,
        sections=list(_sections(data, bool(recordings), several)),
        footer=[f"Search {data.name}. {_versions(data)} Written by tisim {__version__}."],
        scripts=SEARCH_SCRIPTS,
        view=CHOSEN_DESIGN,
    )


def _best(data: SearchData, kept: Sequence[int], count: int) -> list[int]:
    """Return the best of designs: the hall of fame, and designs with the best values of an objective."""
    order = {k: (0 if data.facts["rank"][k] else 1, math.inf) for k in kept}
    for row in data.objectives:
        sign = -1.0 if row.get("direction") == "largest" else 1.0
        costs = {k: sign * data.values[row["name"]][k] for k in kept}
        ranked = sorted(kept, key=lambda k: (math.isnan(costs[k]), costs[k]))
        for place, k in enumerate(ranked):
            order[k] = order[k][0], min(order[k][1], place)
    return sorted(sorted(kept, key=lambda k: order[k])[:count])


def _scenes(data: SearchData, options: SearchPageOptions) -> dict[int, str]:
    """Return the scenes of designs as TOML, by index, except long ones."""
    scenes = dict(options.scenes or {})
    best = next((k for k, one in enumerate(data.facts.get("best", ())) if one), None)
    if data.best_scene and best is not None:
        scenes.setdefault(best, data.best_scene)
    return {k: toml for k, toml in scenes.items() if len(toml) <= LONGEST_TOML}


def _notices(data: SearchData) -> Iterable[str]:
    if not data.stopped:
        yield "The search has not ended: this page shows it as far as its file has it."
    if not len(data):
        yield "No generation has finished yet."
    best = next((k for k, one in enumerate(data.facts.get("best", ())) if one), None)
    if best is not None and data.constraints:
        answer = data.facts[FEASIBLE][best]
        if answer == "no":
            yield "No design satisfies the constraints; the first one violates them least."
        elif answer == "unproven":
            yield "The best design may violate a constraint: an interval contains a bound, or is not known."


def _summary(data: SearchData) -> str:
    failed = sum(bool(reason) for reason in data.facts.get("failed", ()))
    runs = sum(map(len, data.runs))
    seconds = sum(run.wall_s for of_it in data.runs for run in of_it)
    designs = f"{len(data):,}" + (f", {failed:,} of them failed" if failed else "")
    last = (data.logbook.get("gen") or [0])[-1]
    method = f"Method: {data.settings.get('method')}, seed {data.settings.get('seed')}."
    work = f"Runs: {runs:,}, {_duration(seconds)} of wall time. Generations: {last} after the first."
    return f"Designs: {designs}. {work} {method}"


def _command(data: SearchData) -> str:
    """Return the command that began a search; "" if it was begun in Python."""
    return shlex.join(["tisim", *data.command]) if data.command else ""


def _duration(seconds: float) -> str:
    """Return a time in a unit that people read."""
    for size, unit in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def _versions(data: SearchData) -> str:
    evaluator = data.identity.get("evaluator", {})
    told = [f"tisim {data.versions.get('tisim')}", *(f"{name} {value}" for name, value in evaluator.items())]
    return f"Run by {', '.join(told)}."


def _sections(data: SearchData, clouds: bool, several: bool) -> Iterable[Section]:
    if clouds:
        yield Section("clouds", "Start and end", '<div id="views"></div>')
    yield Section(
        "reached",
        "Convergence",
        '<div id="convergence" class="figures"></div><details class="block"><summary>Further numbers of each '
        'generation</summary><div id="progress" class="figures"></div></details>',
    )
    if several:
        yield Section("front", "Front", '<div id="fronts" class="figures"></div>')
    yield Section(
        "genes",
        "Genes",
        '<div id="colours" class="group" role="group" aria-label="Colours"></div><div id="parallel"></div>'
        '<h3>Pairs of genes</h3><fieldset id="pair-choice" class="group range"></fieldset>'
        '<div id="pairs" class="pairs"></div>',
    )
    yield Section("designs", "Designs", '<div id="rows"></div>')
    yield Section("asked", "What was asked", _asked(data))


def _asked(data: SearchData) -> str:
    """Return the genes, objectives, constraints and settings of a search as HTML."""

    def bounds(row: Row) -> str:
        if "choices" in row:
            return str(row["choices"])
        if "low" in row:
            return f"{row['low']:.6g} to {row['high']:.6g}" + (", logarithmic" * (row.get("scale") == "log"))
        return f"fixed at {row['value']}" if "value" in row else "follows from the others"

    def limits(row: Row) -> str:
        words = {"at_least": "at least", "at_most": "at most"}
        return ", ".join(f"{word} {row[name]:.6g}" for name, word in words.items() if name in row)

    text = "<h3>Genes</h3>" + table(
        ("gene", "unit", "range"),
        [(row["name"], row.get("unit", ""), bounds(row)) for row in data.genes],
        "genes",
    )
    text += "<h3>Objectives</h3>" + table(
        ("objective", "unit", "wanted", "over the starts", "meaning"),
        [
            (row["name"], row.get("unit", ""), row["direction"], row["statistic"], row.get("description", ""))
            for row in data.objectives
        ],
        "objectives",
    )
    if data.constraints:
        text += "<h3>Constraints</h3>" + table(
            ("constraint", "unit", "bounds", "of"),
            [(row["name"], row.get("unit", ""), limits(row), row.get("of", "")) for row in data.constraints],
            "constraints",
        )
    text += "<h3>Settings of the search</h3>" + table(
        ("setting", "value"), [(name, str(value)) for name, value in _leaves(data.settings)], "settings"
    )
    if data.command:
        text += "<h3>Command</h3>" + copied_text("command.txt", f"{_command(data)}\n")
    return text


def _leaves(settings: Mapping[str, Any], above: str = "") -> Iterable[tuple[str, Any]]:
    """Yield nested settings by their dotted names, without those that are not given."""
    for name, value in settings.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{above}{name}.")
        elif value is not None:
            yield f"{above}{name}", value
