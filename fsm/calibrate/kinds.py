"""Kinds of calibrations with their functions."""

from __future__ import annotations

CALIBRATIONS = {
    "crease": "fsm.calibrate.crease:calibrate_crease",
    "relaxation": "fsm.calibrate.relaxation:calibrate_relaxation",
    "bending": "fsm.calibrate.bending:calibrate_bending",
    "force": "fsm.calibrate.force:calibrate_force",
}
"""Kinds of `fsm calibrate`: module and function, (data file, options) -> Calibration."""
