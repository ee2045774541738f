"""Processor times of a browser between an interaction with the page of a search and its picture."""

import numpy as np

CALLS = {
    "choose": "report.page.designs.choose(37 * k + 11)",
    "hover": "report.page.pairPlots[0].hover(31 * k + 5)",
    "brush": "report.page.parallel.brush(0, [0.1, 0.5 + 0.05 * k])",
    "sort": "report.page.table.sort(2 + k % 3)",
}
"""Interactions as JavaScript, by name; k counts the repeats."""
REPEATS = 5


def processor_times(page, pause=500):
    """The median time (ms) of each of ``CALLS``, with the parallel coordinates in view.

    pause : time (ms) before an interaction, in which the pictures of earlier ones must end.
    """
    page.evaluate("report.page.parallel.above.scrollIntoView({ block: 'start', behavior: 'instant' })")
    devtools = page.context.new_cdp_session(page)
    devtools.send("Performance.setTimeDomain", {"timeDomain": "threadTicks"})
    devtools.send("Performance.enable")

    def used():
        metrics = devtools.send("Performance.getMetrics")["metrics"]
        return 1000 * next(one["value"] for one in metrics if one["name"] == "TaskDuration")

    medians = {}
    for name, call in CALLS.items():
        times = []
        for k in range(REPEATS):
            page.wait_for_timeout(pause)
            before = used()
            page.evaluate(
                f"(async (k) => {{ {call};"
                f" await new Promise((done) => requestAnimationFrame(() => setTimeout(done))); }})({k})"
            )
            times.append(used() - before)
        medians[name] = float(np.median(times))
    return medians
