"""The hand's camera by way of the joints, against MuJoCo's own."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from toy_demonstrations import demonstrations

from jaxplan import tasks
from jaxplan.learning import PredictorTraining, predictor
from jaxplan.networks import EncoderConfig, HandCameraConfig, Predictor, PredictorConfig
from jaxplan.networks.hand_camera import camera_pose, on_plane
from jaxplan.robots import PANDA
from jaxplan.tasks.mug import scene
from jaxplan.tasks.perturbation import Perturbation

CONFIG = HandCameraConfig()


@pytest.fixture(scope="module")
def data() -> mujoco.MjData:
    return mujoco.MjData(scene.build())


def configurations() -> np.ndarray:
    noise = np.random.default_rng(0).normal(0, 0.2, (6, 7))
    return (PANDA.q_home + noise).astype(np.float32)


def look(data: mujoco.MjData, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    data.qpos[:7] = q
    mujoco.mj_kinematics(data.model, data)
    mujoco.mj_camlight(data.model, data)
    camera = data.camera("hand")
    return camera.xpos.copy(), camera.xmat.reshape(3, 3).copy()


def test_the_mount_is_the_scene_s(data):
    camera = data.model.camera("hand")
    assert camera.fovy[0] == CONFIG.fovy
    assert pytest.approx(CONFIG.aspect) == scene.IMAGE_WIDTH / scene.IMAGE_HEIGHT
    q = configurations()
    position, axes = camera_pose(CONFIG, jnp.asarray(q))
    for row in range(len(q)):
        expected = look(data, q[row])
        np.testing.assert_allclose(position[row], expected[0], atol=1e-5)
        np.testing.assert_allclose(axes[row], expected[1], atol=1e-5)


def test_a_seen_point_is_found_again_on_the_plane(data):
    """Project with MuJoCo's camera, and back by `on_plane`."""
    points = np.array([[0.5, 0.05, CONFIG.plane], [0.42, -0.1, CONFIG.plane]])
    for q in configurations():
        eye, axes = look(data, q)
        local = (points - eye) @ axes
        image = local[:, :2] / -local[:, 2:] / np.tan(np.radians(CONFIG.fovy) / 2)
        image *= [1 / CONFIG.aspect, -1]
        found = on_plane(CONFIG, jnp.asarray(image, jnp.float32), jnp.asarray(q))
        found = np.asarray(found) * CONFIG.scale + CONFIG.centre
        np.testing.assert_allclose(found, points[:, :2], atol=1e-5)


def test_a_ray_near_the_horizon_stays_finite():
    q = jnp.zeros(
        7
    )  # the arm stretched out: the camera looks down; now level with the table
    for wrist in (0.0, 1.5, 2.5):
        found = on_plane(CONFIG, jnp.ones((1, 2)), q.at[5].set(wrist))
        assert np.all(np.abs(found) <= 3.0)


def test_a_perturbed_mount_is_where_mujoco_has_it():
    """The error that a picture was drawn with, given to the network's kinematics."""
    task = tasks.load(
        "mug", 1, perturbation=Perturbation(10, 10, 0.02, each_query=True)
    )
    task.reset([0], [5])
    for row, q in enumerate(configurations()):
        task.observe_at(0, q)
        found = camera_pose(CONFIG, jnp.asarray(q), jnp.asarray(task.eyes.error(0)))
        look = task.eyes._look(0)._data.camera("hand")
        np.testing.assert_allclose(found[0], look.xpos, atol=1e-5)
        np.testing.assert_allclose(found[1], look.xmat.reshape(3, 3), atol=1e-5)
        if row == 0:
            assert (
                np.abs(found[1] - camera_pose(CONFIG, jnp.asarray(q))[1]).max() > 0.01
            )


def test_a_calibrating_network_begins_with_the_camera_as_it_is_mounted():
    """And learns to say how it is off: the loss has gradients for all of its weights."""
    encoder = EncoderConfig(stem="patch4", width=4, blocks=(1, 1), keypoints=4)
    config = PredictorConfig(encoder, CONFIG, calibrates=True, dropout=0.0)
    training = PredictorTraining(network=config)
    frames = predictor.gather(demonstrations(), np.arange(4))
    params = predictor.init(config, jax.random.key(0), frames)
    said = jax.jit(Predictor(config).apply)(
        params, frames.image, frames.q, frames.gripper
    )
    np.testing.assert_array_equal(said.camera_error, 0)
    plain = PredictorConfig(encoder, CONFIG, dropout=0.0)
    weights = {k: v for k, v in params["params"].items() if not k.startswith("camera_")}
    other = jax.jit(Predictor(plain).apply)(
        {"params": weights}, frames.image, frames.q, frames.gripper
    )
    np.testing.assert_allclose(other.q_toggle, said.q_toggle, atol=1e-5)

    def value(params):
        return predictor.loss(training, params, jax.random.key(1), frames)

    (_, terms), slope = jax.jit(jax.value_and_grad(value, has_aux=True))(params)
    assert terms["camera"] > 0
    assert np.abs(slope["params"]["camera_error"]["kernel"]).max() > 0
