"""Accuracy parameters: settings of a part of a scene that trade accuracy for time."""

from __future__ import annotations

from typing import TypeVar

from pydantic import BaseModel


def three_digits(value: float) -> float:
    """Return a setting rounded to three digits, so that it is easy to read."""
    return float(f"{value:.3g}")


Part = TypeVar("Part", bound=BaseModel)


class AccuracyParameter:
    """A group of settings of a part that together control an error, each with its order.

    ``AccuracyParameter(error=1)``: the error is proportional to the setting. ``AccuracyParameter(dt=2)``: the
    error is proportional to dt^2. ``AccuracyParameter(longest=2, tolerance=1)``: two settings that are varied
    together. ``AccuracyParameter(attempts=-1)``: the error is inversely proportional to a number of attempts.
    A part lists its own in ``accuracy_parameters``, and ``tisim cost`` varies them.

    converges : whether the error of the part vanishes with the parameter; False if another setting, which is
        not varied, also limits the error. Its order then only spaces the values that are tried.
    """

    def __init__(self, *, converges: bool = True, **orders: float) -> None:
        self.orders, self.converges = orders, converges

    def turned(self, part: Part, decades: float) -> Part:
        """Return the part with settings for an error larger by a number of decades; the part itself for 0.

        Settings are rounded to three digits, and whole numbers remain whole. Raise InputError if the part
        cannot have them.
        """
        if decades == 0:
            return part
        values = {name: getattr(part, name) for name in type(part).model_fields}
        for name, order in self.orders.items():
            value = three_digits(values[name] * 10 ** (decades / order))
            values[name] = round(value) if type(part).model_fields[name].annotation is int else value
        return type(part)(**values)
