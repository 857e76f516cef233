"""Peers answer the same questions: same verdicts, valid paths, same network."""

import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest

from jaxplan.evaluation.motion_bench import (
    BenchProblem,
    data_directory,
    read_problems,
    read_robot,
    sphere_cage,
    table,
)

sys.path.append(str(Path(__file__).parents[1] / "eval"))


@pytest.fixture(scope="module")
def robot() -> dict:
    return read_robot(data_directory())


@pytest.fixture(scope="module")
def problems() -> list[BenchProblem]:
    sets = read_problems(data_directory()).values()
    return [sphere_cage(), table(), *(rows[0] for rows in sets)]


def verdicts(model, rows) -> np.ndarray:
    """C MuJoCo's: whether there is no contact."""
    data, free = mujoco.MjData(model), []
    for q in rows:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        free.append(data.ncon == 0)
    return np.array(free)


def test_what_is_not_installed_is_said_and_not_raised():
    from peers import absent

    assert absent("numpy") is None
    assert "no_such_planner is not installed" in str(absent("no_such_planner"))


def test_the_peers_layout_changes_no_verdict(robot, problems):
    from peers import peer_model

    from jaxplan.evaluation.motion_bench import obstacles_mjcf, robot_mjcf

    for problem in problems:
        text = robot_mjcf(robot, obstacles_mjcf(problem.obstacles))
        plain = mujoco.MjModel.from_xml_string(text)
        rows = np.random.default_rng(0).uniform(*plain.jnt_range.T, (300, 7))
        np.testing.assert_array_equal(
            verdicts(plain, rows), verdicts(peer_model(robot, problem.obstacles), rows)
        )


def test_ompl_obeys_seeds_and_its_paths_hold(robot, problems):
    pytest.importorskip("ompl")
    from peers import peer_model
    from peers.ompl_peer import RESOLUTION, OmplPlanner, solve_in_processes

    for problem in (p for p in problems if p.set != "cage"):  # which takes a second
        model = peer_model(robot, problem.obstacles)
        planner = OmplPlanner(model, range=1.0)
        answers = [
            planner.solve(problem.q_start, problem.q_goal, seed) for seed in (0, 1, 0)
        ]
        first, other, again = answers
        assert first.solved
        assert first.checks == again.checks
        np.testing.assert_array_equal(first.path, again.path)
        assert first.checks != other.checks
        np.testing.assert_array_equal(first.path[0], problem.q_start)
        np.testing.assert_array_equal(first.path[-1], problem.q_goal)
        for a, b in zip(first.path, first.path[1:], strict=False):
            assert np.linalg.norm(b - a) <= 1 + 1e-9
            steps = int(np.ceil(np.linalg.norm(b - a) / RESOLUTION))
            assert verdicts(model, np.linspace(a, b, steps + 1)).all()
    tables = [problem for problem in problems if problem.set == "table"]
    (elsewhere,), _ = solve_in_processes(robot, tables, [0], 1, range=1.0)
    here = OmplPlanner(peer_model(robot, tables[0].obstacles), range=1.0)
    path = here.solve(tables[0].q_start, tables[0].q_goal, 0).path
    np.testing.assert_array_equal(elsewhere.path, path)


def test_pybullet_agrees_with_mujoco(robot, problems):
    pytest.importorskip("pybullet")
    from peers import peer_model
    from peers.pybullet_peer import PybulletChecker

    for problem in problems:
        model = peer_model(robot, problem.obstacles)
        rows = np.random.default_rng(0).uniform(*model.jnt_range.T, (300, 7))
        checker = PybulletChecker(robot, problem.obstacles)
        same = checker.config_free(rows) == verdicts(model, rows)
        checker.close()
        assert same.mean() > 0.99  # single precision, and margins on its boxes


def torch_weights(sampler):
    """The denoiser's weights under short names, and a layer of ours from one of torch's."""
    import jax.numpy as jnp

    weights = {
        k.removeprefix("denoiser."): jnp.asarray(v.numpy())
        for k, v in sampler.state_dict().items()
    }

    def dense(name):
        kernel = weights[f"{name}.weight"]
        if kernel.ndim == 3:  # [out, in, taps]: ours has the taps in a row
            kernel = kernel.transpose(2, 1, 0).reshape(-1, len(kernel))
        else:
            kernel = kernel.T
        return {"kernel": kernel, "bias": weights[f"{name}.bias"]}

    return weights, dense


def check_same_eps(theirs, params):
    """Ours with torch's weights says what torch says."""
    import torch

    from jaxplan.networks import SamplerNetwork

    config, rng = theirs.config, np.random.default_rng(0)
    x_t = rng.normal(size=(4, config.size)).astype("f")
    cond, t = rng.normal(size=(4, config.cond_features)), np.array([0, 4, 48, 96])
    cond = cond.astype("f")
    network, params = SamplerNetwork(config), {"params": params}
    film = network.apply(params, cond, t, method="film")
    ours = network.apply(params, x_t, film, method="denoise")
    with torch.inference_mode():
        eps = theirs(*map(torch.tensor, (x_t, t.astype("f"), cond))).numpy()
    np.testing.assert_allclose(ours, eps, atol=2e-5)
    assert theirs.draw(torch.tensor(cond)).shape == (4, config.size)


@pytest.mark.parametrize("tree_context", [False, True])
def test_torch_has_our_film_mlp(tree_context):
    torch = pytest.importorskip("torch")
    import jax
    import jax.numpy as jnp
    from peers.torch_peer import TorchSampler

    from jaxplan.networks import SamplerConfig

    config = SamplerConfig(
        denoiser="film_mlp",
        hidden=(16, 16),
        encoder=None,
        tree_context=tree_context,
    )
    torch.manual_seed(0)
    theirs = TorchSampler(config)
    weights, dense = torch_weights(theirs)

    def norm(name):
        return {"scale": weights[f"{name}.weight"], "bias": weights[f"{name}.bias"]}

    layers = [f"{part}.{i}" for i in range(2) for part in ("first", "second")]
    layers = ["begin", *layers, "end.2"]
    norms = ["norm.0", "norm.1", "end.0"]
    films = [dense(f"film.{i}") for i in range(2)]
    params = {
        "step": {"layers_0": dense("step.0"), "layers_2": dense("step.2")},
        "modulation": jax.tree.map(lambda *x: jnp.concatenate(x, -1), *films),
        "denoiser": {
            **{f"Dense_{i}": dense(name) for i, name in enumerate(layers)},
            **{f"LayerNorm_{i}": norm(name) for i, name in enumerate(norms)},
        },
    }
    check_same_eps(theirs, params)


def test_torch_has_our_unet():
    torch = pytest.importorskip("torch")
    import jax
    import jax.numpy as jnp
    from peers.torch_peer import TorchSampler

    from jaxplan.networks import SamplerConfig

    config = SamplerConfig(hidden=(16, 24, 32), encoder=None)
    torch.manual_seed(0)
    theirs = TorchSampler(config)
    weights, dense = torch_weights(theirs)

    def conv_block(name):
        norm = {"scale": weights[f"{name}.1.weight"], "bias": weights[f"{name}.1.bias"]}
        return {"Conv1d_0": {"Dense_0": dense(f"{name}.0")}, "GroupNorm_0": norm}

    def film_block(name):
        block = {
            "ConvBlock_0": conv_block(f"{name}.first"),
            "ConvBlock_1": conv_block(f"{name}.second"),
        }
        if f"{name}.shortcut.weight" in weights:
            block["Dense_0"] = dense(f"{name}.shortcut")
        return block

    def transposed(name):
        taps, bias = weights[f"{name}.weight"], weights[f"{name}.bias"]
        even = {"kernel": jnp.concatenate([taps[..., 3], taps[..., 1]]), "bias": bias}
        odd = {"kernel": jnp.concatenate([taps[..., 2], taps[..., 0]]), "bias": bias}
        return {"even": even, "odd": odd}

    levels = [f"down.{i}" for i in range(3)] + ["middle", "up.0", "up.1"]
    names = [f"{level}.{half}" for level in levels for half in ("first", "second")]
    films = [dense(f"{name}.film.1") for name in names]
    params = {
        "step": {"layers_0": dense("step.0"), "layers_2": dense("step.2")},
        "modulation": jax.tree.map(lambda *x: jnp.concatenate(x, -1), *films),
        "denoiser": {
            **{f"FilmBlock_{i}": film_block(name) for i, name in enumerate(names)},
            **{f"Conv1d_{i}": {"Dense_0": dense(f"downsample.{i}")} for i in range(2)},
            **{f"ConvTranspose1d_{i}": transposed(f"upsample.{i}") for i in range(2)},
            "ConvBlock_0": conv_block("end.0"),
            "Dense_0": dense("end.1"),
        },
    }
    check_same_eps(theirs, params)
