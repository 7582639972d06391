"""Full disks and folders without write permission, as `python -m validation.faults` simulates them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from validation.faults.writing import full_disk, read_only_folder

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits and /proc of Linux")


def test_full_disk(tmp_path: Path) -> None:
    assert full_disk(tmp_path) == ""


def test_read_only_folder(tmp_path: Path) -> None:
    assert read_only_folder(tmp_path) == ""
