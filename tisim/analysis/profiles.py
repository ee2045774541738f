"""Profiles along an axis: means over the particles in layers, and their granular temperature."""

from __future__ import annotations

import numpy as np


def layer_means(position: np.ndarray, values: np.ndarray, edges: np.ndarray, axis: int = 2) -> np.ndarray:
    """Return the mean of particle values in each layer between ``edges`` (m, increasing) along an axis; NaN
    for empty layers; shape (edges - 1,), or (edges - 1, k) for values of shape (n, k)."""
    values = np.asarray(values, float)
    layer, inside = layers(position, edges, axis)
    columns = values[inside].reshape(int(inside.sum()), -1).T
    number = np.bincount(layer, minlength=len(edges) - 1).astype(float)
    number[number == 0] = np.nan
    means = np.column_stack([np.bincount(layer, one, len(number)) / number for one in columns])
    return means.reshape(len(number), *values.shape[1:])


def granular_temperature(
    position: np.ndarray, velocity: np.ndarray, edges: np.ndarray, axis: int = 2
) -> np.ndarray:
    """Return the granular temperature in each layer between ``edges`` (m, increasing) along an axis, m^2/s^2;
    NaN for fewer than three particles; shape (edges - 1,).

        T = sum |v - u(x)|^2 / (3 n - 6),    u(x) = a + b x

    x is the coordinate along the axis, and u a least-squares line through the velocities of the n particles
    of the layer, so that the mean flow and its shear do not contribute. Its six parameters are subtracted
    from the degrees of freedom, so that T is unbiased for few particles too.

    position : m, velocity : m/s, shape (n, 3).

    Source: I. Goldhirsch, Powder Technol. 182 (2008) 130, for the fluctuation about a mean flow that varies.
    """
    layer, inside = layers(position, edges, axis)
    number = np.bincount(layer, minlength=len(edges) - 1)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(layer, values, len(number)) / np.maximum(number, 1)

    x, squares = np.asarray(position, float)[inside, axis], np.zeros(len(number))
    x = x - mean(x)[layer]
    spread = mean(x**2)
    for v in np.asarray(velocity, float)[inside].T:
        c = v - mean(v)[layer]
        slope = mean(c * x) / np.where(spread > 0, spread, 1.0)
        squares += number * mean((c - slope[layer] * x) ** 2)
    freedom = np.where(number >= 3, 3.0 * number - 6.0, np.nan)
    return np.asarray(squares / freedom)


def layers(position: np.ndarray, edges: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the layer, between ``edges`` (m, increasing) along an axis, of each particle inside, and a mask
    of these particles."""
    layer = np.searchsorted(edges, np.asarray(position)[:, axis], side="right") - 1
    inside = (layer >= 0) & (layer < len(edges) - 1)
    return layer[inside], inside
