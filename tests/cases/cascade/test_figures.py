"""Figures of cascades, drawn from known capture times."""

import numpy as np

from tisim.cases.cascade import figures


def test_cascades_in_time_and_their_ratio(monkeypatch):
    """Ten particles are caught, one every second; in random cascades, one every two seconds."""

    def evenly(cascades, repeats, share, progress):
        slow = [1.0 if one.orientation == "optimal" else 2.0 for one in cascades]
        return [s * np.tile(np.arange(1.0, 11.0), (repeats, 1)) for s in slow]

    monkeypatch.setattr(figures, "captured_at", evenly)
    contents = figures.figures("default", lambda fraction: None)
    large, _, stages, ratios = contents["cascade.png"].axes
    optimal, random, *_ = large.lines
    np.testing.assert_allclose(optimal.get_xdata()[::20], np.arange(1.0, 11.0))
    np.testing.assert_allclose(random.get_xdata(), 2 * optimal.get_xdata())
    assert len(stages.lines) == 2 * len(figures.STAGES) + 1
    assert {float(c.lines[0].get_ydata()[0]) for c in ratios.containers} == {2.0}
    row = contents["cascade.csv"].splitlines()[1].split(",")
    assert row[-2:] == ["9.0", "0.0"]
