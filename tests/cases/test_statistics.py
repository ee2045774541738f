"""Means, claims and checks: what they hold, and what is shown of them."""

from tisim.analysis import Mean
from tisim.cases.case import Check
from tisim.cases.statistics import Claim, Shown


def test_claim_holds_when_all_of_the_interval_does():
    assert Claim("", Mean(0.5, 0.1), least=0.39).ok
    assert not Claim("", Mean(0.5, 0.1), least=0.41).ok
    assert Claim("", Mean(0.5, 0.1), most=0.61).ok
    assert not Claim("", Mean(0.5, 0.1), most=0.59).ok
    assert Claim("", Mean(0.5, 0.1), most=0.6).cells[:2] == ("0.50 ± 0.10", "below 0.6")


def test_what_is_shown_is_not_judged():
    assert Shown("", Mean(1.0, 0.5), "2").cells == ("1.00 ± 0.50", "2", "", "")
    assert Shown("", 1.23456).cells[0] == "1.235"
    assert Shown("", 1.0).ok is None


def test_checks_are_checks():
    assert Check("", 1.0, 1.0, 0.0).cells[3] == "0.0e+00"
