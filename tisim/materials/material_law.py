"""Base classes of parts that depend on the materials of a scene, such as contact laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

from pydantic import PrivateAttr

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.components.invalid import text_of, unit_of
from tisim.errors import Words, must
from tisim.materials.materials import Material, Materials, Touching


class UsesMaterials(Component):
    """Contract of a part that depends on the materials of its scene."""

    contract: ClassVar[bool] = True
    _materials: Materials = PrivateAttr(default=Materials({}, {}))

    def with_materials(self, materials: Materials) -> Self:
        """Return a copy with the materials of a scene, also set in all nested parts of this contract."""
        parts = {name: getattr(self, name) for name in type(self).model_fields}
        update = {
            name: part.with_materials(materials)
            for name, part in parts.items()
            if isinstance(part, UsesMaterials)
        }
        made = self.model_copy(update=update)
        made._materials = materials
        return made

    def check_materials(self, materials: Materials) -> None:
        """Raise InputError unless the materials of a scene have the properties that the part needs."""


class MaterialLaw(UsesMaterials):
    """Contract of a part of a law with coefficients that depend on the two materials in contact.

    uses : names of the material properties that it needs.

    ``mix`` computes the coefficients from two materials; kernels read them as ``self.NAME(w, pair)``, with
    ``pair`` from ``material_pair``.
    """

    contract: ClassVar[bool] = True
    uses: ClassVar[tuple[str, ...]] = ()

    def mix(self, pair: Touching) -> dict[str, float]:
        """Return the coefficients for two materials by name, with the same names for all pairs."""
        return {}

    def check_materials(self, materials: Materials) -> None:
        must(
            bool(materials.named) or not self.uses,
            "materials",
            f"given, as {self.label} needs them",
            Words("none"),
        )
        for name in self.uses:
            info = Material.model_fields[name]
            what = ", ".join(filter(None, (text_of(info).partition(";")[0], unit_of(info))))
            for pair in materials.touching():
                for label in pair.lacking(name):
                    rule = f"given ({what}), as {self.label} needs it"
                    must(False, f"materials.{label}.{name}", rule, Words("nothing"))

    @property
    def several(self) -> bool:
        """Return whether there is more than one material."""
        return len(self._materials.named) > 1

    @property
    def number_of_materials(self) -> int:
        return max(1, len(self._materials.named))

    def derived_rows(self) -> dict[str, Sequence[float]]:
        rows = [self.mix(pair) for pair in self._materials.touching()]
        return {name: [row[name] for row in rows] for name in rows[0]} if rows else {}

    @ti.func
    def material_pair(self, s, w, i, j):
        """Return the index of the pair of materials of i and j."""
        pair = 0
        if ti.static(self.several):
            pair = s.material[w, i] * self.number_of_materials + s.material[w, j]
        return pair
