"""Size and time of the page of a search, and the processor times of a browser that shows it.

    python tests/benchmarks/search_report_size.py [--designs 2000 10000]

Searches of a plain function of 6 genes for two objectives, by NSGA-II with 80 designs a generation, two
starts of each and 16 held-out starts of the front. Times are processor times; the extra ``browser`` is
needed.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from playwright.sync_api import sync_playwright

from tests.report.conftest import SWITCHES, executable
from tests.report.interactions import processor_times
from tisim.optimize import Choice, Gene, Objective, Problem, Settings
from tisim.optimize.evaluation.function_evaluator import FunctionEvaluator
from tisim.optimize.report.search_data import read_search
from tisim.optimize.report.search_page import search_html
from tisim.optimize.search import search
from tisim.optimize.storage.cache import Cache

POPULATION = 80


def values(design, seed):
    """Two objectives with noise that the seed determines."""
    noise, x = np.random.default_rng(seed).normal(size=2), [design[f"x{k}"] for k in range(5)]
    steel = 0.2 * (design["kind"] == "steel")
    loss = (x[0] - 0.3) ** 2 + 2 * (x[1] - 0.6) ** 2 + x[2] * x[3] + steel + 0.02 * noise[0]
    return {"loss": loss, "mass": 1 + x[4] - 0.5 * x[0] + x[1] ** 2 - steel + 0.02 * noise[1]}


def problem():
    """The problem of two objectives."""
    genes = [*(Gene(f"x{k}", "m", 0.0, 1.0) for k in range(5)), Choice("kind", ("steel", "gold", "lead"))]
    objectives = [
        Objective("loss", lambda result: result.value["loss"], "J"),
        Objective("mass", lambda result: result.value["mass"], "kg"),
    ]
    return Problem.of_function(values, genes, objectives, name="demo")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--designs", nargs="*", type=int, default=[2000, 10000])
    with sync_playwright() as driver, tempfile.TemporaryDirectory() as folder:
        browser = driver.chromium.launch(executable_path=executable(driver), args=SWITCHES)
        for number in parser.parse_args().designs:
            file = Path(folder) / f"{number}.h5"
            settings = Settings(
                method="nsga2", options={"population": POPULATION}, generations=number // POPULATION - 1
            )
            with Cache(file) as cache:
                search(problem(), FunctionEvaluator(), cache, settings)
            began = time.process_time()
            data = read_search(file)
            html = search_html(data)
            took = time.process_time() - began
            path = file.with_suffix(".html")
            path.write_text(html, encoding="utf-8")
            page = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
            began = time.perf_counter()
            page.goto(path.as_uri())
            page.wait_for_selector("html[data-ready=yes]", timeout=300_000)
            ready = time.perf_counter() - began
            times = ", ".join(
                f"{name} {spent:.0f} ms" for name, spent in processor_times(page, number).items()
            )
            runs = sum(map(len, data.runs))
            print(
                f"{len(data)} designs, {runs} runs: {len(html.encode()) / 1e6:.2f} MB in {took:.2f} s, ",
                end="",
            )
            print(f"ready in {ready:.1f} s; {times}", flush=True)
            page.context.close()
        browser.close()


if __name__ == "__main__":
    main()
