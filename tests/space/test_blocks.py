"""Chains of blocks are solved as a dense system solves them, and cells are those that MuJoCo compiles."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.jax_setup import LEAST_EFFORT, in_float64, known_options
from belt_sim.space import Options
from belt_sim.space.belt import ActiveFeatures, belt_arrays
from belt_sim.space.elastic import block_inverse, factorise, solve_chain, stretch_energy
from belt_sim.space.native import SpaceRun
from belt_sim.space.options import fit_options
from studies.paper.case import ROPE_EXAMPLE

COARSE = {"dx": 0.04, "run_in": 0.2}


@pytest.mark.parametrize("rows", [1, 2, 21, 150])
@in_float64
def test_a_chain_of_blocks_is_solved(rows):
    random = np.random.default_rng(1)
    beside = 0.3 * random.normal(size=(3, 3, rows))
    beside[..., -1] = 0.0
    roots = random.normal(size=(3, 3, rows))
    diagonal = np.einsum("ijn,kjn->ikn", roots, roots) + 4.0 * np.eye(3)[:, :, None]
    wanted = random.normal(size=(3, 2, rows))
    whole = np.zeros((rows, 3, rows, 3))
    for i in range(rows):
        whole[i, :, i] = diagonal[..., i]
        if i + 1 < rows:
            whole[i, :, i + 1], whole[i + 1, :, i] = beside[..., i], beside[..., i].T
    dense = np.linalg.solve(whole.reshape(3 * rows, -1), np.moveaxis(wanted, -1, 0).reshape(3 * rows, 2))
    found = jax.jit(lambda d, b, w: solve_chain(factorise(d, b), w), compiler_options=known_options(LEAST_EFFORT))(
        diagonal, beside, wanted
    )
    np.testing.assert_allclose(np.moveaxis(found, -1, 0).reshape(3 * rows, 2), dense, rtol=0, atol=1e-13)


@pytest.mark.parametrize("size", [1, 2, 3, 4, 6, 9])
@in_float64
def test_blocks_are_inverted(size):
    """Stiff along one direction, as links are."""
    random = np.random.default_rng(size)
    roots, along = random.normal(size=(2, 5, size, size))
    blocks = roots @ roots.swapaxes(1, 2) + np.eye(size) + 1e4 * along[:, :, :1] * along[:, None, :, 0]
    found = np.moveaxis(
        np.asarray(jax.jit(block_inverse, compiler_options=known_options(LEAST_EFFORT))(np.moveaxis(blocks, 0, -1))),
        -1,
        0,
    )
    np.testing.assert_allclose(found, np.linalg.inv(blocks), rtol=0, atol=1e-9)


@pytest.mark.parametrize(("kind", "across"), [("flex", 2), ("flex", 3), ("grid", 2), ("grid", 3)])
@in_float64
def test_forces_are_those_of_the_compiled_scene(kind, across):
    case = paper_case(20.0, rig=ROPE_EXAMPLE)
    run = SpaceRun(case, kind, fit_options(Options(across=across, **COARSE), case, kind))
    belt = belt_arrays(run.scene, ActiveFeatures())
    shape = belt.shape
    mesh = run.scene.mesh
    slides = mesh.laid - mesh.rest + 1e-5 * np.random.default_rng(2).normal(size=mesh.rest.shape)
    expected = run.solver.elastic_forces(slides)
    places = jnp.moveaxis(jnp.array(mesh.rest + slides), 0, -1)
    ties = jax.tree.map(jnp.asarray, belt.ties)
    stretch = jax.jit(stretch_energy, static_argnums=1, compiler_options=known_options(LEAST_EFFORT))
    slope = np.asarray(stretch(ties, shape.bonds, places, jnp.arange(shape.stations), jnp.array(1.0)).slope)
    size = 3 * shape.lines
    found = -(slope[:size] + np.roll(slope[size:], 1, axis=-1)).T.reshape(expected.shape)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
