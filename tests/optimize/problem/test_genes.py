"""Whole numbers and choices in the unit cube: cells, their centres, and the inverse map."""

import math

import numpy as np
import pytest

from tisim import InputError, optimize
from tisim.optimize import Choice, DependentGene, FixedGene, Gene, Genome

BLADES = Gene("blades", "", 2, 7, integer=True)
CELLS = Gene("cells", "", 1, 1000, "log", integer=True)
WALL = Choice("wall", ("flat", "round", "bumpy"))
GRID = Choice("grid", (32, 64, 128, 256), ordered=True)
SPEED = Gene("speed", "m/s", 1.0, 20.0)
HARDNESS = Gene("hardness", "Pa", 1e5, 1e9, "log")
OPEN = Choice("open", (False, True))
GENOME = Genome((SPEED, BLADES, WALL, CELLS, HARDNESS, GRID, OPEN))
POINTS = np.random.default_rng(5).random((4000, len(GENOME)))


def test_values_are_of_their_own_type():
    design = GENOME.decode(np.full(7, 0.5))
    assert design == {
        "speed": 10.5, "blades": 5, "wall": "round", "cells": 22, "hardness": pytest.approx(1e7),
        "grid": 128, "open": True,
    }  # fmt: skip
    assert [type(design[name]) for name in GENOME.names] == [float, int, str, int, float, int, bool]
    assert GENOME.kinds == ("real", "integer", "category", "integer", "real", "ordered", "category")


@pytest.mark.parametrize("gene", [BLADES, CELLS])
def test_whole_numbers_reach_both_ends(gene):
    assert (gene.decode(0.0), gene.decode(1.0)) == (gene.low, gene.high)


def test_every_whole_number_and_choice_is_equally_likely():
    """Chi-squared test of 40000 draws; the bound is exceeded with a probability of 1e-6."""
    points = np.random.default_rng(6).random(40000)
    for gene, number in ((BLADES, 6), (WALL, 3), (GRID, 4), (OPEN, 2)):
        _, counts = np.unique([gene.decode(u) for u in points], return_counts=True)
        assert len(counts) == number
        expected = len(points) / number
        assert np.sum((counts - expected) ** 2 / expected) < 35.0


def test_a_whole_number_has_its_share_of_a_log_scale():
    """k takes the interval from k - 1/2 to k + 1/2 of the logarithmic scale from 0.5 to 1000.5."""
    values = np.array([CELLS.decode(u) for u in np.random.default_rng(7).random(40000)])
    for k in (1, 2, 10, 100):
        share = math.log((k + 0.5) / (k - 0.5)) / math.log(1000.5 / 0.5)
        assert np.mean(values == k) == pytest.approx(share, abs=5 * math.sqrt(share / 40000))


def test_decoded_designs_are_encoded_to_the_last_bit():
    """Otherwise a warm start would repeat runs that a table already has."""
    for point in POINTS[:500]:
        design = GENOME.decode(point)
        assert GENOME.decode(GENOME.encode(design)) == design
    for gene in (
        Gene("x", "", -3e-7, 5e3),
        Gene("y", "", 1e-9, 1e9, "log"),
        Gene("z", "", 1.0, 1.0001, "log"),
    ):
        for u in [*POINTS[:500, 0], 0.0, 1.0, 1e-12, 1 - 1e-12]:
            assert gene.decode(gene.encode(gene.decode(u))) == gene.decode(u)


def test_every_whole_number_and_choice_is_at_the_centre_of_its_cell():
    for gene, values in (
        (BLADES, range(2, 8)), (CELLS, range(1, 1001)), (WALL, WALL.choices), (GRID, GRID.choices),
        (Gene("big", "", -(10**9), 10**9, integer=True), (-(10**9), -1, 0, 10**9)),
    ):  # fmt: skip
        for value in values:
            u = gene.encode(value)
            assert gene.decode(u) == value
            np.testing.assert_allclose(gene.snap(np.array([u])), u, rtol=1e-14)


def test_points_of_one_design_have_one_representative_and_one_row_of_features():
    points, canonical = POINTS.copy(), GENOME.canonical(POINTS)
    points[:, [0, 4]] = 0.25  # only genes with cells are compared
    by_design = {}
    for point, row in zip(GENOME.canonical(points), GENOME.features(points), strict=True):
        by_design.setdefault(tuple(GENOME.decode(point).items()), set()).add((tuple(point), tuple(row)))
    assert len(by_design) > 1000
    assert all(len(rows) == 1 for rows in by_design.values())
    for before, after in zip(POINTS[:500], canonical[:500], strict=True):
        assert GENOME.decode(before) == GENOME.decode(after)
    np.testing.assert_array_equal(canonical[:, [0, 4]], POINTS[:, [0, 4]])
    np.testing.assert_array_equal(GENOME.canonical(POINTS[0]), canonical[0])


def test_two_categories_are_at_distance_1_and_ordered_ones_by_their_places():
    walls = np.array([[WALL.encode(wall)] for wall in WALL.choices])
    rows = Genome((WALL,)).features(walls)
    distances = np.linalg.norm(rows[:, None] - rows[None], axis=2)
    np.testing.assert_allclose(distances, 1.0 - np.eye(3))
    grids = np.array([[GRID.encode(grid)] for grid in GRID.choices])
    np.testing.assert_allclose(Genome((GRID,)).features(grids)[:, 0], [0.125, 0.375, 0.625, 0.875])
    assert GENOME.features(POINTS).shape == (4000, 10)
    assert GENOME.feature_genes.tolist() == [0, 1, 2, 2, 2, 3, 4, 5, 6, 6]


def test_fixed_and_dependent_genes_are_in_the_design_and_not_in_the_cube():
    genome = Genome(
        (
            DependentGene("area", "m^2", lambda design: design["width"] * design["height"]),
            Gene("width", "m", 1.0, 2.0), FixedGene("height", 3.0, "m"), FixedGene("lid", True),
            DependentGene("volume", "m^3", lambda design: 2 * design["area"]),
        )
    )  # fmt: skip
    assert len(genome) == 1
    design = genome.decode([0.5])
    assert design == {"area": 4.5, "width": 1.5, "height": 3.0, "lid": True, "volume": 9.0}
    assert list(design) == list(genome.names)
    assert genome.encode(design) == pytest.approx([0.5])
    assert genome.encode({"width": 1.5}) == pytest.approx([0.5])
    with pytest.raises(InputError, match=r"^gene height must be 3.0 m, fixed; received 4.0"):
        genome.encode({"width": 1.5, "height": 4.0})


def test_a_dependent_gene_cannot_change_the_design():
    def meddle(design):
        design["x"] = 5.0
        return 1.0

    with pytest.raises(InputError, match=r"dependent gene y must return .*; received TypeError"):
        Genome((Gene("x", "", 0, 1), DependentGene("y", "", meddle))).decode([0.5])


@pytest.mark.parametrize(
    ("of", "received"),
    [
        (lambda design: design["other"], r"KeyError: 'other' \(test_genes.py, line \d+\)"),
        (lambda design: None, "None"),
        (lambda design: design["x"] / 0.0, "ZeroDivisionError"),
        (lambda design: math.nan, "nan"),
        (lambda design: 1j, "1j"),
        (lambda design: [1.0], r"\[1.0\]"),
    ],
)
def test_a_faulty_dependent_gene_is_reported_in_a_line(of, received):
    rule = "dependent gene y must return a finite number, a text or a flag"
    with pytest.raises(InputError, match=rf"^{rule}; received {received}"):
        Genome((Gene("x", "", 0, 1), DependentGene("y", "", of))).decode([0.5])


def test_numpy_values_become_python_values():
    genome = Genome((
        Choice("n", (np.int64(1), np.float32(2.5), "auto")), FixedGene("f", np.bool_(True)),
        DependentGene("d", "", lambda design: np.float64(2.0)),
    ))  # fmt: skip
    assert [type(value) for value in genome.decode([0.4]).values()] == [float, bool, float]
    assert genome.encode({"n": np.int64(1)}) == pytest.approx([1 / 6])


def test_a_row_of_a_table_is_a_design():
    """Headings with or without units, and text values from a CSV file."""
    row = {"rank": "1", "speed (m/s)": "2.5", "blades": "3.0", "wall": "round", "cells": "1e2",
           "hardness": "1e6", "grid": "64.0", "open": "True", "Pi": "0.3"}  # fmt: skip
    assert GENOME.parse(row) == {
        "speed": 2.5, "blades": 3, "wall": "round", "cells": 100, "hardness": 1e6, "grid": 64, "open": True,
    }  # fmt: skip
    with pytest.raises(InputError, match=r"^columns must be of all genes, wall among them; received"):
        GENOME.parse({key: value for key, value in row.items() if key != "wall"})
    with pytest.raises(InputError, match=r"^gene wall must be one of 'flat', 'round', 'bumpy'; received 'x'"):
        GENOME.parse({**row, "wall": "x"})
    with pytest.raises(InputError, match=r"^gene blades must be a number; received 'many'"):
        GENOME.parse({**row, "blades": "many"})


def test_genes_are_fixed_by_name():
    genome = GENOME.fix(wall="bumpy", blades=4, speed=2)
    assert len(genome) == len(GENOME) - 3
    assert genome.names == GENOME.names
    design = genome.decode(np.full(4, 0.5))
    assert (design["wall"], design["blades"], design["speed"]) == ("bumpy", 4, 2.0)
    with pytest.raises(InputError, match=r"^gene wall must be one of 'flat', .*; received 'steep'"):
        GENOME.fix(wall="steep")
    with pytest.raises(InputError, match=r"^gene to fix must be one of speed, blades, .*; received 'sped'"):
        GENOME.fix(sped=1.0)


DESIGN = GENOME.decode(np.full(7, 0.5))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GENOME.encode({**DESIGN, "speed": 20.5}), r"gene speed must be a number within 1..20 m/s;"),
        (lambda: GENOME.encode({**DESIGN, "speed": math.nan}), r"gene speed must be a number within"),
        (lambda: GENOME.encode({**DESIGN, "speed": "2"}), r"gene speed must be a number within"),
        (lambda: GENOME.encode({**DESIGN, "blades": 2.5}), r"gene blades must be a whole number within 2..7"),
        (lambda: GENOME.encode({**DESIGN, "blades": True}), r"gene blades must be a whole number within"),
        (lambda: GENOME.encode({**DESIGN, "wall": "steep"}), r"gene wall must be one of 'flat', "),
        (lambda: GENOME.encode({**DESIGN, "open": 1}), r"gene open must be one of False, True; received 1"),
        (lambda: GENOME.encode({**DESIGN, "sped": 1}), r"design must be of the genes speed, .*; received "),
        (lambda: GENOME.encode({"speed": 2.0}), r"design must be of the genes speed, blades"),
        (lambda: Gene("n", "", 1.5, 3, integer=True), r"low of integer gene n must be a whole number within"),
        (lambda: Gene("n", "", 1, 2**60, integer=True), r"high of integer gene n must be a whole"),
        (lambda: Gene("n", "", 0, 3, "log", integer=True), r"low of gene n on a log scale must be > 0"),
        (lambda: Gene("n", "", 3, 3, integer=True), r"range of gene n must be finite with low < high"),
        (lambda: Choice("c", "abc"), r"choices of c must be a list of texts, numbers or flags"),
        (lambda: Choice("c", ("a",)), r"choices of c must be two or more; received \['a'\]"),
        (lambda: Choice("c", ("a", "a")), r"choices of c must be all different"),
        (lambda: Choice("c", ("1", 1)), r"choices of c must be all different, also as texts"),
        (lambda: Choice("c", (1, True)), r"choices of c must be "),
        (lambda: Choice("c", (2.5, True)), r"choices of c must be without flags among numbers"),
        (lambda: Choice("c", ("a", math.inf)), r"choice of c must be finite"),
        (lambda: Choice("c", ("a", "b\n")), r"choice of c must be a printable text"),
        (lambda: Choice("c", ("a", "b" * 41)), r"choice of c must be a printable text of at most 40"),
        (lambda: Choice("c", ("a", None)), r"choice of c must be a text, a number or a flag; received None"),
        (lambda: FixedGene("f", [1]), r"fixed gene f must be a text, a number or a flag; received \[1\]"),
        (lambda: DependentGene("d", "", 3.0), r"function 'of' of dependent gene d must be a function"),
        (lambda: Genome((FixedGene("f", 1),)), r"genome must be one gene or more that is searched"),
        (lambda: Genome(("x",)), r"gene must be a Gene, Choice, FixedGene or DependentGene; received 'x'"),
    ],
)  # fmt: skip
def test_impossible_values_are_refused(make, message):
    with pytest.raises(InputError, match=f"^{message}"):
        make()


def test_ranges_and_formulas_of_genes_are_part_of_the_search():
    def of(**changes):
        genes = {
            "n": Gene("n", "", 1, 4, integer=True), "c": Choice("c", ("a", "b")), "f": FixedGene("f", 1.0),
            "d": DependentGene("d", "", lambda design: design["n"]), **changes,
        }  # fmt: skip
        problem = optimize.Problem.of_function(lambda design: 0.0, tuple(genes.values()), name="p")
        return optimize.settings.identity(problem, optimize.Settings(), {})

    assert of() == of()
    others = (
        {"n": Gene("n", "", 1, 4)}, {"n": Gene("n", "", 1, 5, integer=True)}, {"c": Choice("c", ("b", "a"))},
        {"c": Choice("c", ("a", "b"), ordered=True)}, {"f": FixedGene("f", 2.0)},
        {"d": DependentGene("d", "", lambda design: -design["n"])},
    )  # fmt: skip
    assert len({str(of(**changes)) for changes in ({}, *others)}) == 1 + len(others)
