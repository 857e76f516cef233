"""The Panda's looks change nothing that physics or planning sees."""

from importlib import resources

import mujoco
import numpy as np
import pytest

from jaxplan.robots.panda.visual import add_visuals
from jaxplan.scene.surface import box, lathe


@pytest.fixture(scope="module")
def models() -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The Panda without and with its looks."""
    text = (resources.files("jaxplan.robots.panda") / "panda.xml").read_text()
    spec = mujoco.MjSpec.from_string(text)
    add_visuals(spec)
    return mujoco.MjModel.from_xml_string(text), spec.compile()


def test_visuals_have_neither_mass_nor_contacts(models):
    bare, dressed = models
    np.testing.assert_array_equal(dressed.body_mass, bare.body_mass)
    np.testing.assert_array_equal(dressed.body_inertia, bare.body_inertia)
    visual = dressed.geom_group == 2
    assert visual.sum() == dressed.ngeom - bare.ngeom
    assert not dressed.geom_contype[visual].any()
    assert not dressed.geom_conaffinity[visual].any()


def test_every_moving_part_is_seen_within_the_triangle_budget(models):
    _, dressed = models
    seen = {
        dressed.body(dressed.geom_bodyid[i]).name
        for i in range(dressed.ngeom)
        if dressed.geom_group[i] == 2
    }
    assert seen == {
        *(f"link{i}" for i in range(8)),
        "hand",
        "left_finger",
        "right_finger",
    }
    assert dressed.nmeshface < 8000


def test_nothing_stands_before_the_wrist_camera(models):
    _, dressed = models
    data = mujoco.MjData(dressed)
    data.qpos[:] = [0, -0.35, 0, -2.2, 0, 1.85, 0.785, 0.04, 0.04]
    mujoco.mj_forward(dressed, data)
    hand = data.body("hand")
    group = np.array([0, 0, 1, 0, 0, 0], np.uint8)
    hit = np.zeros(1, np.int32)
    for x, y in np.stack(
        np.meshgrid(np.linspace(-0.3, 0.5, 9), np.linspace(-0.9, 0.9, 9)), -1
    ).reshape(-1, 2):
        ray = hand.xmat.reshape(3, 3) @ np.array([x, y, 1.0])
        eye = hand.xpos + hand.xmat.reshape(3, 3) @ np.array([0.065, 0, 0])
        assert mujoco.mj_ray(dressed, data, eye, ray, group, 1, -1, hit) < 0


@pytest.mark.parametrize("axis", "xyz")
def test_surfaces_are_closed_and_face_outwards(axis):
    radius, height, half = 0.3, 0.8, np.array([0.1, 0.2, 0.3])
    cylinder = lathe([(radius, 0), (radius, height)], axis, (1, 2, 3))
    for surface, volume in (
        (cylinder, np.pi * radius**2 * height),
        (box((4, 5, 6), half), 8 * half.prod()),
    ):
        corner = surface.vertices[surface.faces]
        assert np.linalg.det(corner).sum() / 6 == pytest.approx(volume, rel=0.02)
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        np.testing.assert_allclose(area.sum(0), 0, atol=1e-12)
