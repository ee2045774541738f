"""Resting contacts of hard spheres: pairs that forces press together are in contact, not colliding.

A collision differs from a contact in that the approach existed before the forces of the step (E. Guendelman,
R. Bridson, R. Fedkiw, Nonconvex rigid bodies with stacking, ACM Trans. Graph. 22 (2003) 871). So a pair rests
if it overlapped at the beginning of the step and if its approach is due to the forces of the step. Both
conditions are tested with the forces at the end of the step: with d = r_j - r_i, u = v_i - v_j and a =
F_i/m_i - F_j/m_j,

    d_0 = d + dt u - dt^2/2 a        the separation at the beginning, by Taylor's formula
    u . d <= SHARE dt a . d          the approach is due to the forces

The forces include contact forces that are already known, as a grain under load presses the next one. SHARE is
above 1 for two reasons: forces change within a step, and contacts are resolved one after another, so that
later ones leave some approach to the earlier ones, up to SHARE dt a in a row of some four grains. For any
SHARE a pair that meets in this step collides, and the approach that is treated as rest goes to zero with dt.

In clusters that forces press together, the remaining approach would let grains sink into each other step by
step. Forces that grow at short distance would then soon be too steep for any step. Sunken grains are
therefore separated again (U. M. Ascher, H. Chin, S. Reich, Numer. Math. 67 (1994) 131: the drift off a
constraint is removed by projection).
"""

from tisim.backend.taichi import ti

ROUNDOFF = {ti.f64: 2.0**-53, ti.f32: 2.0**-24}
"""The unit roundoff u: the relative accuracy of a number."""

SHARE = 16.0
"""Largest approach speed of a pair in contact, over the speed that forces produce in a step, without a
collision."""
SUNK = 1e-2
"""Overlap of grains in contact, over the smaller radius, that is not corrected; slow impacts leave such
overlaps."""


@ti.func
def rounding(s, w, i, j, separation):
    """Return the rounding error of (v_i - v_j) . (r_j - r_i) for a pair at rest, in m^2/s."""
    speeds = ti.abs(s.velocity[w, i]) + ti.abs(s.velocity[w, j])
    return 5.0 * ROUNDOFF[s.real] * speeds.dot(ti.abs(separation))


@ti.func
def rests(s, w, i, j, separation):
    """Return whether an overlapping pair was in contact when the step began, and only forces have pressed it
    together."""
    dt = ti.cast(s.dt[w], s.real)
    slip = s.velocity[w, i] - s.velocity[w, j]
    gained = dt * (s.force[w, i] / s.mass[w, i] - s.force[w, j] / s.mass[w, j])
    before = separation + dt * (slip - 0.5 * gained)
    # Positions and radii are known to a relative accuracy of u; smaller gaps cannot be distinguished from
    # contact.
    places = s.position[w, i].norm() + s.position[w, j].norm() + s.radius[w, i] + s.radius[w, j]
    reach = s.radius[w, i] + s.radius[w, j] + 4.0 * ROUNDOFF[s.real] * places
    limit = SHARE * gained.dot(separation) + rounding(s, w, i, j, separation)
    return before.norm_sqr() <= reach * reach and slip.dot(separation) <= limit


@ti.func
def press(s, w, i, impulse):
    """Give grain i the impulse of a contact (N s), and add it to the forces of the step."""
    s.velocity[w, i] = s.velocity[w, i] + impulse / s.mass[w, i]
    s.force[w, i] = s.force[w, i] + impulse / ti.cast(s.dt[w], s.real)


@ti.func
def part(s, w, i, j, n, distance):
    """Separate two grains in contact along n, about their common centre of mass, if they have sunk into each
    other."""
    smaller = ti.min(s.radius[w, i], s.radius[w, j])
    deep = s.radius[w, i] + s.radius[w, j] - distance - SUNK * smaller
    if deep > 0.0:
        share = s.mass[w, j] / (s.mass[w, i] + s.mass[w, j])
        s.position[w, i] = s.position[w, i] - share * deep * n
        s.position[w, j] = s.position[w, j] + (1.0 - share) * deep * n
        s.invalidate_lists(w)


@ti.func
def support(impact: ti.template(), s, w, i, j, separation):  # type: ignore[valid-type]
    """Remove the approach of a pair that forces press together, and reduce its slip by friction; the lost
    kinetic energy becomes heat. Sunken grains are separated; nothing else happens."""
    m_i, m_j = s.mass[w, i], s.mass[w, j]
    reduced = m_i * m_j / (m_i + m_j)
    n = separation.normalized()
    slip = s.velocity[w, i] - s.velocity[w, j]
    v_n = slip.dot(n)
    slip -= v_n * n
    v_t = slip.norm()
    impulse, most = reduced * v_n * n, 0.0 * v_n
    for law in ti.static(impact.limit):
        most += law.limit(w, reduced * v_n)
    slid = v_t
    if v_t > 0.0:
        stopped = ti.min(v_t, most / reduced)
        impulse += reduced * stopped / v_t * slip
        slid -= stopped
    press(s, w, i, -impulse)
    press(s, w, j, impulse)
    part(s, w, i, j, n, separation.norm())
    loss = 0.5 * reduced * (v_n * v_n + v_t * v_t - slid * slid)
    for law in ti.static(impact.temperature):
        s.temperature[w, i] = law.temperature(s, w, i, loss * m_j / (m_i + m_j))
        s.temperature[w, j] = law.temperature(s, w, j, loss * m_i / (m_i + m_j))
    ti.atomic_add(s.contacts[w], 1)
