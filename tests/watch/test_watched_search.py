"""The page of a search that is watched, while its folder is written."""

import numpy as np
import pytest

from tests.report.test_in_browser import until
from tests.watch.test_in_browser import watching  # noqa: F401
from tests.watch.test_watched_run import facts_of, text_of
from tisim import optimize
from tisim.optimize.report.watched_search import WatchedSearch
from tisim.watch.budget import Budget

HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='hacked=1'>&amp;"


def drop(design):
    return (design["height"] - 1.5) ** 2 + design["width"] ** 2


@pytest.fixture
def search(tmp_path, monkeypatch):
    """Run some generations of a search in a folder; it goes on when called again. Its tables and pictures are
    left out."""
    monkeypatch.setattr("tisim.optimize.session._write_results", lambda *_: [])
    genes = [optimize.Gene("height", "m", 1.0, 2.0), optimize.Gene("width", "m", 0.0, 1.0)]
    problem = optimize.Problem.of_function(drop, genes, name="throw", title=HOSTILE)

    def run(generations):
        return optimize.run(problem, out=tmp_path, method="random", generations=generations, seed=1)

    return run


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_page_has_all_designs_and_changes_with_the_files(search, tmp_path, unlimited):
    watched = WatchedSearch(tmp_path, budget=unlimited)
    assert watched.news({}) == {"waiting": True}
    assert facts_of(watched.page())["live"]["waiting"]
    search(0)
    before = files(tmp_path)
    facts = facts_of(watched.page())
    assert len(facts["designs"]["gen"]) == facts["live"]["designs"] == 20
    assert facts["live"]["ended"]
    version = {"version": facts["live"]["version"]}
    assert not watched.news(version)["changed"]
    assert files(tmp_path) == before, "nothing is written"
    search(2)
    assert watched.news(version)["changed"]
    page = watched.page()
    assert facts_of(page)["live"]["designs"] == 60
    assert watched.page() is page, "made once for each change"
    assert "<script>window" not in page
    assert HOSTILE in text_of(page)


def test_the_budget_delays_a_new_page(search, tmp_path, clock):
    watched = WatchedSearch(tmp_path, budget=Budget(0.01, 0.0, clock, clock.processor))
    search(0)
    version = {"version": facts_of(watched.page())["live"]["version"]}
    search(1)
    clock.used = 0.5
    news = watched.news(version)
    assert (news["changed"], news["wait"]) == (False, pytest.approx(50.0))
    clock.now = 50.1
    assert watched.news(version)["changed"]


def test_damaged_files_are_told(search, tmp_path, unlimited):
    search(0)
    (tmp_path / "search.h5").write_bytes(b"no search")
    for name in ("search.h5.journal", "search.h5.lock"):
        (tmp_path / name).unlink(missing_ok=True)
    page = WatchedSearch(tmp_path, budget=unlimited).page()
    assert facts_of(page)["live"]["waiting"]
    assert "The search cannot be read at this moment" in text_of(page)


@pytest.mark.long
def test_new_designs_arrive_and_the_choices_stay(search, watching, tmp_path, unlimited):  # noqa: F811
    search(0)
    answers = WatchedSearch(tmp_path, budget=unlimited).answers
    with watching(answers=answers) as (page, _):
        until(page, "document.documentElement.dataset.live === 'ended'")
        assert page.inner_text("p.live") == "The search has ended: 20 designs."
        page.evaluate("report.page.designs.choose(3)")
        page.evaluate("report.page.parallel.brush(0, [1.2, 1.6])")
        genes = page.evaluate("report.page.designs.genes.map((one) => one.values[3])")
        page.click("#theme")
        theme = page.get_attribute("html", "data-theme")
        page.evaluate("scrollTo({ top: 300, behavior: 'instant' })")
        page.evaluate("report.watch.used = Infinity")
        search(2)
        until(page, "document.querySelector('p.live').textContent.includes('are read when this page rests')")
        assert page.evaluate("report.page.designs.count") == 20, "while the page is used it stays"
        with page.expect_navigation():
            page.evaluate("report.watch.used = -Infinity")
        page.wait_for_selector("html[data-ready=yes]")
        until(page, "document.documentElement.dataset.live === 'ended'")
        assert page.evaluate("report.page.designs.count") == 60
        chosen = page.evaluate(
            "report.page.designs.genes.map((one) => one.values[report.page.designs.chosen])"
        )
        assert np.allclose(chosen, genes)
        assert page.evaluate("report.page.parallel.axes[0].brush") == [1.2, 1.6]
        assert page.evaluate("scrollY") == 300
        assert page.get_attribute("html", "data-theme") == theme
        assert page.evaluate("window.hacked ?? 0") == 0
