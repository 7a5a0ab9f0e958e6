"""The one frame path: a moved model looks as a new one does, under one context."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab import _gl
from revolver_lab.errors import AlphaError, SettingsError, UnknownNameError
from revolver_lab.lab import cameras, gl, poses
from revolver_lab.lab.frames import Stage

pytestmark = pytest.mark.skipif(not _gl.choose().works, reason="no OpenGL on this machine")
SIZE = {"width": 96, "height": 72}
CRAB = """<mujoco><worldbody><body name='b' pos='0 0 3'><freejoint/>
<geom type='box' size='.2 .1 .05'/><body pos='.2 0 0'><joint name='knee' axis='0 1 0'
range='40 60'/><geom type='{shape}' size='{size}'/></body></body></worldbody>
<compiler autolimits='true'/>{more}</mujoco>"""


def crab(shape="capsule", size=".03 .2", more=""):
    return mujoco.MjModel.from_xml_string(CRAB.format(shape=shape, size=size, more=more))


def pyramid(scale):
    """A robot that is one mesh, `scale` metres high."""
    return f"""<mujoco><asset><mesh name='m' scale='1 1 {scale}'
      vertex='-.5 -.5 0  .5 -.5 0  .5 .5 0  -.5 .5 0  0 0 1'/></asset><worldbody>
      <body name='b'><joint name='j' axis='0 1 0'/><geom name='g' type='mesh' mesh='m'/></body>
      </worldbody></mujoco>"""


@pytest.fixture(scope="module")
def evolve():
    return rvl.load("cheetah-front-leg")


def test_a_moved_robot_looks_as_a_new_one_does(evolve):
    qpos = np.linspace(0, 0.4, 9)
    with Stage(evolve, **SIZE, camera="side") as stage:
        moved = [stage.frame(alpha, qpos) for alpha in (0.0, 1.0, 0.3, 0.0)]
    with Stage(evolve.model(0.3), **SIZE, camera="side") as fresh:
        assert (moved[2] == fresh.frame(qpos=qpos)).all()
    assert (moved[0] == moved[3]).all()
    assert (moved[0] != moved[1]).any()


def test_a_mesh_that_changes_shape_is_sent_to_the_same_context_again():
    evolve = rvl.Evolution(pyramid(0.5), pyramid(1.5))
    poses_of = np.zeros(1)
    with Stage(evolve, **SIZE, camera="fit") as stage:
        tall = stage.frame(1.0, poses_of)
        low = stage.frame(0.0, poses_of)
        assert (stage.frame(1.0, poses_of) == tall).all()
    robot = (tall.astype(int) - low).any(axis=2)
    assert robot.sum() > 100  # the upper part of the tall pyramid


def test_many_frames_cost_one_context(evolve, monkeypatch):
    made = []
    keep = gl.Context.__init__
    monkeypatch.setattr(
        gl.Context, "__init__", lambda self, *size: (made.append(size), keep(self, *size))[1]
    )
    with Stage(evolve, **SIZE) as stage:
        for alpha in np.linspace(0, 1, 5):
            stage.frame(alpha)
        stage.resize(160, 200)
        assert stage.frame().shape == (200, 160, 3)
        stage.resize(40, 30)
        assert stage.frame().shape == (30, 40, 3)
    assert len(made) == 1


def test_a_picture_may_be_larger_than_the_models_own_buffer():
    model = crab(more="<visual><global offwidth='32' offheight='32'/></visual>")
    with Stage(model, width=800, height=700) as stage:
        assert stage.frame().shape == (700, 800, 3)
    assert model.vis.global_.offwidth == 32  # the stage draws a copy


def test_a_stage_may_be_used_from_another_thread():
    import threading

    drawn = []
    with Stage(crab(), **SIZE) as stage:
        here = stage.frame()
        worker = threading.Thread(target=lambda: drawn.append(stage.frame()))
        worker.start()
        worker.join()
    assert (drawn[0] == here).all()


@pytest.mark.parametrize("name", ["cheetah-front-leg", "ant-leg-emerge", "humanoid-length-mass"])
@pytest.mark.parametrize("alpha", [0.0, 0.5, 1.0])
def test_registered_robots_stand_on_the_floor(name, alpha):
    model = rvl.load(name).model(alpha)
    data = mujoco.MjData(model)
    data.qpos[:] = poses.standing(model)
    mujoco.mj_kinematics(model, data)
    assert poses.box(model, data)[0][2] == pytest.approx(poses.floor_height(model), abs=1e-9)


SHAPES = [
    ("sphere", ".1"), ("capsule", ".03 .2"), ("cylinder", ".05 .2"),
    ("ellipsoid", ".1 .2 .05"), ("box", ".1 .2 .05"),
]  # fmt: skip


@pytest.mark.parametrize(("shape", "size"), SHAPES)
def test_the_box_of_a_robot_just_holds_every_shape(shape, size):
    # Oracle: the distance that MuJoCo measures from a plane through the lowest point is zero.
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom name='floor' type='plane' size='1 1 1' pos='0 0 -9'/>"
        f"<body><freejoint/><geom name='g' type='{shape}' size='{size}'/></body>"
        "</worldbody></mujoco>"
    )
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    for _ in range(5):
        data.qpos[3:] = rng.normal(size=4)
        mujoco.mj_normalizeQuat(model, data.qpos)
        mujoco.mj_forward(model, data)
        measured = mujoco.mj_geomDistance(model, data, 0, 1, 100.0, None)
        assert poses.box(model, data)[0][2] + 9 == pytest.approx(measured, abs=1e-6)


def test_a_pose_for_a_picture_respects_joint_ranges_and_keyframes():
    assert poses.standing(crab())[-1] == pytest.approx(np.deg2rad(40))
    key = "<keyframe><key name='home' qpos='0 0 5 1 0 0 0 .9'/></keyframe>"
    assert poses.standing(crab(more=key))[-1] == 0.9


def test_the_fitted_camera_sees_the_whole_robot():
    # Oracle: the corners of its box, projected by a pinhole, fall inside the picture.
    box = np.array([[-1.0, -0.4, 0.0], [1.2, 0.4, 0.9]])
    for size in ((320, 240), (100, 400), (600, 100)):
        camera = cameras.fitted(crab(), box, size, np.zeros(3))
        scene = mujoco.MjvScene(crab(), 10)
        mujoco.mjv_updateScene(
            crab(), mujoco.MjData(crab()), mujoco.MjvOption(), None, camera, 7, scene
        )
        eye = scene.camera[0]
        up, forward = np.array(eye.up), np.array(eye.forward)
        right = np.cross(forward, up)
        for corner in np.array(np.meshgrid(*box.T)).reshape(3, -1).T:
            seen = corner - np.array(eye.pos)
            high = eye.frustum_top / eye.frustum_near * (seen @ forward)
            assert abs(seen @ up) < high
            assert abs(seen @ right) < high * size[0] / size[1]


def test_a_bare_robot_gets_sky_and_floor_and_one_with_its_own_keeps_them(evolve):
    with Stage(crab(), width=160, height=120) as stage:
        picture = stage.frame()
    assert picture[:8].mean() > 180  # a bright sky
    assert 100 < picture[-8:].mean() < 230  # a grey floor
    with Stage(evolve, width=160, height=120) as stage:
        assert stage.frame()[:8].mean() < 150  # dm_control's night


@pytest.mark.parametrize("size", [(0, 100), (100, 5000), (99.5, 100), ("wide", 100)])
def test_a_size_that_cannot_be_drawn_is_refused(size):
    with pytest.raises(SettingsError, match="whole numbers from 16 to 4096"):
        Stage(crab(), width=size[0], height=size[1])


def test_bad_cameras_poses_and_alphas_are_refused(evolve):
    with pytest.raises(UnknownNameError, match="'side', 'back', 'fit'"):
        Stage(evolve, **SIZE, camera="front")
    with Stage(evolve, **SIZE) as stage:
        with pytest.raises(SettingsError, match=r"qpos of shape \(3,\)"):
            stage.frame(qpos=np.zeros(3))
        with pytest.raises(AlphaError):
            stage.frame(1.5)
        assert stage.frame(0.5, camera=0).shape == (72, 96, 3)


@pytest.mark.parametrize("name", ["ant-length-mass", "humanoid-length-mass"])
def test_a_robot_that_has_walked_beyond_the_end_of_its_floor_still_stands_on_it(name):
    evolve = rvl.load(name)
    model = evolve.model(0.0)
    (floor,) = poses.floors(model)
    tile = 2 * model.geom_size[floor, 0] / model.mat_texrepeat[model.geom_matid[floor], 0]
    far = model.qpos0.copy()
    far[:2] += np.array([90, -70]) * tile  # the floor ends after 30 tiles
    with Stage(evolve, **SIZE) as stage:
        stage.effects(False)
        at_home, there = (stage.frame(0.0, qpos).astype(int) for qpos in (model.qpos0, far))
    assert np.abs(at_home - there).mean() < 1
