"""The inverse problem of capture: the filter, its objectives, and the result of a search."""

import numpy as np
import pytest

from tisim import InputError, Result, Status, run
from tisim.analysis import Mean
from tisim.cases.capture import problem as filters
from tisim.cases.capture.filter import CHANNEL_HEIGHT, CHANNEL_WIDTH, WIRE, Filter
from tisim.cases.capture.scene import SEARCH_SETTINGS
from tisim.cases.case import Claim
from tisim.cases.common.magnetic_fibre import FIBRE_DIAMETER as DIAMETER
from tisim.cases.common.magnetic_fibre import SATURATION_MAGNETISATION
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.report.comparison import FRESH
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.sources import MagneticCylinders, MagneticField

FIBRES = {"flux": 0.8, "field_angle": 90.0, "aspect": 2.5, "number": 8.2, "spacing": 3.0}


@pytest.mark.parametrize("number", [1, 5, 12])
def test_fibres_of_a_filter_lie_in_the_channel_and_apart(number):
    fibres = Filter(aspect=5 / 3, number=float(number), spacing=1.2)
    places = np.array(fibres.places())
    assert len(places) == number
    assert np.abs(places[:, 0]).max() <= (CHANNEL_WIDTH - DIAMETER) / 2 + 1e-12
    assert np.abs(places[:, 2]).max() <= (CHANNEL_HEIGHT - fibres.length) / 2 + 1e-12
    assert places[:, 1].min() == 0.0
    for k in range(number):
        gap = np.abs(places - places[k]) - [DIAMETER, DIAMETER, fibres.length]
        assert all((gap[j] > -1e-12).any() for j in range(number) if j != k)


def test_wire_is_limited():
    assert len(Filter(aspect=20.0, number=1.4).places()) == 1
    with pytest.raises(InputError, match=f"wire must be at most {WIRE:g} m"):
        Filter(aspect=20.0, number=1.6).places()


def test_every_individual_of_the_search_has_a_fibre():
    """This includes designs on the bounds, to which the methods clip."""
    genome = filters.problem(variant="fraction").genome
    for end in (0.0, 1.0):
        number = genome.decode([end] * len(genome))["number"]
        assert 1 <= len(Filter(number=number).places()) <= 12
    with pytest.raises(InputError, match="number of fibres must be at least 1; received 0"):
        Filter(number=0.5).scene(0)


def effect(scene, kind):
    return next(e for e in scene.effects if isinstance(e, kind))


@pytest.mark.parametrize("angle", [0.0, 30.0, 90.0])
def test_hard_magnets_are_saturated_along_their_gene_in_any_field(angle):
    """Angles are to the axis z, in the plane of x and z; the field determines the moments of soft magnets."""
    hard, soft = filters.problem(variant="hard"), filters.problem(variant="fraction")
    assert {*hard.genome.names} - {*soft.genome.names} == {"magnetisation_angle"}
    way = np.array([np.sin(np.radians(angle)), 0.0, np.cos(np.radians(angle))])
    fields = [{"flux": flux, "field_angle": to} for flux in (0.05, 1.0) for to in (20.0, 70.0)]
    for field in fields:
        scene = hard.scene({**FIBRES, **field, "magnetisation_angle": angle}, 0)
        for body in effect(scene, MagneticCylinders).cylinders:
            np.testing.assert_allclose(
                body.magnetisation, SATURATION_MAGNETISATION * way, atol=1e-9 * SATURATION_MAGNETISATION
            )
        x, _, z = effect(scene, MagneticField).constant
        assert np.hypot(x, z) == pytest.approx(field["flux"])
        assert np.degrees(np.arctan2(x, z)) == pytest.approx(field["field_angle"])
    soft_ones = [
        effect(soft.scene({**FIBRES, **f}, 0), MagneticCylinders).cylinders[0].magnetisation for f in fields
    ]
    assert len(set(soft_ones)) == len(fields)


def outcome_of(scene, caught_by):
    """A result in which all particles are at their start except those that a fibre has caught."""
    start = scene.particles.arrays(scene.domain, scene.seed)
    places = np.array([body.centre for body in effect(scene, MagneticCylinders).cylinders])
    stopped = caught_by >= 0
    position = np.where(stopped[:, None], places[caught_by] + [0, -DIAMETER / 2, 0], start["position"])
    state = {"position": position, "captured_by": caught_by}
    return Result(scene, state, start, scene.duration, {}, Status(True, ""), 0.0)


def test_objectives_are_the_fraction_caught_and_the_water_that_flows_through():
    problem = filters.problem(variant="throughput")
    caught, flow = problem.objectives
    caught_by = np.full(120, -1)
    caught_by[:30] = np.arange(30) % 8
    for speed in (1e-3, 2e-3):
        result = outcome_of(problem.scene({**FIBRES, "speed": speed, "radius": 50.0}, 0), caught_by)
        assert caught.of(result) == 0.25
        # Across the flow the channel is 6 by 20 diameters of 0.6 mm.
        assert flow.of(result) == pytest.approx(speed * 3.6e-3 * 12e-3)
        assert result.scene.particles.radius == pytest.approx(50e-9)
    assert (flow.unit, caught.unit) == ("m^3/s", "")
    # Costs are minimised, and both objectives are to be large.
    assert problem.costs([0.25, 1e-7]) == (-0.25, -1e-7)
    assert filters.problem(variant="hard").costs([0.25]) == (-0.25,)


def test_details_of_the_best_filter():
    strong = {**FIBRES, "flux": 1.0}
    details = filters.details(strong, None)
    assert details["fibres"] == 8
    assert details["length of a fibre, mm"] == pytest.approx(1.5)
    assert details["wire used, of what there is"] == pytest.approx(1.0)
    assert details["magnetisation to the axis, degrees"] == pytest.approx(90.0)
    assert details["magnetisation over saturation"] == pytest.approx(1.0)
    # In a weak field the magnetisation is proportional to the field and nearer to the axis than the field.
    weak, weaker = ({**FIBRES, "flux": flux, "field_angle": 45.0} for flux in (0.1, 0.05))
    shares = [filters.details(one, None)["magnetisation over saturation"] for one in (weak, weaker)]
    assert shares[0] == pytest.approx(2 * shares[1])
    assert shares[0] < 0.5
    assert 0 < filters.details(weak, None)["magnetisation to the axis, degrees"] < 40.0
    hard = filters.details({**weak, "magnetisation_angle": 75.0}, None)
    assert hard["magnetisation to the axis, degrees"] == pytest.approx(75.0)
    assert hard["magnetisation over saturation"] == pytest.approx(1.0)


def test_picture_shows_the_fibres_and_the_captured_particles():
    scene = Filter(**FIBRES).scene(0)
    caught_by = np.full(120, -1)
    caught_by[:30] = np.arange(30) % 8
    result = outcome_of(scene, caught_by)
    # At its largest scale such a high picture would be narrower.
    result.start["position"][-1, 0] = 4e-3
    figure = filters.caught(result)
    side, front = figure.axes
    figure.draw_without_rendering()
    assert side.bbox.intervalx == pytest.approx(front.bbox.intervalx), "z is in one place in both"
    assert side.get_xlim() == front.get_xlim()
    stopped = caught_by >= 0
    assert "25% caught" in side.get_title(loc="left")
    bodies = effect(scene, MagneticCylinders).cylinders
    for axis, k in ((side, 1), (front, 0)):
        boxes = [box.get_bbox() for box in axis.patches]
        corners = [(b.centre[2] - 750e-6, b.centre[k] - 300e-6) for b in bodies]
        np.testing.assert_allclose([box.min for box in boxes], 1e3 * np.array(corners), atol=1e-9)
        np.testing.assert_allclose([box.size for box in boxes], [(1.5, 0.6)] * 8)
        for line, (places, which) in zip(
            axis.lines,
            [(result.start, ~stopped), (result.start, stopped), (result.state, stopped)],
            strict=True,
        ):
            projected = 1e3 * places["position"][which][:, [2, k]]
            np.testing.assert_allclose(line.get_xydata(), projected, atol=1e-9)
    assert [line.get_label() for line in side.lines] == ["passed by", "caught", "where it was caught"]


def captured(variant, designs, starts):
    """Fractions from held-out seeds, which all designs share. Shape (designs, starts)."""
    problem = filters.problem(variant=variant)
    seeds = [start_seed(FRESH, k) for k in range(starts)]
    results = run([problem.scene(design, seed) for design in designs for seed in seeds])
    return np.reshape([filters.captured(result) for result in results], (len(designs), starts))


@pytest.mark.slow
def test_hard_magnets_are_best_magnetised_across_in_a_weak_field():
    """A strong field fixes the moments of particles, so that fibres repel them in some places."""
    across = {**FIBRES, "flux": 0.07, "spacing": 3.9, "magnetisation_angle": 90.0}
    along, strong = {**across, "magnetisation_angle": 0.0}, {**across, "flux": 0.8}
    best, *worse = captured("hard", (across, along, strong), 24)
    for name, other in zip(("magnetised along", "in a strong field"), worse, strict=True):
        assert Claim(name, Mean.of(best - other), least=0.03).ok


@pytest.mark.slow
def test_fibres_catch_only_particles_in_their_way_from_a_fast_flow():
    """The fraction is the part of the channel's cross-section that fibres cover; none is behind another."""
    half = {**FIBRES, "number": 4.0, "speed": 1e-2, "radius": 208.0}
    whole = {**half, "number": 8.0}
    for design in (half, whole):
        covered = round(design["number"]) * design["aspect"] * DIAMETER**2 / (CHANNEL_WIDTH * CHANNEL_HEIGHT)
        fraction = captured("throughput", (design,), 40)[0]
        assert Claim("fast", Mean.of(fraction), least=covered - 0.02, most=covered + 0.03).ok
    assert covered == pytest.approx(1 / 6)
    slow = captured("throughput", ({**whole, "speed": 1e-3},), 8)[0]
    assert Claim("slow", Mean.of(slow), least=covered + 0.05).ok


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_search_finds_transverse_and_short(tmp_path, seed):
    """A search reproduces B16's conclusions, and designs that contradict them are worse."""
    evaluator = BatchEvaluator()
    with Cache(tmp_path / "search.h5") as cache:
        problem = filters.problem(variant="fraction")
        outcome = search(problem, evaluator, cache, Settings(**SEARCH_SETTINGS, seed=seed))
    evaluator.close()
    design = problem.genome.decode(outcome.best)
    assert design["field_angle"] > 60.0
    assert design["aspect"] < 6.0
    across, along = ({**design, "field_angle": angle} for angle in (90.0, 0.0))
    one_long = {**design, "aspect": 20.0, "number": 1.0}
    # With this number of starts a difference of 0.04 has an error of 0.007.
    best, turned, *worse = captured("fraction", (design, across, along, one_long), 240)
    assert Claim("right across the field is as good", Mean.of(turned - best), least=-0.03).ok
    for name, other in zip(("along the field", "all wire in one fibre"), worse, strict=True):
        assert Claim(name, Mean.of(best - other), least=0.03).ok
