"""The physics of fluidwarp on the GPU, for scripts: see "Scripting" in the README.

>>> from solver import Device, Fluid, Grid, WarpMap
>>> with Device.headless() as device:
...     fluid, warp = Fluid(device, Grid(64, 48)), WarpMap(device, Grid(64, 48))
...     fluid.step(1 / 60)
...     warp.follow(fluid, 1 / 60)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solver.brush.brush import Brush
    from solver.brush.handle import Handle
    from solver.brush.handles import Handles
    from solver.brush.masks import Masks
    from solver.brush.tip import Tip
    from solver.fluid import Fluid
    from solver.gl.context import ContextError
    from solver.gl.device import Device
    from solver.grid import Grid
    from solver.paper import PaperFluid, PaperWarpMap
    from solver.params import FluidParams, Walls
    from solver.warp.density import Density
    from solver.warp.map import WarpMap

__all__ = [
    "Brush",
    "ContextError",
    "Density",
    "Device",
    "Fluid",
    "FluidParams",
    "Grid",
    "Handle",
    "Handles",
    "Masks",
    "PaperFluid",
    "PaperWarpMap",
    "Tip",
    "Walls",
    "WarpMap",
]

# Loaded when first asked for: a recipe needs `solver.grid` and must not bring all of GL along.
_MODULES = {
    "brush.brush": ("Brush",),
    "brush.handle": ("Handle",),
    "brush.handles": ("Handles",),
    "brush.masks": ("Masks",),
    "brush.tip": ("Tip",),
    "fluid": ("Fluid",),
    "gl.context": ("ContextError",),
    "gl.device": ("Device",),
    "grid": ("Grid",),
    "paper": ("PaperFluid", "PaperWarpMap"),
    "params": ("FluidParams", "Walls"),
    "warp.density": ("Density",),
    "warp.map": ("WarpMap",),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"solver.{module}"), name)
    raise AttributeError(f"module 'solver' has no attribute {name!r}")
