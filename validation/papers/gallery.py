"""Statements of three papers, for the gallery and as a command.

python -m validation.papers.gallery [--parts pull_conditions ...]
"""

from __future__ import annotations

import sys

from validation.gallery.command import command
from validation.gallery.record import Part
from validation.papers import film, pull, scissor

TITLE = "What the papers say"
PARTS: dict[str, Part] = {
    "pull_conditions": pull.conditions,
    "pull_factors": pull.factors,
    "film_tension": film.tension,
    "film_size": film.size,
    "film_position": film.position,
    "scissor": scissor.deployment,
}

if __name__ == "__main__":
    sys.exit(command(PARTS, "papers", __doc__))
