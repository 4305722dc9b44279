"""Property tests with new seeds: python tests/nightly.py --seeds 1000 [-k name] [--first 0]

Every `check_<name>(device, seed)` of tests/properties/ is run with so many seeds; the worst figures are shown, and the
seeds that failed. With the same --first a run is repeated.
"""

from __future__ import annotations

import argparse
import importlib
import os
import pkgutil
import random
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program does, before NumPy is loaded
ROOT = Path(__file__).parent.parent
sys.path[:0] = [path for path in (str(ROOT), str(ROOT / "tests")) if path not in sys.path]

import properties  # noqa: E402
from solver.gl.device import Device  # noqa: E402

Check = Callable[[Device, int], dict[str, float]]


def checks(wanted: str) -> dict[str, Check]:
    """The checks of all modules whose name has `wanted` in it."""
    found: dict[str, Check] = {}
    for module in pkgutil.iter_modules(properties.__path__):
        room = importlib.import_module(f"properties.{module.name}")
        found |= {f"{module.name}.{name}": check for name, check in vars(room).items() if name.startswith("check_")}
    return {name: check for name, check in found.items() if wanted in name}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1000)
    parser.add_argument("--first", type=int, default=None, help="the first seed; random if not given")
    parser.add_argument("-k", default="", help="a part of the checks' names")
    options = parser.parse_args()
    first = random.randrange(10**6, 10**9) if options.first is None else options.first
    failed = 0
    with Device.headless() as device:
        for name, check in checks(options.k).items():
            start, worst, bad = time.perf_counter(), dict[str, float](), list[int]()
            for seed in range(first, first + options.seeds):
                try:
                    for figure, value in check(device, seed).items():
                        worst[figure] = max(worst.get(figure, value), value)
                except Exception as error:  # whatever a check finds, the next seed is tried
                    bad.append(seed)
                    print(f"{name} fails with seed {seed}: {type(error).__name__}: {error}".splitlines()[0], flush=True)
            took = time.perf_counter() - start
            figures = ", ".join(f"{figure} {value:.4g}" for figure, value in worst.items())
            print(
                f"{name}: {options.seeds} seeds from {first}, {len(bad)} failed, {took:.0f} s; worst: {figures}",
                flush=True,
            )
            failed += len(bad)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
