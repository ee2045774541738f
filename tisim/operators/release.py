"""The conditions under which a captured particle is released."""

from __future__ import annotations

from tisim.components.component import Component, parameter


class Release(Component):
    """A captured particle is released at the end of the first step after which nothing holds it. It is held
    while

        -F.n + F_a > c k T / R

    n is the outward normal of the magnet, R the radius of the particle, and F_a an adhesion force. F is the
    sum of the forces of the scene on single particles, in the field and with the moment at the end of the
    step, and of the drag 6 pi eta R u of the flow. Without any force and adhesion nothing holds a particle.
    Forces between particles are not counted. A field that is switched off within a step therefore holds
    particles until the end of this step.

    A particle that touches a magnet where nothing would hold it is not captured: it is placed on the surface
    and remains free.

    With the probability ``adhering``, drawn at each capture, a particle adheres and is never released. In B16
    at most 60 % of the particles came off the fibres after the field was switched off.

    Source: B16 sections 7.1, 7.4.2.
    """

    adhering: float = parameter(
        "", "probability that a captured particle adheres and is never released", 0.0, ge=0, le=1
    )
    adhesion_force: float = parameter(
        "N", "adhesion force F_a towards the surface, on each captured particle", 0.0, ge=0
    )
    least_force: float = parameter(
        "", "force c that holds a particle, over the thermal energy per radius k T / R", 0.0, ge=0
    )
    temperature: float = parameter("K", "temperature T of the fluid", 298.0, gt=0)
    viscosity: float = parameter(
        "Pa s", "viscosity eta for the drag of the flow on captured particles; 0 for no drag", 0.0, ge=0
    )
