"""Published values of L21 for spun-up piles: section 4.3.2."""

from __future__ import annotations

DEFORMATION = {0.0: 600e-6, 119.0: 600e-6, 1190.0: 700e-6}
"""The angular velocity (rad/s) of the first significant deformation by magnetisation (A/m)."""
DISRUPTION = {0.0: 700e-6, 119.0: 700e-6, 1190.0: 800e-6}
"""The angular velocity (rad/s) at which grains were shed, by magnetisation (A/m)."""
