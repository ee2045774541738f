"""The common style of all figures."""

import numpy as np
import pytest
from matplotlib import colormaps

from tisim.plotting.style import TIME, empty, letters, quantity, scale_of, si, superscripts, symbols


def test_panels_have_letters_before_their_titles():
    axes = empty(4, 3).subplots(1, 3)
    axes[1].set_title("paths")
    letters(axes)
    assert [axis.get_title("left") for axis in axes] == ["(a)", "(b) paths", "(c)"]
    assert [axis.get_title() for axis in axes] == [""] * 3


@pytest.mark.parametrize(
    ("limits", "label", "tick"),
    [
        ((0, 2e-3), "time (ms)", "1"),
        ((-3e-6, 1e-6), "time (µs)", "1000"),
        ((0, 50), "time (s)", "0.001"),
        ((0, 2e-17), "time (10⁻¹⁸ s)", "1e+15"),
    ],
)
def test_an_axis_label_has_the_quantity_and_a_suitable_unit(limits, label, tick):
    axis = empty(4, 3).subplots()
    axis.set_xlim(*limits)
    quantity(axis.xaxis, "time", "s")
    assert axis.get_xlabel() == label
    assert axis.xaxis.get_major_formatter()(1e-3) == tick


def test_values_have_prefixes():
    assert [si(v, "m") for v in (0.0, 1e-3, 4.76e-4, 1234.0)] == ["0 m", "1 mm", "476 µm", "1.23 km"]


def test_powers_of_units_are_raised():
    assert superscripts("throughput (m^3/s), kg m^-2") == "throughput (m³/s), kg m⁻²"


def test_symbols_are_printed_as_such():
    assert symbols("b_f / b_0") == "$b_{f}$ / $b_{0}$"
    assert symbols("Pi (m^3)") == "Π (m³)"
    assert symbols("relative_velocity, Pink") == "relative_velocity, Pink"


def test_axes_are_logarithmic_if_values_span_decades():
    assert scale_of(np.array([1.0, 100.0])) == "log"
    for values in ([1.0, 20.0], [0.0, 100.0], [-1.0, 100.0], []):
        assert scale_of(np.array(values)) == "linear"


def test_colours_of_time_rise_evenly_in_lightness():
    """Rec. 709 luminance of the map rises monotonically, unlike a rainbow."""

    def rises(colours):
        light = colours[:, :3] ** 2.2 @ [0.2126, 0.7152, 0.0722]
        return bool((np.diff(light) > 0).all())

    at = np.linspace(0, 1, 50)
    assert rises(TIME(at))
    assert not rises(colormaps["turbo"](at))
