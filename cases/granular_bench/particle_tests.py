"""The eight tests of Chung and Ooi (2011) for particle impacts, as lists of impacts.

1 elastic, two equal spheres. 2 elastic, a sphere and a rigid plane. 3 other coefficients of restitution at
the plane. 4 oblique, one speed at several angles to the plane. 5 oblique, one normal velocity and several
tangential ones. 6 a spinning sphere at the plane. 7 two equal spheres with the same spin, so that their
surfaces slide past each other. 8 a spinning sphere and one at rest that is five times as wide and a thousand
times as dense, rigid or of the same stiffness.
"""

from typing import Any

import numpy as np

from tisim.cases.granular_bench.impacts import ParticleImpact

RESTITUTIONS = (0.2, 0.4, 0.6, 0.8, 1.0)
IMPACT_ANGLES = (2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 60.0, 70.0, 80.0, 85.0)
"""The angles of incidence of test 4 to the normal, degrees."""
SLIDES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 12.0, 14.0)
"""The tangential velocities of test 5 over mu times the normal velocity."""
SPINS = (0.2, 0.5, 0.9, 1.3, 2.0, 3.0, 4.0, 5.0, 7.0, 9.0, 12.0, 16.0, 22.0)
"""The spins of tests 6 to 8, rad/s."""
SPINNING: dict[str, Any] = {"radius": 0.1, "speed": 0.2, "restitution": 0.5, "friction": 0.4}
OBLIQUE: dict[str, Any] = {"radius": 2.5e-3, "restitution": 0.98, "friction": 0.092}
OBLIQUE_SPEED, FINE_SPEED, FINE_FRICTION = 3.9, 5.0, 0.3


def oblique(substance: str, angle: float) -> ParticleImpact:
    """Return an impact of test 4, at an angle (degrees) to the normal."""
    turn = np.radians(angle)
    return ParticleImpact(
        substance, speed=OBLIQUE_SPEED * np.cos(turn), sideways=OBLIQUE_SPEED * np.sin(turn), **OBLIQUE
    )


def sideways(substance: str, slide: float) -> ParticleImpact:
    """Return an impact of test 5; slide : tangential velocity over mu times the normal velocity."""
    return ParticleImpact(
        substance, 1e-5, FINE_SPEED, friction=FINE_FRICTION, sideways=slide * FINE_FRICTION * FINE_SPEED
    )


def spinning(substance: str, spin: float, partner: str) -> ParticleImpact:
    """Return an impact of tests 6, 7 and 8 with a spin (rad/s)."""
    return ParticleImpact(substance, spin=spin, partner=partner, **SPINNING)


ELASTIC = tuple(ParticleImpact(one, 0.01, 10.0, partner="equal") for one in ("glass", "limestone"))
ELASTIC_PLANE = tuple(ParticleImpact(one, 0.1, 0.2) for one in ("aluminium alloy", "magnesium alloy"))
DAMPED = tuple(
    ParticleImpact(one, 2.5e-3, 3.9, restitution=e)
    for one in ("aluminium oxide", "cast iron")
    for e in RESTITUTIONS
)
OBLIQUES = tuple(oblique(one, a) for one in ("aluminium oxide", "aluminium alloy 2") for a in IMPACT_ANGLES)
SIDEWAYS = tuple(sideways(one, s) for one in ("steel", "polyethylene") for s in SLIDES)
SPINNING_PLANE = tuple(
    spinning(one, spin, "plane") for one in ("aluminium alloy 2", "nylon") for spin in SPINS
)
SPINNING_EQUAL = tuple(
    spinning(one, spin, "equal") for one in ("aluminium alloy 2", "copper") for spin in SPINS
)
UNEQUAL = tuple(
    spinning(one, spin, partner)
    for one in ("aluminium alloy 2", "nylon")
    for partner in ("large rigid", "large")
    for spin in SPINS
)
TESTS = {
    1: ELASTIC, 2: ELASTIC_PLANE, 3: DAMPED, 4: OBLIQUES, 5: SIDEWAYS, 6: SPINNING_PLANE, 7: SPINNING_EQUAL,
    8: UNEQUAL,
}  # fmt: skip
"""The impacts of each test, by its number."""
