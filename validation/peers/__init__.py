"""The strip in other multibody codes, compared with fsm."""

import sys

sys.exudynFast = True  # type: ignore[attr-defined]  # Exudyn's build without range checks; read when Exudyn is imported
