"""A seed that changes from day to day: beside the few that the suite always tries, one that it has not."""

from __future__ import annotations

from datetime import date

import pytest

TODAY = pytest.param(date.today().toordinal(), id="today")
"""What a check says when it fails has the number in it; `nightly.py --seeds 1 --first NUMBER` repeats it."""
