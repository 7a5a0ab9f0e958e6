"""What every registered robot owes, and the tables of facts.md, sections 1, 7 and 9."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.envs.vector import make_vec_env
from revolver_lab.errors import UnknownNameError
from revolver_lab.policies import Policy
from revolver_lab.robots import registry
from revolver_lab.robots.ant import LENGTH_MASS_TARGET
from revolver_lab.robots.cheetah_segment import cheetah_places
from revolver_lab.tasks.running import RunnerState, SpeedTrap

NAMES = registry.names()
NAMED = {
    "body": "nbody",
    "jnt": "njnt",
    "geom": "ngeom",
    "site": "nsite",
    "cam": "ncam",
    "light": "nlight",
    "actuator": "nu",
    "tendon": "ntendon",
    "sensor": "nsensor",
}


def both(name):
    robot = registry.get(name)
    return robot.source().compile(), robot.target().compile()


def test_the_robots_are_registered_the_small_ones_first():
    assert NAMES[:8] == [
        "cheetah-front-leg",
        "cheetah-short-legs",
        "cheetah-long-legs",
        "cheetah-segment",
        "ball-in-cup-weak-motors",
        "ant-length-mass",
        "ant-leg-emerge",
        "humanoid-length-mass",
    ]


@pytest.mark.parametrize("name", NAMES)
def test_a_record_is_filed_under_its_name_with_an_origin_and_a_licence(name):
    robot = registry.get(name)
    assert robot.name == name == f"{robot.domain}-{robot.task}".replace("_", "-")
    assert any(licence in robot.origin for licence in ("Apache-2.0", "MIT"))
    assert robot.summary
    assert registry.find(robot.domain, robot.task) is robot


PHYSICAL = {
    "body": ("mass", "inertia", "pos", "ipos", "quat"),
    "joint": ("range", "stiffness", "axis", "pos"),
    "geom": ("size", "pos", "friction", "margin"),
    "actuator": ("gear", "gainprm", "ctrlrange"),
}


@pytest.mark.parametrize("name", [n for n in NAMES if registry.get(n).f == "linear"])
def test_the_way_back_is_the_way_there(name):
    robot = registry.get(name)
    there = rvl.Evolution(robot.source(), robot.target())(0.3).model.ptr
    back = rvl.Evolution(robot.target(), robot.source())(0.7).model.ptr
    for kind, numbers in PHYSICAL.items():
        for index in range(
            getattr(there, {"joint": "njnt", "actuator": "nu"}.get(kind, f"n{kind}"))
        ):
            one = getattr(there, kind)(index)
            other = getattr(back, kind)(one.name)
            for number in numbers:
                np.testing.assert_allclose(
                    getattr(one, number), getattr(other, number), atol=1e-9, err_msg=one.name
                )


@pytest.mark.parametrize("name", NAMES)
def test_everything_is_named_and_the_camera_exists(name):
    for model in both(name):
        for kind, count in NAMED.items():
            view = {"jnt": "joint", "cam": "camera"}.get(kind, kind)
            for i in range(getattr(model, count)):
                assert getattr(model, view)(i).name, f"{kind} {i} of {name}"
        assert model.camera(registry.get(name).camera).id >= 0


@pytest.mark.parametrize("name", NAMES)
def test_101_robots_share_their_spaces_and_stay_finite(name):
    env = make_vec_env(name, 101, alphas=np.linspace(0, 1, 101), seed=0, nthread=2)
    source, target = env.models[0], env.models[-1]
    assert all((m.nq, m.nv, m.nu) == (source.nq, source.nv, source.nu) for m in env.models)
    both = source.body_mass, target.body_mass, source.actuator_gear, target.actuator_gear
    assert not np.array_equal(both[0], both[1]) or not np.array_equal(both[2], both[3])
    rng = np.random.default_rng(0)
    observations, _ = env.reset()
    for _ in range(10):
        assert observations.shape == env.observation_space.shape
        assert np.isfinite(observations).all()
        observations, rewards, *_, infos = env.step(rng.uniform(-1, 1, env.action_space.shape))
        assert np.isfinite(rewards).all()
        assert not infos["diverged"].any()


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_gives_the_same_trajectory(name):
    runs = []
    for _ in range(2):
        env, rng = make_vec_env(name, 2, alphas=[0.2, 1.0], seed=5), np.random.default_rng(1)
        run = [env.reset()[0]]
        run += [env.step(rng.uniform(-1, 1, env.action_space.shape))[0] for _ in range(10)]
        runs.append(np.array(run))
    np.testing.assert_array_equal(*runs)
    assert not np.array_equal(env.reset(seed=6)[0], runs[0][0])


SIZES = {
    "cheetah-front-leg": (18, 6),
    "cheetah-short-legs": (18, 6),
    "cheetah-long-legs": (18, 6),
    "cheetah-segment": (20, 7),
    "ball-in-cup-weak-motors": (8, 2),
    "ant-length-mass": (111, 8),
    "ant-leg-emerge": (143, 12),
    "humanoid-length-mass": (376, 17),
    "adroit-hammer": (46, 26),
    "adroit-hammer-fingers": (46, 26),
    "adroit-relocate": (39, 30),
    "adroit-relocate-fingers": (39, 30),
    "adroit-door": (39, 28),
    "adroit-door-fingers": (39, 28),
}


@pytest.mark.parametrize("name", NAMES)
def test_observation_and_action_have_the_published_sizes(name):
    for model in both(name):
        task = registry.get(name).make_task()
        task.bind(model)
        assert (task.observation_size, model.nu) == SIZES[name]


def test_a_leg_factor_scales_geoms_and_inner_bodies_only():
    source, target = both("cheetah-front-leg")
    for part in ("fthigh", "fshin", "ffoot"):
        np.testing.assert_allclose(target.geom(part).pos, 0.4 * source.geom(part).pos)
        assert target.geom(part).size[1] == pytest.approx(0.4 * source.geom(part).size[1])
        assert target.geom(part).size[0] == source.geom(part).size[0]
    for part, factor in (("fthigh", 1), ("fshin", 0.4), ("ffoot", 0.4)):
        np.testing.assert_allclose(target.body(part).pos, factor * source.body(part).pos)
    for array in ("jnt_range", "jnt_stiffness", "dof_damping", "actuator_gear"):
        np.testing.assert_array_equal(getattr(target, array), getattr(source, array))
    for part in ("bthigh", "bshin", "bfoot", "torso"):
        assert target.body(part).mass == source.body(part).mass


def test_cheetah_masses_are_those_of_the_pilot():
    assert mass("cheetah-front-leg")[0] == pytest.approx(13.5, abs=0.05)
    source, target = both("cheetah-long-legs")
    torso = target.body("torso").mass / source.body("torso").mass
    assert torso == pytest.approx(1.5)


def mass(name):
    return [model.body_mass.sum() for model in both(name)]


def test_the_humanoid_goes_from_42_1_to_43_8_kilograms():
    assert mass("humanoid-length-mass") == pytest.approx([42.1, 43.8], abs=0.05)


@pytest.mark.parametrize(
    ("side", "thigh", "thigh_radius", "shin_body", "shin", "shin_radius", "foot"),
    [
        ("source", -0.34, 0.06, -0.403, -0.30, 0.049, -0.45),
        ("left", -0.44, 0.07, -0.503, -0.20, 0.039, -0.35),
        ("right", -0.24, 0.07, -0.303, -0.40, 0.039, -0.55),
    ],
)
def test_the_humanoids_legs_are_the_table(
    side, thigh, thigh_radius, shin_body, shin, shin_radius, foot
):
    model = both("humanoid-length-mass")[side != "source"]
    sides = ("left", "right") if side == "source" else (side,)
    for leg in sides:
        for geom, z, radius in (("thigh1", thigh, thigh_radius), ("shin1", shin, shin_radius)):
            capsule = model.geom(f"{leg}_{geom}")
            assert capsule.size[0] == pytest.approx(radius)
            assert lower_end(capsule) == pytest.approx(z)
        assert model.body(f"{leg}_shin").pos[2] == pytest.approx(shin_body)
        assert model.body(f"{leg}_foot").pos[2] == pytest.approx(foot)


def lower_end(capsule):
    """z of a capsule's lower end in its body's frame."""
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, capsule.quat)
    return capsule.pos[2] - abs(rotation[8]) * capsule.size[1]


@pytest.mark.parametrize(
    ("end", "ankle", "foot", "gear"), [(0, 0.4, 1e-7, 1e-8), (1, 0.35, 0.12, 60)]
)
def test_the_emerging_feet_are_the_table(end, ankle, foot, gear):
    model = both("ant-leg-emerge")[end]
    ankles = ("left_ankle_geom", "right_ankle_geom", "third_ankle_geom", "fourth_ankle_geom")
    for leg, (x, y) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1)), start=1):
        for geom, reach, radius in (
            (ankles[leg - 1], ankle, 0.08),
            (f"foot_{leg}_geom", foot, 0.07),
        ):
            capsule = model.geom(geom)
            np.testing.assert_allclose(capsule.pos, [x * reach / 2, y * reach / 2, 0], atol=1e-12)
            assert capsule.size[:2] == pytest.approx([radius, reach / np.sqrt(2)])
        np.testing.assert_allclose(model.body(f"foot_{leg}").pos, [x * ankle, y * ankle, 0])
        joint = model.joint(f"foot_{leg}")
        np.testing.assert_allclose(joint.axis * np.sqrt(2), [-1 if x * y > 0 else 1, 1, 0])
        np.testing.assert_allclose(np.degrees(joint.range), [10, 20] if x > 0 else [-20, -10])
        assert joint.armature == joint.damping == 1
        assert model.actuator(f"foot_{leg}").gear[0] == gear
        volume = 4 / 3 * np.pi * 0.07**3 + np.pi * 0.07**2 * foot * np.sqrt(2)
        assert model.body(f"foot_{leg}").mass[0] == pytest.approx(5 * volume)


@pytest.mark.parametrize(("end", "k"), [(0, 0.02), (1, 1.0)])
def test_the_emerging_segment_is_the_table(end, k):
    model = both("cheetah-segment")[end]
    capsule, joint = model.geom("bsegment"), model.joint("bsegment")
    np.testing.assert_allclose(capsule.pos, [0, 0, -0.30 * k], atol=1e-12)
    np.testing.assert_allclose(capsule.quat, [1, 0, 0, 0], atol=1e-12)
    assert capsule.size[:2] == pytest.approx([0.046 * k, 0.30 * k])
    np.testing.assert_allclose(np.degrees(joint.range), [-50, 50])
    assert (joint.stiffness, joint.damping, joint.armature) == (60, 1.5, 0.1)
    assert model.actuator("bsegment").gear[0] == 30 * k
    volume = (4 / 3 * np.pi * 0.046**3 + np.pi * 0.046**2 * 0.60) * k**3
    assert model.body("bsegment").mass[0] == pytest.approx(637 * volume)
    assert mass("cheetah-segment")[end] == pytest.approx([13.5, 16.3][end], abs=0.05)


def test_the_segment_hangs_from_the_tip_of_the_back_foot():
    model = both("cheetah-segment")[1]
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    foot = data.geom("bfoot")
    reach = foot.xmat.reshape(3, 3)[:, 2] * model.geom("bfoot").size[1]
    tip = min(foot.xpos - reach, foot.xpos + reach, key=lambda point: point[2])
    np.testing.assert_allclose(data.body("bsegment").xpos, tip, atol=1e-6)
    assert model.geom_bodyid[model.geom("bsegment").id] == model.body("bsegment").id


def test_the_segment_touches_the_ground_and_nothing_else():
    model = both("cheetah-segment")[1]
    segment = model.geom("bsegment").id
    answers = [
        model.geom(other).name
        for other in range(model.ngeom)
        if model.geom_contype[segment] & model.geom_conaffinity[other]
        or model.geom_contype[other] & model.geom_conaffinity[segment]
    ]
    assert answers == ["ground"]
    plain = registry.get("cheetah-front-leg").source().compile()
    for name in (plain.geom(i).name for i in range(plain.ngeom)):
        assert model.geom(name).conaffinity == plain.geom(name).conaffinity


def test_a_lifted_cheetah_policy_acts_on_the_segment_robot_as_it_did():
    plain, grown = SpeedTrap(), SpeedTrap()
    models = registry.get("cheetah-front-leg").source().compile(), both("cheetah-segment")[0]
    rng = np.random.default_rng(0)
    policy = Policy(
        weights={"actor.0.weight": rng.normal(size=(6, 18)), "actor.0.bias": np.zeros(6)},
        head="tanh",
    )
    lifted = policy.lifted(*cheetah_places())
    data = [mujoco.MjData(model) for model in models]
    for joint in range(models[0].njnt):
        name = models[0].joint(joint).name
        place, speed = rng.normal(size=2)
        for one in data:
            one.joint(name).qpos[0], one.joint(name).qvel[0] = place, speed
    data[1].joint("bsegment").qpos[0] = data[1].joint("bsegment").qvel[0] = 9.0
    seen = []
    for task, model, one in zip((plain, grown), models, data):
        task.bind(model)
        seen.append(task.observe(RunnerState({"qpos": one.qpos[None], "qvel": one.qvel[None]}))[0])
    action = dict(zip([models[1].actuator(i).name for i in range(7)], lifted(seen[1])))
    for i, before in enumerate(policy(seen[0])):
        assert action.pop(models[0].actuator(i).name) == pytest.approx(before)
    assert action == {"bsegment": 0}


def test_the_cups_motors_lose_half_their_strength_and_nothing_else_changes():
    source, target = both("ball-in-cup-weak-motors")
    assert source.actuator_gear[:, 0].tolist() == [5, 5]
    assert target.actuator_gear[:, 0].tolist() == [2.5, 2.5]
    evolve = registry.load("ball-in-cup-weak-motors")
    changed = [name for name, moves in zip(evolve.theta_names, evolve.theta_changed) if moves]
    assert len(changed) == 3
    assert [name for name in changed if "gear" not in name] == ["site/motors/size[0] [m]"]
    assert source.opt.timestep == target.opt.timestep == 0.005


def test_every_leg_of_ant_length_mass_changes_its_own_way():
    source, target = both("ant-length-mass")
    for leg, (length, density) in LENGTH_MASS_TARGET.items():
        before, after = source.body(f"ankle_{leg}"), target.body(f"ankle_{leg}")
        np.testing.assert_allclose(after.pos, length * before.pos)
        volumes = [
            4 / 3 * np.pi * 0.08**3 + np.pi * 0.08**2 * 0.4 * np.sqrt(2) * k for k in (1, length)
        ]
        expected = density * volumes[1] / volumes[0]
        assert after.mass[0] / before.mass[0] == pytest.approx(expected)
    assert len(set(LENGTH_MASS_TARGET.values())) == 4


@pytest.mark.parametrize(
    ("call", "near"),
    [
        (lambda: registry.get("cheetah-frnt-leg"), "cheetah-front-leg"),
        (lambda: registry.get("ant-leg-emerge").make_task("sparse"), "dense"),
        (lambda: registry.find("cheetah", "front"), "cheetah front_leg"),
    ],
)
def test_an_unknown_name_is_answered_with_near_ones(call, near):
    with pytest.raises(UnknownNameError, match=near):
        call()
