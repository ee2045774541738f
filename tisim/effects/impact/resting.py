"""Which pairs of hard spheres rest on each other: what forces press together is in contact, not colliding.

Collisions are told from contacts by whether the approach was there before the forces of the step (E.
Guendelman, R. Bridson, R. Fedkiw, Nonconvex rigid bodies with stacking, ACM Trans. Graph. 22 (2003) 871).
So a pair rests that overlapped when the step began, and whose approach is what the forces of the step give.
Both are found from the forces at its end: with d = r_j - r_i, u = v_i - v_j and a = F_i/m_i - F_j/m_j,

    d_0 = d + dt u - dt^2/2 a        the separation at the beginning, by Taylor's formula
    u . d <= SHARE dt a . d          the approach is that of the forces

The forces are those of contacts too, once these are known: what presses a grain presses the next one. SHARE
is above 1 since forces change within a step, and since contacts are resolved one after another: the later
ones leave some approach to the earlier ones, that many times dt a in a row of some four grains. Whatever it
is, a pair that meets in this step collides, and what SHARE takes for rest goes to zero with dt.

In clusters that forces press together the approach that is left over lets grains sink into each other, step
by step; forces that grow as grains come nearer would then soon be too steep for any step. So what has sunk is
put apart again (U. M. Ascher, H. Chin, S. Reich, Numer. Math. 67 (1994) 131: the drift off a constraint is
taken back by projection).
"""

from tisim.backend.taichi import ti

ROUNDOFF = {ti.f64: 2.0**-53, ti.f32: 2.0**-24}
"""The unit roundoff u: a number is known to this part of itself."""

SHARE = 16.0
"""A pair in contact may approach this many times as fast as forces make it in a step, and still not
collide."""
SUNK = 1e-2
"""Grains in contact may overlap by this part of the smaller radius, as they do after a slow impact."""


@ti.func
def rounding(s, w, i, j, separation):
    """Return what rounding may make of (v_i - v_j) . (r_j - r_i) of a pair at rest, in m^2/s."""
    speeds = ti.abs(s.velocity[w, i]) + ti.abs(s.velocity[w, j])
    return 5.0 * ROUNDOFF[s.real] * speeds.dot(ti.abs(separation))


@ti.func
def rests(s, w, i, j, separation):
    """Return whether an overlapping pair was in contact when the step began, and only forces have pressed
    it."""
    dt = ti.cast(s.dt[w], s.real)
    slip = s.velocity[w, i] - s.velocity[w, j]
    gained = dt * (s.force[w, i] / s.mass[w, i] - s.force[w, j] / s.mass[w, j])
    before = separation + dt * (slip - 0.5 * gained)
    # Places and sizes are known to u of themselves: closer than that no pair is known to be apart.
    places = s.position[w, i].norm() + s.position[w, j].norm() + s.radius[w, i] + s.radius[w, j]
    reach = s.radius[w, i] + s.radius[w, j] + 4.0 * ROUNDOFF[s.real] * places
    limit = SHARE * gained.dot(separation) + rounding(s, w, i, j, separation)
    return before.norm_sqr() <= reach * reach and slip.dot(separation) <= limit


@ti.func
def press(s, w, i, impulse):
    """Give grain i the impulse of a contact (N s), and count it among the forces of the step."""
    s.velocity[w, i] = s.velocity[w, i] + impulse / s.mass[w, i]
    s.force[w, i] = s.force[w, i] + impulse / ti.cast(s.dt[w], s.real)


@ti.func
def part(s, w, i, j, n, distance):
    """Put two grains in contact apart along n, about their common centre of mass, if they have sunk into each
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
    """Hold together what forces press together, which slides as friction lets it; what that takes of its
    kinetic energy is heat. Grains that have sunk into each other are put apart; nothing else happens."""
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
