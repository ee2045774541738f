"""Chains that are followed through made-up frames, and in a small cell."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim import InputError
from tisim.cases.mrf_shear.chain_figures import chain_table, reattachment_figure
from tisim.cases.mrf_shear.chains import CHAINED, CONTACT_ENDS, Followed, followed
from tisim.cases.mrf_shear.figures import figures
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, LOWER, UPPER, scene

R, UM = LARGE_RADIUS, 1e-6
CELL = scene(sides=(40 * UM, 30 * UM, 60 * UM))
COLUMN = np.column_stack([np.zeros(4), np.zeros(4), R * (1 + 2 * np.arange(4.0))])
"""Four grains in line along z; the first and the last belong to rafts."""


def cell(*frames):
    """A cell of two columns, grains 0 to 3 and 4 to 7, whose grains move to given frames."""
    state = {"group": np.tile([LOWER, 0, 0, UPPER], 2), "radius": np.full(8, R)}
    start = {"position": frames[0], "radius": state["radius"]}
    return Followed(SimpleNamespace(scene=CELL, state=state, start=start), np.array(frames))


def columns(x=10 * UM, apart=15 * UM):
    return np.vstack([COLUMN + np.array([at, 9 * UM, 0]) for at in (x, x + apart)])


def moved(frame, grains, by):
    """A frame whose grains have moved by a vector, m."""
    new = frame.copy()
    new[grains] += by
    return new


APART = columns()
# The upper half of the first column moves beside the second: 1-2 breaks; 2-6 and 3-7 form, and 2-6 is between
# free grains.
BESIDE = moved(APART, [2, 3], (15 * UM - 2 * R, 0, 0))


def test_a_chain_that_breaks_and_attaches_itself_to_another():
    found = cell(APART, BESIDE)
    assert found.pairs(0).tolist() == [[0, 1], [1, 2], [2, 3], [4, 5], [5, 6], [6, 7]]
    # 3 and 7 belong to one raft, whose contacts do not count.
    assert found.pairs(1).tolist() == [[0, 1], [2, 3], [2, 6], [4, 5], [5, 6], [6, 7]]
    assert (found.broken, found.formed) == (1 / 4, 1 / 4)
    assert found.spanning.tolist() == found.unbroken.tolist() == [2, 1]
    assert found.lifetime == pytest.approx((2 + 1) / 2 / 2)
    assert found.new_links(1).tolist() == [[2, 6]]
    # Grain 6 has lost no contact.
    assert np.flatnonzero(found.changed()).tolist() == [2]
    assert found.reattached == 1 / 4


def test_chains_form_anew_while_the_old_ones_break():
    """The columns exchange their upper halves: two chains still span, none of them unbroken."""
    swapped = APART.copy()
    swapped[[2, 3]], swapped[[6, 7]] = APART[[6, 7]], APART[[2, 3]]
    found = cell(APART, swapped, swapped)
    assert found.spanning.tolist() == [2, 2, 2]
    assert found.unbroken.tolist() == [2, 0, 0]
    assert found.lifetime == pytest.approx(0.25)
    assert (found.broken, found.formed) == (2 / 4, 2 / 4)
    assert found.new_links(2).tolist() == [[1, 6], [2, 5]]
    assert found.reattached == 1.0


def test_contacts_that_return_have_not_lasted():
    found = cell(APART, BESIDE, APART)
    assert found.spanning.tolist() == [2, 1, 2]
    assert found.unbroken.tolist() == [2, 1, 1]
    assert found.lasting(2, since=1).tolist() == [[0, 1], [2, 3], [4, 5], [5, 6], [6, 7]]
    assert found.reattached == 0.0


def test_a_contact_ends_at_a_wider_gap_than_it_begins():
    between = (CHAINED + CONTACT_ENDS) / 2 * R
    lifted, parted = (moved(APART, [2, 3], (0, 0, gap)) for gap in (between, 1.01 * CONTACT_ENDS * R))
    assert cell(APART, lifted).unbroken.tolist() == [2, 2]
    assert cell(APART, parted).unbroken.tolist() == [2, 1]
    # It does not begin at the gap at which it does not end.
    assert cell(parted, lifted).spanning.tolist() == [1, 1]


def test_a_grain_that_moves_along_its_own_chain_has_not_changed_chains():
    """Grain 2 moves from grain 6 to grain 5, which was in contact with 6."""
    found = cell(BESIDE, moved(BESIDE, [2], (0, 0, -2 * R)))
    assert [2, 5] in found.pairs(1).tolist()
    assert (found.broken, found.formed) == (2 / 4, 1 / 4)
    assert found.new_links(1).size == 0
    assert found.reattached == 0.0


def test_the_shortest_chain_leads_from_raft_to_raft():
    assert cell(BESIDE).shortest_chain().tolist() == [4, 5, 6, 7]
    assert cell(moved(APART, [2, 6], (0, 9 * UM, 0))).shortest_chain().size == 0


def test_chains_touch_across_the_sides_of_the_cell():
    across = cell(columns(x=1 * UM, apart=40 * UM - 2 * R))
    assert [1, 5] in across.pairs(0).tolist()
    # Each grain of one column touches one of the other: a chain may change sides, but none is gained.
    assert across.spanning.tolist() == [2]


def test_a_table_and_a_figure_of_followed_cells():
    swapped = APART.copy()
    swapped[[2, 3]], swapped[[6, 7]] = APART[[6, 7]], APART[[2, 3]]
    square = scene(sides=(40 * UM, 40 * UM, 60 * UM))
    cells = [cell(*[APART] * 50, *[swapped] * 51), cell(*[APART] * 30, *[swapped] * 71)]
    for one in cells:
        one.result.scene = square
    lines = [line.split(",") for line in chain_table(cells, cells[:1]).splitlines()]
    rows = {(cell, name): (mean, half, each) for cell, name, mean, half, each in lines[1:]}
    assert rows["sheared", "chains_unbroken_at_the_end"] == ("0", "0", "0 0")
    assert rows["sheared", "broken_contacts_per_free_grain"][0] == "0.5"
    assert rows["not sheared", "chains_at_the_end"] == ("2", "inf", "2")
    assert float(rows["sheared", "mean_life_of_a_chain_over_the_time"][0]) == pytest.approx(0.395)
    figure = reattachment_figure(cells, cells[:1])
    assert len(figure.axes) == 4
    np.testing.assert_allclose(figure.axes[3].lines[1].get_ydata()[[0, 40, 60]], [2, 1, 0])


def test_figures_of_sizes_that_are_not_run_are_refused():
    with pytest.raises(
        InputError, match="size must be one of default, polydisperse, which are run; received 'l21'"
    ):
        figures("l21", print)


@pytest.mark.slow
def test_contacts_break_and_form_only_if_a_cell_is_sheared():
    small = {"sides": (30 * UM, 30 * UM, 36 * UM), "raft": 7 * UM, "rate": 1e4, "magnetising": 10e-6,
             "strain": 0.4, "before": 0.2}  # fmt: skip
    (sheared,), (still,) = followed(small, 1)
    assert sheared.result.time == pytest.approx(still.result.time)
    assert sheared.broken > 0.3
    assert still.broken + still.formed < 0.1
    assert sheared.unbroken[0] > sheared.unbroken[-1]
    assert still.unbroken[0] == still.unbroken[-1] == still.spanning[-1]
