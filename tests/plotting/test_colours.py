"""Colours by a quantity: names, units, scales, materials; and the texts that describe a look."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure

from tests.scenes import scene
from tisim import InputError, Material
from tisim.plotting.colours import MATERIAL_COLOURS, colouring, scale, values_of
from tisim.plotting.look import USUAL, WHOLE_PICTURE, Look
from tisim.rendering.camera import Camera, ClipPlane

PLAIN = scene([(0, 0, 0)], [(0, 0, 0)])
STATE = {
    "position": np.zeros((4, 3)),
    "velocity": np.array([(3.0, 4, 0), (0, 0, 1), (0, 0, 0), (0, 2, 0)]),
    "radius": np.array([1.0, 2, 3, 4]),
    "orientation": np.ones((4, 4)),
    "id": np.arange(4),
}


def test_quantities_of_grains():
    assert values_of(STATE, "speed").tolist() == [5, 1, 0, 2]
    assert values_of(STATE, "velocity").tolist() == [5, 1, 0, 2]
    assert values_of(STATE, "velocity_y").tolist() == [4, 0, 0, 2]
    assert values_of(STATE, "radius").tolist() == [1, 2, 3, 4]
    for name in ("orientation", "heat", "radius_x", "velocity_w"):
        message = rf"colour must be one of id, position, radius, speed, velocity; received '{name}'"
        with pytest.raises(InputError, match=message):
            values_of(STATE, name)
    with pytest.raises(InputError, match="did you mean 'radius'"):
        values_of(STATE, "radus")


def test_units_are_in_the_legend():
    for name, label in (("speed", "speed (m/s)"), ("radius", "radius (m)"), ("id", "id")):
        figure = Figure()
        found = colouring(PLAIN, [STATE], name)
        found.legend(figure, figure.subplots())
        assert figure.axes[-1].get_ylabel() == label


def test_a_quantity_is_only_chosen_if_it_distinguishes():
    assert colouring(PLAIN, [STATE]) is None
    hot = {**STATE, "temperature": np.arange(4) + 300.0}
    assert colouring(PLAIN, [hot]).name == "temperature"
    assert colouring(PLAIN, [hot, STATE]) is None
    steel = SimpleNamespace(materials={"steel": Material()})
    both = SimpleNamespace(materials={"steel": Material(), "rubber": Material()})
    made = {**STATE, "material": np.array([0, 1, 1, 0])}
    assert colouring(steel, [made]) is None
    found = colouring(both, [made])
    assert found.names == ("steel", "rubber")
    np.testing.assert_array_equal(found.of(made), MATERIAL_COLOURS[[0, 1, 1, 0]])
    assert colouring(PLAIN, []) is None


def test_one_scale_covers_all_states(rng):
    low, high = ({**STATE, "radius": factor * STATE["radius"]} for factor in (1.0, 3.0))
    found = colouring(PLAIN, [low, high], "radius")
    assert (found.norm.vmin, found.norm.vmax) == (1.0, 12.0)
    assert not np.allclose(found.of(low), found.of(high))


def test_scales():
    norm, beyond = scale(np.linspace(1, 2, 50))
    assert (type(norm), norm.vmin, norm.vmax, beyond) == (Normalize, 1, 2, "neither")
    norm, beyond = scale(np.geomspace(1, 1000, 50))
    assert (type(norm), norm.vmin, norm.vmax) == (LogNorm, 1, 1000)
    # A few grains that are much faster do not make all others one colour.
    norm, beyond = scale(np.array([*np.linspace(0, 1, 500), 1e6]))
    assert norm.vmax < 2
    assert beyond == "max"
    norm, _ = scale(np.full(5, 7.0))
    assert 0.01 < norm.vmax - norm.vmin < 0.2
    for values in (np.empty(0), np.zeros(3), np.full(3, 1e-200)):
        norm, _ = scale(values)
        assert norm.vmin < norm.vmax


def test_values_that_are_not_numbers_have_a_colour():
    state = {**STATE, "radius": np.array([1.0, np.nan, 3, np.inf])}
    found = colouring(PLAIN, [state], "radius")
    assert (found.norm.vmin, found.norm.vmax) == (1.0, 3.0)
    assert np.isfinite(found.of(state)).all()


def test_texts_describe_a_look():
    assert Look.of() == USUAL
    look = Look.of("speed", "30,-20", "0.1,0.9,0,0.5", ("y<0.01", " z > -2e-3 "))
    assert look == Look(
        Camera(30.0, -20.0), "speed", (ClipPlane((0, 1, 0), 0.01), ClipPlane((0, 0, -1), 2e-3)),
        (0.1, 0.9, 0.0, 0.5),
    )  # fmt: skip
    assert Look.of(view="0,90").crop == WHOLE_PICTURE


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"view": "30"}, "view must be 2 numbers, azimuth,elevation in degrees; received '30'"),
        ({"view": "a,b"}, "view must be 2 numbers"),
        ({"view": "nan,0"}, "view must be 2 numbers"),
        ({"view": "0,91"}, "elevation of the view must be -90 to 90 degrees; received 91"),
        ({"crop": "0,1,0"}, "crop must be 4 numbers, left,right,bottom,top of the picture; received '0,1,0'"),
        ({"crop": "0.5,0.5,0,1"}, "crop must be 0 <= left < right <= 1 and 0 <= bottom < top <= 1"),
        ({"crop": "-1,1,0,1"}, "crop must be 0 <= left"),
        ({"clip": ("y=1",)}, "clip must be a part of space that is kept, such as y<0.01 .m.; received 'y=1'"),
        ({"clip": ("w<1",)}, "clip must be"),
        ({"clip": ("x<one",)}, "clip must be"),
        ({"clip": ("x<inf",)}, "clip must be"),
    ],
)
def test_texts_that_describe_no_look_are_refused(texts, message):
    with pytest.raises(InputError, match=message):
        Look.of(**texts)
