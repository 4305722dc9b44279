"""Shared fixtures: a headless device, and the check that GL was left clean."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from solver.gl.device import Device


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
