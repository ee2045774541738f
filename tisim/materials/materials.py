"""Materials by name, and their properties in contact."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from tisim.components.component import Component, parameter
from tisim.errors import InputError, abbreviated, did_you_mean, must


def _geometric(a: float, b: float) -> float:
    return math.sqrt(a) * math.sqrt(b)


def _harmonic(a: float, b: float) -> float:
    return 2.0 * a * (b / (a + b)) if a + b else 0.0


class ContactProperties(Component):
    """Properties of the contact of two materials, each mixed from the two by the rule stated in its text."""

    contract: ClassVar[bool] = True

    stiffness: float | None = parameter(
        "N/m", "stiffness k of a contact, in Hooke's law; of two materials, their harmonic mean", None, gt=0
    )
    restitution: float | None = parameter(
        "", "coefficient e of restitution; of two materials, their geometric mean", None, ge=0, le=1
    )
    viscous_time: float | None = parameter(
        "s", "time A of viscoelastic damping; of two materials, their geometric mean", None, ge=0
    )
    damping: float | None = parameter(
        "N s/m", "coefficient gamma of constant damping; of two materials, their geometric mean", None, ge=0
    )
    friction: float | None = parameter(
        "", "coefficient mu of friction; of two materials, their geometric mean", None, ge=0
    )
    rolling_friction: float | None = parameter(
        "", "coefficient mu_r of rolling friction; of two materials, their geometric mean", None, ge=0
    )
    rolling_stiffness: float | None = parameter(
        "N/m", "stiffness k_r against rolling; of two materials, their harmonic mean", None, gt=0
    )
    rolling_damping: float | None = parameter(
        "N s/m", "damping gamma_r against rolling; of two materials, their geometric mean", None, ge=0
    )
    twisting_friction: float | None = parameter(
        "m", "arm mu_t of friction against twisting; of two materials, their geometric mean", None, ge=0
    )
    twisting_stiffness: float | None = parameter(
        "N m/rad", "stiffness k_t against twisting; of two materials, their harmonic mean", None, gt=0
    )
    twisting_damping: float | None = parameter(
        "N m s/rad", "damping gamma_t against twisting; of two materials, their geometric mean", None, ge=0
    )
    cohesion_energy_density: float | None = parameter(
        "J/m^3", "cohesion k_c for each area of contact; of two materials, their geometric mean", None, ge=0
    )
    surface_energy: float | None = parameter(
        "J/m^2",
        "surface energy gamma, half the work of adhesion; of two materials, their geometric mean",
        None,
        ge=0,
    )


HARMONIC = ("stiffness", "rolling_stiffness", "twisting_stiffness")
"""These properties are mixed by the harmonic mean, 2 k_i k_j / (k_i + k_j). It is twice the stiffness of two
springs in series, so that two grains of one material are in contact with its own k. All other properties are
mixed by the geometric mean."""


class Material(ContactProperties):
    """A named set of properties of grains and walls.

    Contact laws state which of these they need; the others may be omitted. The elastic constants of two
    materials are combined as in Hertz and Mindlin contact. Other properties are mixed by the rules in their
    texts, unless the scene gives them for the pair (``MaterialPair``).
    """

    def __repr_args__(self) -> Iterator[tuple[str | None, Any]]:
        return ((name, value) for name, value in super().__repr_args__() if value is not None)

    young: float | None = parameter(
        "Pa", "Young's modulus E; of two materials, 1/E* = (1 - nu_i^2)/E_i + (1 - nu_j^2)/E_j", None, gt=0
    )
    poisson: float | None = parameter(
        "",
        "Poisson's ratio nu; of two materials, 1/G* is the sum of 2 (2 - nu) (1 + nu)/E",
        None,
        gt=-1,
        le=0.5,
    )


class MaterialPair(ContactProperties):
    """Contact properties of two materials that replace the mixed values.

    The key is both names with a hyphen between them, such as "steel-rubber", in either order.
    """


@dataclass(frozen=True)
class Touching:
    """Two materials in contact; ``mixed`` gives a property of the pair."""

    names: tuple[str, str]
    first: Material
    second: Material
    given: MaterialPair | None

    def mixed(self, name: str) -> float:
        """Return a property of the pair: the given value, or the mixed one."""
        own = None if self.given is None else getattr(self.given, name)
        if own is not None:
            return float(own)
        rule: Callable[[float, float], float] = _harmonic if name in HARMONIC else _geometric
        a, b = getattr(self.first, name), getattr(self.second, name)
        return float(a if a == b else rule(a, b))

    def elastic(self) -> list[tuple[float, float]]:
        """Return E (Pa) and nu of each material that has both."""
        sides = ((side.young, side.poisson) for side in (self.first, self.second))
        return [(young, nu) for young, nu in sides if young is not None and nu is not None]

    @property
    def effective_young(self) -> float:
        """Return E*, Pa."""
        return 1.0 / sum((1 - nu * nu) / young for young, nu in self.elastic())

    @property
    def effective_shear(self) -> float:
        """Return G*, Pa."""
        return 1.0 / sum(2 * (2 - nu) * (1 + nu) / young for young, nu in self.elastic())

    def lacking(self, name: str) -> Iterator[str]:
        """Yield the names of those of the two materials that lack a property that is not given for the
        pair."""
        if self.given is None or getattr(self.given, name, None) is None:
            for label, material in zip(self.names, (self.first, self.second), strict=True):
                if getattr(material, name) is None:
                    yield label


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True)
class Materials:
    """The materials of a scene, in order, and the given properties of pairs."""

    named: Mapping[str, Material]
    pairs: Mapping[str, MaterialPair]

    def __post_init__(self) -> None:
        for name in self.named:
            must(
                bool(_NAME.fullmatch(name)),
                "a name of materials",
                "letters, digits and _, a letter first",
                name,
            )
        known = " or ".join(sorted(self.named)) or "none, as the scene has none"
        seen = set()
        for name in self.pairs:
            both = name.split("-")
            rule = f"named after two of its materials ({known}), as in steel-rubber"
            must(
                len(both) == 2 and all(one in self.named for one in both),
                f"material_pairs.{name}",
                rule,
                name,
            )
            must(frozenset(both) not in seen, f"material_pairs.{name}", "given once", "-".join(both[::-1]))
            seen.add(frozenset(both))

    def index(self, name: Any, where: str) -> int:
        """Return the index of a material, by name or number; raise InputError naming ``where`` if there is
        none."""
        names = list(self.named)
        if isinstance(name, str):
            rule = f"one of the materials of the scene ({', '.join(names) or 'none'})"
            if name not in self.named:
                raise InputError(
                    f"{where} must be {rule}; received {abbreviated(name)}{did_you_mean(name, names)}"
                )
            return names.index(name)
        must(0 <= int(name) < max(1, len(names)), where, f"below {max(1, len(names))}, the materials", name)
        return int(name)

    def touching(self) -> list[Touching]:
        """Return all ordered pairs of materials; materials i and j of n have the index i n + j."""
        return [self._touch(a, b) for a in self.named for b in self.named]

    def _touch(self, a: str, b: str) -> Touching:
        given = self.pairs.get(f"{a}-{b}") or self.pairs.get(f"{b}-{a}")
        return Touching((a, b), self.named[a], self.named[b], given)
