"""Processes that permissions hold for, whoever runs the tests."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# A root without CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH may do with files what their permissions say, as anybody
# (capabilities(7)); what is not in the bounding set is gone with the next program.
DROP = """
import ctypes, os, sys
PR_CAPBSET_DROP = 24
if os.geteuid() == 0 and any(ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, number, 0, 0, 0) for number in (1, 2)):
    sys.exit(77)
os.execv(sys.executable, [sys.executable, "-c", *sys.argv[1:]])
"""

needs_permissions = pytest.mark.skipif(sys.platform != "linux", reason="permissions are others there")


def as_a_user(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """What a Python program does in a folder, run by nobody in particular."""
    path = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    ran = subprocess.run(
        [sys.executable, "-c", DROP, code],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=100,
    )
    if ran.returncode == 77:
        pytest.skip("root cannot be made anybody here")
    return ran
