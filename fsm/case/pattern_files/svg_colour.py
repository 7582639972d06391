"""Colours of CSS, and the letter of the crease pattern that a stroke colour means."""

from __future__ import annotations

import colorsys
from typing import NamedTuple

from tinycss2.color4 import Color, parse_color

COLOURS = {
    "#ff0000": "M", "#0000ff": "V", "#000000": "B", "#00ff00": "C", "#ffff00": "J", "#ff00ff": "U",
}  # fmt: skip
"""Letters of the stroke colours of Origami Simulator."""

_HUES = {"M": (-20.0, 20.0), "J": (45.0, 75.0), "C": (80.0, 165.0), "V": (200.0, 262.0), "U": (270.0, 335.0)}
"""Range of hues of each letter, degrees."""
_CHROMA = 0.3
"""Smallest difference of the largest and the smallest component of a colour with a hue; components are from 0 to 1."""
_DARK, _GREY = 0.35, 0.1
"""Largest component of a black, and largest difference of its components."""
_LONGEST = 200
"""Largest number of characters of a colour."""


class Colour(NamedTuple):
    """Colour with components from 0 to 1."""

    red: float
    green: float
    blue: float
    alpha: float

    @property
    def code(self) -> str:
        """Text like "#ff0000", without the alpha component."""
        return "#" + "".join(f"{round(255.0 * x):02x}" for x in self[:3])


def colour_of(text: str) -> Colour | None:
    """Colour of a CSS text: a name, `#rgb`, `#rgba`, `#rrggbb`, `#rrggbbaa`, `rgb()`, `rgba()`, `hsl()`, `hsla()` or
    `hwb()`, with numbers or per cent; None for any other text.

    Examples
    --------
    >>> colour_of("hsl(240 100% 50% / 50%)")
    Colour(red=0.0, green=0.0, blue=1.0, alpha=0.5)
    """
    text = text.strip().lower()[:_LONGEST].partition(" icc-color")[0]  # a colour of SVG 1.1 with its equivalent in print
    found = parse_color(text)
    if not isinstance(found, Color) or found.space not in ("srgb", "hsl", "hwb"):
        return None
    red, green, blue = (min(max(component, 0.0), 1.0) for component in found.to("srgb").coordinates)
    return Colour(red, green, blue, found.alpha)


def letter_of(colour: Colour) -> str | None:
    """Letter of the nearest colour of the convention; None if no colour is near.

    A colour counts as red, blue and so on by its hue, if its components differ by at least 0.3 of their range. It counts as
    black if no component is above 0.35 and they differ by at most 0.1.

    Examples
    --------
    >>> letter_of(colour_of("#ed1c24")), letter_of(colour_of("#231f20")), letter_of(colour_of("orange"))
    ('M', 'B', None)
    """
    low, high = min(colour[:3]), max(colour[:3])
    if high <= _DARK and high - low <= _GREY:
        return "B"
    if high - low < _CHROMA:
        return None
    hue = 360.0 * colorsys.rgb_to_hsv(*colour[:3])[0]
    for letter, (first, last) in _HUES.items():
        if first <= hue <= last or first <= hue - 360.0 <= last:
            return letter
    return None
