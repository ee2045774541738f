"""How a picture shows a scene: the direction of view, the part that is shown, cuts, and the colours."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from tisim.errors import must
from tisim.rendering.camera import ALONG_Y, USUAL_CAMERA, Camera, ClipPlane

Crop = tuple[float, float, float, float]
"""Left, right, bottom and top of a part of a picture, 0..1."""
WHOLE_PICTURE: Crop = (0.0, 1.0, 0.0, 1.0)
_CUT = re.compile(r"\s*([xyz])\s*([<>])\s*(\S+)\s*")


@dataclass(frozen=True)
class Look:
    """How a picture shows a scene.

    colour : the quantity that colours grains: "material", "radius", "speed", "temperature" or another
        recorded field; by default the temperature or the material, where there are several.
    clip : planes that cut grains and walls. crop : part of the whole picture that is shown.
    lines : the field whose lines are drawn, "magnetic", "electric" or "flow" (see ``FieldLines``).
    """

    camera: Camera = USUAL_CAMERA
    colour: str | None = None
    clip: tuple[ClipPlane, ...] = ()
    crop: Crop = WHOLE_PICTURE
    lines: str | None = None

    @classmethod
    def of(
        cls,
        colour: str | None = None,
        view: str = "",
        crop: str = "",
        clip: tuple[str, ...] = (),
        lines: str | None = None,
    ) -> Look:
        """Return the look that texts describe; InputError if they are invalid.

        view : azimuth and elevation of the viewer in degrees, "-62,18". crop : left, right, bottom and top of
            a part of the picture, 0..1, "0.2,0.8,0,0.5". clip : the part of space
            that is drawn, in m, such as "y<0.01".
        """
        camera = USUAL_CAMERA
        if view:
            azimuth, elevation = _numbers(view, "view", "azimuth,elevation in degrees", 2)
            must(-90 <= elevation <= 90, "elevation of the view", "-90 to 90 degrees", elevation)
            camera = Camera(azimuth, elevation)
        part = WHOLE_PICTURE
        if crop:
            left, right, bottom, top = _numbers(crop, "crop", "left,right,bottom,top of the picture", 4)
            inside = 0 <= left < right <= 1 and 0 <= bottom < top <= 1
            must(inside, "crop", "0 <= left < right <= 1 and 0 <= bottom < top <= 1", crop)
            part = left, right, bottom, top
        return cls(camera, colour, tuple(_plane(one) for one in clip), part, lines)


def _numbers(text: str, name: str, rule: str, count: int) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    must(len(numbers) == count and all(map(math.isfinite, numbers)), name, f"{count} numbers, {rule}", text)
    return numbers


def _plane(text: str) -> ClipPlane:
    """Return the plane beyond which nothing is drawn."""
    found = _CUT.fullmatch(text)
    try:
        place = float(found[3]) if found else math.nan
    except ValueError:
        place = math.nan
    must(math.isfinite(place), "clip", "a part of space that is kept, such as y<0.01 (m)", text)
    assert found is not None
    sign = 1.0 if found[2] == "<" else -1.0
    x, y, z = (sign * (axis == found[1]) for axis in "xyz")
    return ClipPlane((x, y, z), sign * place)


USUAL = Look()
"""How pictures show a scene unless asked otherwise."""
FROM_THE_SIDE = Look(camera=ALONG_Y)
"""A picture as seen along y."""
