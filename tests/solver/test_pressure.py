"""The projection against a sparse direct solve in float64, and how fast it gets there."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from solver import Fluid
from solver.gl.device import Device
from solver.gl.field import Field
from solver.grid import Grid
from solver.packing import unpacked
from solver.pressure.graph import OVERCORRECTION, Graph, coarsen_links, graphs_below, has_one_piece_a_block, links_of
from solver.pressure.level import GridLevel
from solver.pressure.projection import Projection
from solver.pressure.transform import FastDiagonalization

SIZES = [(8, 8), (9, 13), (64, 64), (61, 40), (100, 23)]


def open_faces(solid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which left and upper faces lie between two fluid cells, each (ny, nx)."""
    fluid = ~solid
    left, up = np.zeros(solid.shape, bool), np.zeros(solid.shape, bool)
    left[:, 1:] = fluid[:, 1:] & fluid[:, :-1]
    up[1:] = fluid[1:] & fluid[:-1]
    return left, up


def divergence(velocity: np.ndarray) -> np.ndarray:
    """Divergence times h of a MAC velocity, float64, (ny, nx)."""
    u, v = velocity[..., 0].astype(float), velocity[..., 1].astype(float)
    return np.pad(u, ((0, 0), (0, 1)))[:, 1:] - u + np.pad(v, ((0, 1), (0, 0)))[1:] - v


def gradient_matrix(solid: np.ndarray, aspect: float = 1.0) -> sparse.csr_matrix:
    """From the cells to the open faces (left ones first): the pressure's difference across; times the aspect down."""
    number = np.arange(solid.size).reshape(solid.shape)
    left, up = open_faces(solid)
    here = np.concatenate([number[left], number[up]])
    there = np.concatenate([np.roll(number, 1, 1)[left], np.roll(number, 1, 0)[up]])
    face = np.arange(here.size)
    ones = np.r_[np.ones(left.sum()), np.full(up.sum(), aspect)]
    return sparse.csr_matrix(
        (np.r_[ones, -ones], (np.r_[face, face], np.r_[here, there])), shape=(here.size, solid.size)
    )


def exact_projection(
    velocity: np.ndarray, solid: np.ndarray, wanted: np.ndarray | None = None, aspect: float = 1.0
) -> np.ndarray:
    """The velocity without divergence (times h; or with the wanted one) nearest to the given one, by a direct solve."""
    left, up = open_faces(solid)
    faces = np.concatenate([velocity[..., 0][left], velocity[..., 1][up]]).astype(float)
    gradient = gradient_matrix(solid, aspect)
    laplacian = (gradient.T @ gradient).tolil()
    _, region = connected_components(laplacian)
    # One cell of each region holds its constant; the right-hand side sums to zero there, so nothing else changes.
    for cell in np.unique(region, return_index=True)[1]:
        laplacian[cell, cell] += 1.0
    right = gradient.T @ faces + (0 if wanted is None else wanted.ravel())
    faces = faces - gradient @ spsolve(laplacian.tocsc(), right)
    result = np.zeros((*solid.shape, 2))
    result[..., 0][left], result[..., 1][up] = faces[: left.sum()], faces[left.sum() :]
    return result


def brush(size: tuple[int, int], sigma: float = 20.0) -> np.ndarray:
    """An impulse under a Gaussian, off the middle."""
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    bell = np.exp(-((x - 0.4 * size[0]) ** 2 + (y - 0.45 * size[1]) ** 2) / (2 * sigma**2))
    return np.stack([bell, 0.6 * bell], -1).astype(np.float32)


def brushes(grid: Grid, seed: int) -> np.ndarray:
    """Six impulses, some of them against a wall."""
    rng = np.random.default_rng(seed)
    faces = np.zeros((grid.ny, grid.nx, 2))
    for _ in range(6):
        x, y = rng.uniform(0.2, 0.8, 2) * grid.extent
        force, radius = rng.standard_normal(2), rng.uniform(0.03, 0.08)
        for axis, (fx, fy) in enumerate((grid.u_faces(), grid.v_faces())):
            faces[..., axis] += force[axis] * np.exp(-((fx - x) ** 2 + (fy - y) ** 2) / (2 * radius**2))
    return faces.astype(np.float32)


def walled(size: tuple[int, int]) -> np.ndarray:
    """Two thin walls, one of them one cell thick, and a disc."""
    nx, ny = size
    x, y = np.meshgrid(np.arange(nx), np.arange(ny))
    solid = (x - 0.7 * nx) ** 2 + (y - 0.3 * ny) ** 2 < (0.12 * min(size)) ** 2
    solid[int(0.1 * ny) : int(0.8 * ny), int(0.55 * nx)] = True
    solid[: int(0.6 * ny), int(0.23 * nx) : int(0.23 * nx) + 2] = True
    return solid


def closed(velocity: np.ndarray, solid: np.ndarray) -> np.ndarray:
    """The velocity with zeros at edges and solids."""
    return velocity * np.stack(open_faces(solid), -1)


def project(
    device: Device,
    velocity: np.ndarray,
    solid: np.ndarray,
    cycles: int | None,
    source: np.ndarray | None = None,
    aspect: float = 1.0,
) -> np.ndarray:
    """The velocity after a projection on the GPU from a cold start."""
    size = solid.shape[1], solid.shape[0]
    pressure, field = Projection(device, size, (aspect / max(size), 1 / max(size))), device.double_field(size, 2)
    wanted = None if source is None else device.upload(source)
    pressure.set_solids(solid if solid.any() else None)
    field.read.set(velocity)
    pressure.project(field, cycles, wanted)
    result = field.read.get()
    for item in (pressure, field, wanted):
        if item is not None:
            item.release()
    return result


def left_over(device: Device, velocity: np.ndarray, solid: np.ndarray, cycles: int | None) -> float:
    """What a projection leaves of the divergence, relative."""
    before = np.linalg.norm(divergence(closed(velocity, solid)))
    return float(np.linalg.norm(divergence(project(device, velocity, solid, cycles))) / before)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("density", [0.0, 0.1])
@pytest.mark.parametrize("aspect", [1.0, 1.07])
def test_it_agrees_with_a_direct_solve(device: Device, size: tuple[int, int], density: float, aspect: float) -> None:
    rng = np.random.default_rng(3)
    solid = rng.random((size[1], size[0])) < density
    velocity = rng.standard_normal((size[1], size[0], 2)).astype(np.float32)
    exact = exact_projection(velocity, solid, aspect=aspect)
    result = project(device, velocity, solid, 20, aspect=aspect)
    assert np.linalg.norm(result - exact) <= 1e-4 * np.linalg.norm(exact)


@pytest.mark.parametrize("size", [(64, 64), (61, 40), (9, 13)])
def test_small_grids_without_solids_are_solved_in_one_cycle(device: Device, size: tuple[int, int]) -> None:
    solid = np.zeros((size[1], size[0]), bool)
    velocity = np.random.default_rng(3).standard_normal((size[1], size[0], 2)).astype(np.float32)
    exact = exact_projection(velocity, solid)
    assert np.linalg.norm(project(device, velocity, solid, 1) - exact) <= 1e-5 * np.linalg.norm(exact)


@pytest.mark.parametrize("span", [(42.625, 64.0), (13.5, 9.25), (7.0, 25.75)])
@pytest.mark.parametrize("aspect", [1.0, 1.1])
def test_grids_with_cells_less_than_whole_are_solved_exactly(
    device: Device, span: tuple[float, float], aspect: float
) -> None:
    level = GridLevel(device, span, aspect, 1)
    solver = FastDiagonalization(device, span, level.size, aspect)
    # What some pressure accounts for, A p: the residual of -p.
    random = device.upload(np.random.default_rng(6).standard_normal((level.size[1], level.size[0], 4)))
    applied, products = device.field(level.size, 4), device.field(level.size, 4)

    def laplacian(pressure: Field) -> np.ndarray:
        targets = level.pressure.write, applied, products
        level.draw("apply_operator", targets, {"FIRST": 1}, z=pressure, residual=level.residual)
        return applied.get()

    wanted = laplacian(random)
    level.residual.set(wanted)
    solver.solve(level.residual, level.pressure.read)
    assert np.linalg.norm(laplacian(level.pressure.read) - wanted) <= 1e-5 * np.linalg.norm(wanted)
    for item in (solver, level, random, applied, products):
        item.release()


SIZES_TO_REACH = [(512, 512), (333, 217), (512, 100), (257, 255)]


def worst_left_over(device: Device, grid: Grid, solid: np.ndarray, seeds: range) -> float:
    """What the projection leaves of the divergence after the cycles it takes itself, relative."""
    pressure, field = Projection(device, grid.size), device.double_field(grid.size, 2)
    pressure.set_solids(solid if solid.any() else None)
    left = []
    for seed in seeds:
        velocity = brushes(grid, seed)
        field.read.set(velocity)
        pressure.project(field)
        before = np.linalg.norm(divergence(closed(velocity, solid)))
        left.append(float(np.linalg.norm(divergence(field.read.get())) / before))
    for item in (pressure, field):
        item.release()
    return max(left)


@pytest.mark.parametrize("size", [*SIZES_TO_REACH, (512, 341), (640, 426)])
def test_its_own_number_of_cycles_does_for_brushes(device: Device, size: tuple[int, int]) -> None:
    grid = Grid(*size)
    assert worst_left_over(device, grid, np.zeros((grid.ny, grid.nx), bool), range(1, 4)) <= 1e-3


@pytest.mark.parametrize("size", SIZES_TO_REACH)
def test_its_own_number_of_cycles_does_with_thin_walls(device: Device, size: tuple[int, int]) -> None:
    assert worst_left_over(device, Grid(*size), walled(size), range(1, 3)) <= 1e-3


@pytest.mark.parametrize("size", SIZES_TO_REACH)
def test_three_cycles_do_and_four_with_thin_walls(device: Device, size: tuple[int, int]) -> None:
    velocity = brushes(Grid(*size), 1)
    assert left_over(device, velocity, np.zeros((size[1], size[0]), bool), 3) <= 1e-3
    assert left_over(device, velocity, walled(size), 4) <= 1e-3


def test_faces_worked_out_are_the_faces_stored(device: Device) -> None:
    size = (333, 217)
    velocity, pressure = device.double_field(size, 2), Projection(device, size)
    results = []
    for solid in (None, np.zeros(size[::-1], bool)):
        pressure.set_solids(solid)
        velocity.read.set(brushes(Grid(*size), 1))
        pressure.project(velocity, 12)
        results.append(pressure.pressure.astype(float))
    results = [pressure - pressure.mean() for pressure in results]
    assert np.linalg.norm(results[1] - results[0]) <= 1e-5 * np.linalg.norm(results[0])


def test_three_cycles_do_for_noise(device: Device) -> None:
    noise = np.random.default_rng(1).standard_normal((217, 333, 2)).astype(np.float32)
    assert left_over(device, noise, np.zeros((217, 333), bool), 3) <= 1e-3


def masks(size: tuple[int, int]) -> dict[str, np.ndarray]:
    nx, ny = size
    x, y = np.meshgrid(np.arange(nx), np.arange(ny))
    rng = np.random.default_rng(5)
    return {
        "all solid": np.ones((ny, nx), bool),
        "one fluid cell": (x != 5) | (y != 4),
        "checkerboard": (x + y) % 2 == 0,
        "dots": (x % 2 == 0) & (y % 2 == 0),
        "a third": rng.random((ny, nx)) < 0.33,
        "half": rng.random((ny, nx)) < 0.5,
        "channels": x % 9 == 4,
        "pockets": np.abs(np.hypot(x % 30 - 15, y % 30 - 15) - 10) < 1.0,
    }


@pytest.mark.parametrize("name", sorted(masks((8, 8))))
def test_no_mask_makes_the_divergence_grow(device: Device, name: str) -> None:
    size = (120, 83)
    solid = masks(size)[name]
    velocity = np.random.default_rng(2).standard_normal((83, 120, 2)).astype(np.float32)
    before = np.linalg.norm(divergence(closed(velocity, solid)))
    for cycles in (1, 3, 8):
        result = project(device, velocity, solid, cycles)
        assert np.isfinite(result).all()
        assert np.linalg.norm(divergence(result)) <= 1.0001 * before
        assert not result[~np.stack(open_faces(solid), -1)].any()


def test_edges_are_exactly_zero(device: Device) -> None:
    velocity = np.ones((40, 61, 2), np.float32)
    result = project(device, velocity, np.zeros((40, 61), bool), 2)
    assert not result[:, 0, 0].any()
    assert not result[0, :, 1].any()


@pytest.mark.parametrize("aspect", [1.0, 1.1])
def test_a_source_makes_its_divergence_less_the_mean(device: Device, aspect: float) -> None:
    """Also where cells are wider than high."""
    size, solid = (90, 61), walled((90, 61))
    x, y = np.meshgrid(np.arange(90), np.arange(61))
    source = (np.exp(-((x - 45.0) ** 2 + (y - 40.0) ** 2) / 50) * 0.7).astype(np.float32)
    wanted = np.where(solid, 0.0, source - source[~solid].mean()) * aspect / max(size)  # times the width of a cell
    result = project(device, np.zeros((61, 90, 2), np.float32), solid, 10, source, aspect)
    assert np.linalg.norm(divergence(result * (1, aspect)) - wanted) <= 1e-4 * np.linalg.norm(wanted)
    exact = exact_projection(np.zeros((61, 90, 2)), solid, wanted, aspect)
    assert np.linalg.norm(result - exact) <= 1e-3 * np.linalg.norm(exact)


@pytest.mark.parametrize("seed", [7000286, 7000496, 7000804])
def test_more_cycles_than_float32_holds_leave_no_more(device: Device, seed: int) -> None:
    """Among hundreds of enclosed regions what is rounded off has no pressure: going on after that adds nothing."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(8, 80)), int(rng.integers(8, 80))
    solid = rng.random(size[::-1]) < rng.uniform(0.05, 0.6)
    velocity = closed(rng.standard_normal((*size[::-1], 2)).astype(np.float32), solid)
    assert left_over(device, velocity, solid, 40) <= 1e-5


def test_the_pressure_is_what_was_subtracted(device: Device) -> None:
    size = (61, 40)
    pressure, field = Projection(device, size), device.double_field(size, 2)
    velocity = np.random.default_rng(4).standard_normal((40, 61, 2)).astype(np.float32)
    field.read.set(velocity)
    pressure.project(field, 4)
    gradient_x = np.diff(pressure.pressure.astype(float), axis=1) * max(size)
    np.testing.assert_allclose(field.read.get()[:, 1:, 0], velocity[:, 1:, 0] - gradient_x, atol=1e-5)


def test_a_warm_start_is_never_worse(device: Device) -> None:
    """Two steps with the same impulse, then a third with another multiple of it."""
    size = (256, 192)
    pressure, field = Projection(device, size), device.double_field(size, 2)
    field.read.set(brush(size, 16.0))
    pressure.project(field, 1)
    cold = np.linalg.norm(divergence(field.read.get()))
    for change, most in ((1.0, 0.05), (-1.0, 1.01), (0.01, 0.011), (100.0, 101.0)):
        pressure.forget()
        for _ in range(2):
            field.read.set(brush(size, 16.0))
            pressure.project(field, 3, warm=True)
        field.read.set(change * brush(size, 16.0))
        pressure.project(field, 1, warm=True)
        assert np.linalg.norm(divergence(field.read.get())) < most * cold


def test_what_changes_steadily_takes_one_cycle(device: Device) -> None:
    size = (256, 192)
    pressure, field = Projection(device, size), device.double_field(size, 2)
    cycles = []
    for step in range(6):
        field.read.set((1.0 + 0.1 * step) * brush(size, 16.0))
        before = np.linalg.norm(divergence(field.read.get()))
        cycles.append(pressure.project(field, warm=True))
        assert np.linalg.norm(divergence(field.read.get())) <= 1e-3 * before
    assert cycles[0] > 1
    assert max(cycles[3:]) <= 1


def test_a_source_in_a_closed_pocket_loses_its_mean_there(device: Device) -> None:
    """Nothing flows out of the pocket, and outside of it nothing has to make up for what is wanted inside."""
    size = (96, 72)
    x, y = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    distance = np.hypot(x - 40, y - 36)
    solid = (distance > 12) & (distance < 16)
    solid |= (abs(x - 80) + abs(y - 60)) == 1  # and a single cell in a pocket of its own
    asked = np.where(distance < 6, 1.0, 0.0) + np.where((x > 60) & (y < 30), 0.5, 0.0) + (x == 80) * (y == 60)
    wanted = asked.copy()
    region = np.zeros(solid.shape, int)
    ndimage.label(~solid, output=region)
    for number in range(1, region.max() + 1):
        wanted[region == number] -= asked[region == number].mean()
    wanted = np.where(solid, 0.0, wanted) / max(size)
    result = project(device, np.zeros((72, 96, 2), np.float32), solid, None, asked.astype(np.float32))
    assert np.linalg.norm(divergence(result) - wanted) <= 1e-3 * np.linalg.norm(wanted)


def test_step_after_step_leaves_little_over_a_stiff_mask(device: Device) -> None:
    """A warm start leaves what cycles before it were worst at: chosen by its roughness alone, they let that grow."""
    grid = Grid(192, 192)
    x, y = grid.centres()
    fluid = Fluid(device, grid)
    hard = (np.hypot(x - 0.3, y - 0.4) < 0.12) | (np.abs(y - 0.75) < 0.03)
    soft = np.exp(-((x - 0.7) ** 2 + (y - 0.45) ** 2) / (2 * 0.08**2))
    fluid.set_viscosity(1e-4 * 1e5 ** np.maximum(hard, soft))
    start, push = (0.5 * faces / np.abs(faces).max() for faces in (brushes(grid, 1), brushes(grid, 5)))
    fluid.set_velocity(start)
    fluid.measuring = True
    force = device.upload(push)
    left = []
    for _ in range(120):
        fluid.step(1 / 60, [(force, 1e-3)])
        left.append(fluid.residuals.divergence_left)
    assert max(left) <= 1.5e-3
    assert np.quantile(left, 0.95) <= 1e-3


def test_a_trend_does_not_carry_noise_on(device: Device) -> None:
    """Noise that is new in each step, as rounding is: of three steps' the trend alone would add up sqrt(6) times it."""
    size, rng, parts = (128, 96), np.random.default_rng(6), []
    pressure, field = Projection(device, size), device.double_field(size, 2)
    for step in range(24):
        noise = 1e-3 * rng.standard_normal((96, 128, 2)).astype(np.float32)
        field.read.set((1.0 + 0.01 * step) * brush(size, 8.0) + noise)
        expected = unpacked(pressure.state()[1].get())
        given = closed(field.read.get(), np.zeros((96, 128), bool))
        given[:, 1:, 0] -= np.diff(expected, axis=1)
        given[1:, :, 1] -= np.diff(expected, axis=0)
        left = np.linalg.norm(divergence(given))
        parts.append(left / np.linalg.norm(divergence(closed(noise, np.zeros((96, 128), bool)))))
        pressure.project(field, 4, warm=True)
    assert max(parts[12:]) < 1.6


# -- pieces of cells and the links between them, by brute force -------------------------------------------------------


def linked(seed: int, size: tuple[int, int] = (7, 9)) -> tuple[np.ndarray, np.ndarray]:
    """The links between cells of which some are closed, some in part."""
    closed = np.random.default_rng(seed).choice([0, 0, 0.3, 1], size).astype(np.float32)
    return links_of(closed)


def matrix_of(graph: Graph) -> np.ndarray:
    """The links of a graph as a symmetric matrix."""
    matrix = np.zeros((len(graph.place),) * 2)
    for (one, other), weight in zip(graph.ends.tolist(), graph.weight.tolist(), strict=True):
        matrix[one, other] += weight
        matrix[other, one] += weight
    return matrix


def test_a_link_is_as_open_as_the_cell_beside_it_that_is_closed_more() -> None:
    closed = np.random.default_rng(1).random((5, 7)).astype(np.float32)
    left, up = links_of(closed)
    for y, x in np.ndindex(5, 7):
        assert left[y, x] == pytest.approx(1 - max(closed[y, x], closed[y, x - 1]) if x else 0)
        assert up[y, x] == pytest.approx(1 - max(closed[y, x], closed[y - 1, x]) if y else 0)


@pytest.mark.parametrize("size", [(6, 8), (7, 9), (5, 8), (1, 6)])
def test_links_between_blocks_are_the_means_of_those_between_their_cells(size: tuple[int, int]) -> None:
    left, up = linked(2, size)
    for links, coarse, step in ((left, coarsen_links(left, up)[0], (0, 1)), (up, coarsen_links(left, up)[1], (1, 0))):
        assert coarse.shape == tuple(-(-side // 2) for side in size)
        for y, x in np.ndindex(*coarse.shape):
            along = [(2 * y + k * step[1], 2 * x + k * step[0]) for k in (0, 1)]
            values = [links[place] if place[0] < size[0] and place[1] < size[1] else 0 for place in along]
            assert coarse[y, x] == pytest.approx(sum(values) / 2)


@pytest.mark.parametrize("seed", range(40))
def test_whether_the_cells_of_each_block_are_one_piece(seed: int) -> None:
    """Those without any link count to none; from few closed cells on, to many."""
    rng = np.random.default_rng(seed)
    closed = (rng.random((5, 6)) < 0.03 * (seed % 10)).astype(np.float32)
    left, up = links_of(closed)
    graph = Graph.of_cells(left, up, 1.0)
    matrix, block = matrix_of(graph) > 0, graph.place // 2
    together = matrix & (block[:, None] == block).all(axis=-1)
    piece = connected_components(sparse.csr_matrix(together))[1]
    pieces = {(*block[one].tolist(), piece[one]) for one in np.flatnonzero(matrix.any(axis=1))}
    assert has_one_piece_a_block(left, up) == (len(pieces) == len({where[:2] for where in pieces}))


@pytest.mark.parametrize("aspect", [1.0, 0.7])
@pytest.mark.parametrize("seed", range(4))
def test_a_coarser_graph_has_the_pieces_of_blocks_and_all_links_between_them(seed: int, aspect: float) -> None:
    graph = Graph.of_cells(*linked(seed), aspect)
    left, up = linked(seed)
    assert graph.weight.sum() == pytest.approx(left.sum() + aspect**2 * up.sum(), rel=1e-6)
    coarse, parent = graph.coarsen()
    matrix, block = matrix_of(graph), graph.place // 2
    together = (matrix > 0) & (block[:, None] == block).all(axis=-1)
    piece = connected_components(sparse.csr_matrix(together))[1]
    between = np.where(piece[:, None] != piece, matrix, 0)
    for number in range(piece.max() + 1):
        mine = piece == number
        parents = set(parent[mine].tolist())
        assert len(parents) == 1
        assert (parents == {-1}) == (not between[mine].any())
    kept = parent >= 0
    members = np.zeros((len(coarse.place), len(parent)))
    members[parent[kept], np.flatnonzero(kept)] = 1
    np.testing.assert_allclose(matrix_of(coarse), members @ between @ members.T / OVERCORRECTION, atol=1e-6)
    np.testing.assert_array_equal(coarse.place[parent[kept]], block[kept])


@pytest.mark.parametrize("seed", range(4))
def test_graphs_below_a_grid_lead_from_each_cell_down_to_few_unknowns(seed: int) -> None:
    cells = Graph.of_cells(*linked(seed, (14, 17)), 1.0)
    graphs, parents = graphs_below(cells, 6)
    assert len(graphs[-1].place) <= 6
    assert all(len(graph.place) > 6 for graph in graphs[:-1])
    assert len(parents) == len(graphs)
    for (finer, coarser), parent in zip(zip([cells, *graphs], graphs, strict=False), parents, strict=True):
        kept = parent >= 0
        np.testing.assert_array_equal(coarser.place[parent[kept]], finer.place[kept] // 2)
        if finer is not cells:  # side by side, and what stands for nothing last
            assert (np.diff(np.where(kept, parent, len(coarser.place))) >= 0).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_graph_is_solved_on_each_of_its_components_and_knows_its_neighbours(seed: int) -> None:
    graph = Graph.of_cells(*linked(seed, (4, 5)), 0.8)
    links = matrix_of(graph)
    matrix = links - np.diag(links.sum(axis=1))
    rhs = matrix @ np.random.default_rng(seed).standard_normal(len(links))  # sums to 0 in each component
    found = graph.inverse() @ rhs
    np.testing.assert_allclose(matrix @ found, rhs, atol=1e-9)
    np.testing.assert_allclose(found, np.linalg.pinv(matrix) @ rhs, atol=1e-9)  # and so does the solution
    begins, counts, listed = graph.neighbours()
    again = np.zeros_like(links)
    for one, (begin, count) in enumerate(zip(begins, counts, strict=True)):
        for other, weight in listed[begin : begin + count]:
            again[one, int(other)] += weight
    np.testing.assert_allclose(again, links)
