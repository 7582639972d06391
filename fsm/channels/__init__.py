"""Output channels: named quantities that a case selects by patterns in `[save] channels`.

Every module of this folder that uses the decorator `fsm.channels.offer.offers` adds channels. There is no other list of
channels.
"""

from __future__ import annotations

import importlib
import pkgutil

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")
