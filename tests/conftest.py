"""Shared fixtures: a headless device, and the check that GL was left clean."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import pytest

import solver.gl.passes
from solver.gl.device import Device
from support.khronos import Programs


@pytest.fixture(scope="session", autouse=True)
def khronos_accepts_every_program() -> Iterator[None]:
    """Every program that the tests of this process compile passes the Khronos reference compiler too."""
    compile_program, programs = solver.gl.passes.compile_program, Programs()

    def noting(ctx: moderngl.Context, fragment: str, defines: dict[str, object]) -> moderngl.Program:
        program = compile_program(ctx, fragment, defines)
        programs.add(fragment, defines)
        return program

    solver.gl.passes.compile_program = noting
    yield
    solver.gl.passes.compile_program = compile_program
    assert not programs.complaints()


@pytest.fixture(scope="session")
def shared_device() -> Iterator[Device]:
    """One headless device for the whole test process."""
    device = Device.headless()
    yield device
    device.release()


@pytest.fixture
def device(shared_device: Device) -> Iterator[Device]:
    """The headless device; fails the test that leaves a GL error behind."""
    assert shared_device.ctx.error == "GL_NO_ERROR"
    yield shared_device
    assert shared_device.ctx.error == "GL_NO_ERROR"
