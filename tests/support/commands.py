"""Running the command line."""

from __future__ import annotations

from collections.abc import Callable
from subprocess import CompletedProcess

Run = Callable[..., CompletedProcess[str]]
"""The fixture `fluidwarp`: what `fluidwarp(folder, *words)` gives is what a process would."""
