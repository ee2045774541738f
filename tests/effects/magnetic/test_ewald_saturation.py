"""Saturating moments in the field of all images: Langevin, and Froehlich and Kennelly."""

import math

import numpy as np
import pytest

from tests.effects.contact.loads import close, loads
from tests.effects.magnetic.ewald import EwaldSum
from tests.effects.magnetic.magnets import K_B, MU_0
from tests.effects.magnetic.test_ewald import WAVES, box
from tests.effects.magnetic.test_froehlich import magnetisation
from tests.scenes import scene
from tisim.effects import EwaldDipoleDipole, EwaldFroehlichMoment, EwaldLangevinMoment, Magnetophoresis
from tisim.sources import MagneticField


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["langevin", "froehlich"])
def test_saturating_moments_follow_the_field_of_all_images(kind, rng):
    """Each moment follows from the law and the local field, which is the field of the sources plus the Ewald
    sum of the other moments. This sum is not negligible, and the samples have poles."""
    place = 1.1 * np.argwhere(np.ones((3, 4, 4)))[:40] + rng.uniform(-0.05, 0.05, (40, 3)) + (-0.8, 0.3, 0.7)
    settings = {"cutoff": 1.45, "waves": WAVES, "accuracy": 1e-3, "demagnetising_factors": (0.1, 0.2, 0.3)}
    field, scenes = np.array([0.1, 0.0, 0.3]), []
    for strength in (0.3, 3.0):
        if kind == "langevin":
            law = EwaldLangevinMoment(temperature=300.0, tolerance=1e-13, **settings)
            quantities = {"saturation_moment": 2e5 * strength, "domain_moment": 10 * K_B * 300.0}
        else:
            law = EwaldFroehlichMoment(susceptibility=50.0, saturation=3e5, tolerance=1e-13, **settings)
            quantities = {}
        applied = MagneticField(constant=tuple(strength * field))
        effects = (applied, law, Magnetophoresis(), EwaldDipoleDipole(**settings))
        scenes.append(
            scene(place, 0 * place, effects, radius=0.5, mass=1.0, domain=box(), quantities=quantities)
        )
    for one, strength, state in zip(scenes, (0.3, 3.0), loads(scenes, capacity=40), strict=True):
        m = state["moment"]
        law = one.effects[1]
        others = EwaldSum(law, one.domain, state["position"], m).field()
        b = strength * field + others
        size = np.linalg.norm(b, axis=1)
        if kind == "langevin":
            x = 10 * size
            expected = state["saturation_moment"] * (1 / np.tanh(x) - 1 / x)
        else:
            volume = math.pi / 6
            expected = volume * np.array([magnetisation(law.susceptibility, law.saturation, a) for a in size])
            # Far from the linear response in weak fields.
            assert expected.max() < 0.9 * volume * 3 / MU_0 * 50 / 53 * size.max()
        close(m, (expected / size)[:, None] * b, 1e-10)
        assert np.linalg.norm(others, axis=1).max() > 0.02 * strength * np.linalg.norm(field)
