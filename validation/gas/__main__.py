"""Checks of gas: python -m validation.gas [--parts ideal beam] [--full] [--out out/validation/gas]."""

from __future__ import annotations

import sys

from validation.gallery.command import command
from validation.gas.gallery import PARTS
from validation.gas.gallery import __doc__ as TEXT

if __name__ == "__main__":
    sys.exit(command(PARTS, "gas", TEXT))
