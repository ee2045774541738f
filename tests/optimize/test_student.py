import pytest

from optimize.student import student_t
from tisim.errors import InputError


# NIST/SEMATECH e-Handbook 1.3.6.7.2, two-sided 95 %; and t_1 = tan(0.475 pi)
@pytest.mark.parametrize(
    ("degrees", "t"),
    [(1, 12.706), (2, 4.303), (3, 3.182), (10, 2.228), (11, 2.201), (30, 2.042), (100, 1.984)],
)
def test_published_values(degrees, t):
    assert student_t(degrees) == pytest.approx(t, abs=5e-4)


def test_closed_forms():
    assert student_t(1) == pytest.approx(12.706204736174705, rel=1e-13)
    assert student_t(2) == pytest.approx(0.95 * (2 / (1 - 0.95**2)) ** 0.5, rel=1e-13)
    assert student_t(20000) == pytest.approx(1.959963985, rel=1e-4)


def test_bad_degrees():
    with pytest.raises(InputError, match="degrees of freedom must be >= 1; received 0"):
        student_t(0)
