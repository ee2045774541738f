"""The page of a study of costs that is watched, while its folder is written."""

import pytest

from tests.report.test_cost_report import ROWS, write_study
from tests.report.test_in_browser import until
from tests.watch.test_in_browser import watching  # noqa: F401
from tests.watch.test_watched_run import facts_of, text_of
from tisim.watch.budget import Budget
from tisim.watch.cost_study import WatchedStudy
from tisim.watch.folder import WatchedFolder
from tisim.watch.run import WatchedRun


def test_a_page_has_all_settings_and_changes_with_the_file(tmp_path, unlimited):
    watched = WatchedStudy(tmp_path, budget=unlimited)
    assert watched.news({}) == {"waiting": True}
    assert "study of costs cannot be read" in text_of(watched.page())
    write_study(tmp_path, ROWS[:2])
    page = watched.page()
    facts = facts_of(page)
    assert len(facts["rows"]) == facts["live"]["settings"] == 2
    assert "Not all settings are measured yet." in page
    version = {"version": facts["live"]["version"]}
    assert (watched.news(version)["changed"], watched.news(version)["ended"]) == (False, False)
    write_study(tmp_path, ROWS, complete=True)
    assert watched.news(version)["changed"]
    page = watched.page()
    assert facts_of(page)["live"]["settings"] == len(ROWS)
    assert facts_of(page)["live"]["ended"]
    assert "Not all settings" not in page
    assert "<script>window" not in page
    assert watched.page() is page, "made once for each change"


def test_the_budget_delays_a_new_page(tmp_path, clock):
    write_study(tmp_path, ROWS[:2])
    watched = WatchedStudy(tmp_path / "cost.h5", budget=Budget(0.01, 0.0, clock, clock.processor))
    version = {"version": facts_of(watched.page())["live"]["version"]}
    write_study(tmp_path, ROWS)
    clock.used = 0.5
    assert (watched.news(version)["changed"], watched.news(version)["wait"]) == (False, pytest.approx(50.0))


def test_an_empty_folder_becomes_that_of_a_study_once_it_has_one(tmp_path):
    kinds = {"run": WatchedRun, "cost": WatchedStudy}
    watched = WatchedFolder(tmp_path, lambda kind: kinds[kind](tmp_path))
    assert watched.news({}) == {"waiting": True}
    write_study(tmp_path, ROWS[:1])
    assert watched.news({}) == {"reload": True}
    assert len(facts_of(watched.page())["rows"]) == 1
    assert not watched.news({"version": facts_of(watched.page())["live"]["version"]})["changed"]


@pytest.mark.long
def test_new_settings_arrive_and_the_choices_stay(watching, tmp_path, unlimited):  # noqa: F811
    write_study(tmp_path, ROWS[:4])
    with watching(answers=WatchedStudy(tmp_path, budget=unlimited).answers) as (page, _):
        until(page, "document.documentElement.dataset.live === 'running'")
        assert page.inner_text("p.live").startswith("Watching: 4 settings; its files changed")
        page.evaluate("report.page.choice.choose(2)")
        page.click("#methods label:has-text('Boris') input")
        page.evaluate("report.watch.used = -Infinity")
        with page.expect_navigation():
            write_study(tmp_path, ROWS, complete=True)
        page.wait_for_selector("html[data-ready=yes]")
        until(page, "document.documentElement.dataset.live === 'ended'")
        assert page.inner_text("p.live") == f"The study has ended: {len(ROWS)} settings."
        assert page.evaluate("report.page.rows.length") == len(ROWS)
        chosen = page.evaluate("report.page.rows[report.page.choice.chosen].setting")
        assert chosen == ROWS[2].setting
        assert page.evaluate("[...report.page.hidden]") == ["Boris"]
        assert page.evaluate("window.hacked ?? 0") == 0
