"""Dipoles in one group or clump interact as usual, although contacts within it do not."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.effects.contact.loads import close, loads
from tests.effects.magnetic.magnets import MU_0, dipole_field
from tests.scenes import fixed
from tests.throwaway import Bridge
from tisim import Box, Clump, Open, Particles, Scene
from tisim.effects import (
    EwaldDipoleDipole,
    EwaldInducedMoment,
    Magnetophoresis,
    MutualInducedMoment,
    PrescribedMotion,
    RigidClumps,
    TruncatedDipoleDipole,
    ewald_settings,
)
from tisim.sources import MagneticField

FIELD = np.array([0.1, 0.0, 1.0])
"""T."""
PULL = 1e6
"""N; force of each contact, about as large as the dipole forces."""
GAIN = 4 * np.pi / MU_0 * 50 / 53
"""A m^2 / T, of an isolated sphere of 1 m."""
GROUP, FREE = (2, 3), 4
"""The held pair that touches in a column along z, and the free grain that touches its upper one; 0 and 1 are
a clump."""
SIDE = 12.0


def bodies(*laws, domain=None):
    """A tilted clump of two, and a column of three of which two are held."""
    turn = np.roll(Rotation.from_euler("xy", [0.5, 0.3]).as_quat(), 1)
    column = np.array([[6.0, 3.0, 3.0], [6.0, 3.0, 5.0], [6.0, 3.0, 6.99]])
    spheres = Particles(
        position=column, velocity=0 * column, radius=1.0, mass=1.0, quantities={"group": [1, 1, 0]}
    )
    clump = Clump(centres=[(0, 0, -1), (0, 0, 0.99)], radii=[1.0], density=1.0)
    return Scene(
        particles=Particles.of_clumps(clump, [(3.0, 4.0, 4.0)], orientation=turn, spheres=spheres),
        effects=(
            RigidClumps(),
            PrescribedMotion(group=1),
            MagneticField(constant=tuple(FIELD)),
            Magnetophoresis(),
            Bridge(pull=PULL, rupture=0.1),
            *laws,
        ),
        domain=domain or Open(),
        stepper=fixed(1e-9),
        duration=1e-9,
    )


def bridges(r):
    """Contact forces: from the only contact that is not within a body."""
    pull = np.zeros((5, 3))
    pull[3] = PULL * (r[4] - r[3]) / np.linalg.norm(r[4] - r[3])
    pull[4] = -pull[3]
    return pull


def force_of(r, m, i, others):
    """Dipole force on particle i, N."""
    force = np.zeros(3)
    for j in others:
        d = np.linalg.norm(r[j] - r[i])
        n = (r[j] - r[i]) / d
        a, b = m[i] @ n, m[j] @ n
        force -= 3 * MU_0 / (4 * np.pi * d**4) * (a * m[j] + b * m[i] + (m[i] @ m[j] - 5 * a * b) * n)
    return force


@pytest.mark.slow
def test_a_cut_off_beyond_all_is_a_sum_over_all_pairs():
    """Moments equal a linear solve, and forces the sum over all dipoles plus the contacts between bodies.
    Pairs within a body store no history."""
    moments = MutualInducedMoment(susceptibility=50.0, tolerance=1e-14, cutoff=50.0)
    (state,) = loads([bodies(moments, TruncatedDipoleDipole(cutoff=50.0))])
    r, influence = state["position"], dipole_field(state["position"])
    matrix = np.eye(15) - GAIN * influence.transpose(0, 2, 1, 3).reshape(15, 15)
    m = np.linalg.solve(matrix, GAIN * np.tile(FIELD, 5)).reshape(5, 3)
    close(state["moment"], m, 1e-12)
    # The upper of the two held grains magnetises the lower one.
    assert np.linalg.norm(m[2]) > 1.3 * GAIN * np.linalg.norm(FIELD)
    close(state["force"], bridges(r) + [force_of(r, m, i, set(range(5)) - {i}) for i in range(5)], 1e-11)
    remembered = {tuple(sorted((i, j))) for i in range(5) for j in state["bridge_partners"][i] if j >= 0}
    assert remembered == {(3, 4)}
    # Forces within the clump turn it into the field: soft moments exert no torque by themselves.
    within = r[0] - r[1]
    force_within = state["force"][0] - force_of(r, m, 0, range(2, 5))
    own = influence[0, 1] @ m[1]
    other = influence[1, 0] @ m[0]
    close(np.cross(within, force_within), -np.cross(m[0], own) - np.cross(m[1], other), 1e-9)


@pytest.mark.slow
def test_ewald_sums_do_not_depend_on_their_cut_off():
    """With different cut-offs, different pairs are in the near part of the sum."""
    domain = Box(low=(0, 0, 0), high=(SIDE,) * 3)
    settings = [ewald_settings(domain, 5, 1e-8, cutoff=cutoff) for cutoff in (1.5, 3.5, 5.0)]
    waves = settings[0]["waves"]
    scenes = []
    for one in settings:
        cut = {**one, "waves": waves}
        moments = EwaldInducedMoment(susceptibility=50.0, tolerance=1e-12, **cut)
        scenes.append(bodies(moments, EwaldDipoleDipole(**cut), domain=domain))
    none, some, many = loads(scenes)
    for one in (some, many):
        close(one["moment"], none["moment"], 1e-6)
        close(one["force"], none["force"], 1e-6)
