"""What pushes out of a list do to the fluid is what they are reckoned to do to each other, images in edges too."""

from __future__ import annotations

import tracemalloc

import numpy as np

from solver import Device, Fluid, Grid, Handle, Handles, WarpMap
from solver.brush.brush import Brush
from solver.brush.listed import draw_listed
from solver.brush.push import Push
from solver.brush.pushes import Pushes
from solver.brush.tip import Tip

GRID = Grid(128, 96)
PLACES = np.array([[0.05, 0.4], [0.5, 0.72], [0.98, 0.02], [0.5, 0.4]])
RADII = np.array([0.3, 0.2, 0.25, 0.6])
FORCES = np.array([[1.0, 0.5], [-0.3, 0.8], [0.6, -0.7], [0.2, 0.1]])
FACES = [np.stack([side[::7, ::7].ravel() for side in faces], axis=-1) for faces in (GRID.u_faces(), GRID.v_faces())]


def at_faces(influence: list[np.ndarray]) -> list[np.ndarray]:
    """u at left faces and v at upper ones, of the influence on both."""
    return [np.einsum("njb,jb->n", each[:, axis], FORCES) for axis, each in enumerate(influence)]


def test_pushes_flow_as_they_are_reckoned_to(device: Device):
    pushes, stream = Pushes(GRID, PLACES, RADII), device.field((129, 97), 1)
    pushes.draw(device, device.pass_("brush/handle_stream.frag"), stream, FORCES)
    velocity = device.field(GRID.size, 2)
    device.pass_("brush/curl.frag")(velocity, stream=stream, spacing=GRID.spacing)
    assert np.abs(np.concatenate([stream.get()[[0, -1]].ravel(), stream.get()[:, [0, -1]].ravel()])).max() < 1e-6
    for axis, wanted in enumerate(at_faces([pushes.influence(each) for each in FACES])):
        np.testing.assert_allclose(velocity.get()[::7, ::7, axis].ravel(), wanted, atol=0.02)


def test_what_is_local_of_handles_is_carried_as_it_is_reckoned(device: Device):
    pushes, motion = Pushes(GRID, PLACES, RADII), device.field(GRID.size, 2)
    draw_listed(device, device.pass_("brush/handle_carry.frag"), motion, GRID, PLACES, RADII, FORCES)
    for axis, wanted in enumerate(at_faces([pushes.local_influence(each) for each in FACES])):
        inside = FACES[axis][:, axis] > 0  # but on the walls
        np.testing.assert_allclose(motion.get()[::7, ::7, axis].ravel()[inside], wanted[inside], atol=2e-5)


def test_many_pushes_are_reckoned_a_block_at_a_time() -> None:
    """Of 16 lines there were six millions of pairs, and arrays of a gigabyte; each place is as by itself."""
    places = np.random.default_rng(0).random((256, 2))
    pushes = Pushes(Grid(32, 32), places, np.ones(256))
    tracemalloc.start()
    together = pushes.influence(places)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 8 * together.nbytes
    alone = [pushes.influence(place[None]) for place in places[::85]]
    np.testing.assert_array_equal(together[::85], np.concatenate(alone))


def test_each_of_several_pushes_slips_as_it_would_by_itself(device: Device):
    """A push leads, makes up and carries with what was found for it, whatever others were looked at between."""
    limits = {0.2: 0.9, 0.45: 0.2, 0.7: 0.05}
    pushes = [
        Push(Tip((x, 0.4), (x + 0.03, 0.42), 0.15), 1 / 60, strain_limit=limit, local=0.5)
        for x, limit in limits.items()
    ]
    fluid = Fluid(device, Grid(32, 24))
    fluid.set_velocity(0.5 * np.sin(np.arange(24 * 32 * 2).reshape(24, 32, 2)))
    warp, velocity = WarpMap(device, fluid.grid), device.field(fluid.grid.size, 2)
    warp.set(0.05 * np.sin(0.4 * np.arange(24 * 32 * 2).reshape(24, 32, 2)))

    def drawn(brushes: list[Brush]) -> list[np.ndarray]:
        fluid.impulse.clear()
        fluid.local.clear()
        velocity.clear()
        for brush, push in zip(brushes, pushes, strict=True):
            brush.lead(fluid, push, warp=warp)
        for brush, push in zip(brushes, pushes, strict=True):
            brush.make_up(fluid, push, velocity, warp)
            brush.carry(fluid, push, warp)
        return [fluid.impulse.field.get(), velocity.get(), fluid.local.field.get()]

    brushes = [Brush(device) for _ in pushes]
    together, apart = drawn(3 * brushes[:1]), drawn(brushes)
    for one, other in zip(together, apart, strict=True):
        assert np.abs(one).max() > 0
        np.testing.assert_array_equal(one, other)
    for thing in (*brushes, warp, fluid, velocity):
        thing.release()


def test_many_led_points_take_little_more_than_their_matrix_and_leave_nothing(device: Device):
    """Lines and points that are turned: what they do to each other is held once, and one copy to solve for it."""
    handles = [
        Handle((0.05 + 0.1 * k, 0.5), (0.5, 0.5), points=((0.05 + 0.1 * k, 0.1), (0.05 + 0.1 * k, 0.9)), radius=0.06)
        for k in range(10)
    ]
    handles += [Handle((0.05 + 0.1 * k, 0.3), (0.5, 0.5), rotate=90, radius=0.06) for k in range(10)]
    fluid = Fluid(device, Grid(32, 32))
    warp = WarpMap(device, fluid.grid)
    led = Handles(fluid, warp, handles)
    led.advance(1 / 60)
    pairs = 32 * sum(map(len, led.shapes)) ** 2  # bytes of a 2 x 2 matrix for each two points
    assert pairs > 2**22
    tracemalloc.start()
    led.advance(1 / 60)
    left, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert left < pairs / 4
    assert most < 5.5 * pairs
    for thing in (led, warp, fluid):
        thing.release()
