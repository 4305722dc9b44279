"""The physics of fluidwarp on the GPU, for scripts: see "Scripting" in the README.

>>> from solver import Device, Fluid, Grid, WarpMap
>>> with Device.headless() as device:
...     fluid, warp = Fluid(device, Grid(64, 48)), WarpMap(device, Grid(64, 48))
...     fluid.step(1 / 60)
...     warp.advance(fluid.faces(), 1 / 60)
"""

from solver.brush import Brush, Tip
from solver.context import ContextError, Device
from solver.density import Density
from solver.fluid import Fluid
from solver.grid import Grid
from solver.masks import Masks
from solver.paper import PaperFluid, PaperWarpMap
from solver.params import FluidParams, Walls
from solver.warp import WarpMap

__all__ = [
    "Brush",
    "ContextError",
    "Density",
    "Device",
    "Fluid",
    "FluidParams",
    "Grid",
    "Masks",
    "PaperFluid",
    "PaperWarpMap",
    "Tip",
    "Walls",
    "WarpMap",
]
