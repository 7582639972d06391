"""Colours of CSS, and the letter of the crease pattern that a stroke colour means."""

from __future__ import annotations

import colorsys
import math
import re
from typing import NamedTuple

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
_NUMBER = re.compile(r"([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[-+]?[0-9]+)?)(%|deg|grad|rad|turn)?")
_TURNS = {"deg": 1.0, "grad": 0.9, "rad": 180.0 / math.pi, "turn": 360.0, None: 1.0}
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
    """Colour of a CSS text: a name, `#rgb`, `#rgba`, `#rrggbb`, `#rrggbbaa`, `rgb()`, `rgba()`, `hsl()` or `hsla()`, with
    numbers or per cent; None for any other text.

    Examples
    --------
    >>> colour_of("hsl(240 100% 50% / 50%)")
    Colour(red=0.0, green=0.0, blue=1.0, alpha=0.5)
    """
    text = text.strip().lower()[:_LONGEST]
    text = text.partition(" icc-color")[0].strip()  # a colour of SVG 1.1 with its equivalent in print
    if text == "transparent":
        return Colour(0.0, 0.0, 0.0, 0.0)
    if text in _NAMED:
        text = "#" + _NAMED[text]
    if text.startswith("#"):
        digits = text[1:]
        digits = "".join(2 * digit for digit in digits) if len(digits) in (3, 4) else digits
        if len(digits) not in (6, 8) or not set(digits) <= set("0123456789abcdef"):
            return None
        values = [int(digits[k : k + 2], 16) / 255.0 for k in range(0, len(digits), 2)]
        return Colour(values[0], values[1], values[2], values[3] if len(values) > 3 else 1.0)
    name, _, rest = text.partition("(")
    if name.strip() not in ("rgb", "rgba", "hsl", "hsla") or not rest.endswith(")"):
        return None
    found = [_NUMBER.fullmatch(part) for part in rest[:-1].replace(",", " ").replace("/", " ").split()]
    if len(found) not in (3, 4) or None in found:
        return None
    parts = [(float(match[1]), match[2]) for match in found if match is not None]
    alpha = _part(*parts[3], 1.0) if len(parts) > 3 else 1.0
    if name.strip().startswith("rgb"):
        red, green, blue = (_part(value, unit, 255.0) for value, unit in parts[:3])
        return Colour(red, green, blue, alpha)
    hue = parts[0][0] * _TURNS.get(parts[0][1], 1.0) / 360.0
    if not math.isfinite(hue):
        return None
    return Colour(*colorsys.hls_to_rgb(hue % 1.0, _part(*parts[2], 100.0), _part(*parts[1], 100.0)), alpha)


def _part(value: float, unit: str | None, whole: float) -> float:
    """Component from 0 to 1 of a number, or of a percentage."""
    return min(max(value / (100.0 if unit == "%" else whole), 0.0), 1.0)


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


_NAMES = """
aliceblue f0f8ff antiquewhite faebd7 aqua 00ffff aquamarine 7fffd4 azure f0ffff beige f5f5dc bisque ffe4c4 black
000000 blanchedalmond ffebcd blue 0000ff blueviolet 8a2be2 brown a52a2a burlywood deb887 cadetblue 5f9ea0 chartreuse
7fff00 chocolate d2691e coral ff7f50 cornflowerblue 6495ed cornsilk fff8dc crimson dc143c cyan 00ffff darkblue
00008b darkcyan 008b8b darkgoldenrod b8860b darkgray a9a9a9 darkgreen 006400 darkgrey a9a9a9 darkkhaki bdb76b
darkmagenta 8b008b darkolivegreen 556b2f darkorange ff8c00 darkorchid 9932cc darkred 8b0000 darksalmon e9967a
darkseagreen 8fbc8f darkslateblue 483d8b darkslategray 2f4f4f darkslategrey 2f4f4f darkturquoise 00ced1 darkviolet
9400d3 deeppink ff1493 deepskyblue 00bfff dimgray 696969 dimgrey 696969 dodgerblue 1e90ff firebrick b22222
floralwhite fffaf0 forestgreen 228b22 fuchsia ff00ff gainsboro dcdcdc ghostwhite f8f8ff gold ffd700 goldenrod daa520
gray 808080 green 008000 greenyellow adff2f grey 808080 honeydew f0fff0 hotpink ff69b4 indianred cd5c5c indigo
4b0082 ivory fffff0 khaki f0e68c lavender e6e6fa lavenderblush fff0f5 lawngreen 7cfc00 lemonchiffon fffacd lightblue
add8e6 lightcoral f08080 lightcyan e0ffff lightgoldenrodyellow fafad2 lightgray d3d3d3 lightgreen 90ee90 lightgrey
d3d3d3 lightpink ffb6c1 lightsalmon ffa07a lightseagreen 20b2aa lightskyblue 87cefa lightslategray 778899
lightslategrey 778899 lightsteelblue b0c4de lightyellow ffffe0 lime 00ff00 limegreen 32cd32 linen faf0e6 magenta
ff00ff maroon 800000 mediumaquamarine 66cdaa mediumblue 0000cd mediumorchid ba55d3 mediumpurple 9370db
mediumseagreen 3cb371 mediumslateblue 7b68ee mediumspringgreen 00fa9a mediumturquoise 48d1cc mediumvioletred c71585
midnightblue 191970 mintcream f5fffa mistyrose ffe4e1 moccasin ffe4b5 navajowhite ffdead navy 000080 oldlace fdf5e6
olive 808000 olivedrab 6b8e23 orange ffa500 orangered ff4500 orchid da70d6 palegoldenrod eee8aa palegreen 98fb98
paleturquoise afeeee palevioletred db7093 papayawhip ffefd5 peachpuff ffdab9 peru cd853f pink ffc0cb plum dda0dd
powderblue b0e0e6 purple 800080 rebeccapurple 663399 red ff0000 rosybrown bc8f8f royalblue 4169e1 saddlebrown 8b4513
salmon fa8072 sandybrown f4a460 seagreen 2e8b57 seashell fff5ee sienna a0522d silver c0c0c0 skyblue 87ceeb slateblue
6a5acd slategray 708090 slategrey 708090 snow fffafa springgreen 00ff7f steelblue 4682b4 tan d2b48c teal 008080
thistle d8bfd8 tomato ff6347 turquoise 40e0d0 violet ee82ee wheat f5deb3 white ffffff whitesmoke f5f5f5 yellow
ffff00 yellowgreen 9acd32
"""
_WORDS = _NAMES.split()
_NAMED = dict(zip(_WORDS[::2], _WORDS[1::2], strict=True))
"""Named colours of CSS by their digits."""
