"""Random floating robots of many parts: drawn and solid shapes, servos, couplings, keyframes."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl

DEFAULTS = """<compiler angle='radian'/><default>
<default class='drawn'><geom contype='0' conaffinity='0' group='2' density='0'/></default>
<default class='solid'><geom conaffinity='0' group='3'/></default>
<default class='hip'><joint damping='.5'/></default></default>"""
INERTIA = "<inertial pos='0 0 -.05' mass='{:.2f}' diaginertia='.02 .018 .013'/>"


def random_robot(rng, prefix):
    """A floating tree of two to six bodies, 2 m above the ground."""
    count = int(rng.integers(2, 7))
    above = [0, *(int(rng.integers(max(i - 2, 0), i)) for i in range(1, count))]
    turns = [i > 0 and rng.random() < 0.85 for i in range(count)]
    motors = [i for i in range(count) if turns[i]]
    ends = [f"joint{n + 1}='{prefix}j{i}'" for n, i in enumerate(motors[:2])]
    pose = "0 0 2 1 0 0 0" + " .1" * len(motors)
    extras = [
        f"<keyframe><key name='home' qpos='{pose}'/></keyframe>",
        f"<equality><joint {' '.join(ends)}/></equality>" if len(ends) > 1 else "",
        f"<contact><exclude body1='{prefix}0' body2='{prefix}1'/></contact>",
        f"<sensor><framequat objtype='body' objname='{prefix}0'/></sensor>",
    ]
    return (
        f"<mujoco model='{prefix}'>{DEFAULTS}<option timestep='{rng.choice([0.002, 0.004])}'/>"
        f"<worldbody><geom name='floor' type='plane' size='9 9 .1'/>"
        f"{_body(rng, prefix, above, turns)}</worldbody>"
        f"<actuator>{''.join(_motor(rng, f'{prefix}j{i}') for i in motors)}</actuator>"
        f"{''.join(extra for extra in extras if rng.random() < 0.5)}</mujoco>"
    )


def _body(rng, prefix, above, turns, i=0):
    """A body and all below it; what cannot turn may lack an inertia, and what does has one."""
    shapes = [f"<geom class='{kind}' type='{rng.choice(['box', 'sphere', 'ellipsoid'])}'"
              f" size='.03 .04 .02' pos='0 0 {rng.uniform(-0.1, 0.1):.2f}'/>"
              for kind in ("drawn", "solid") for _ in range(rng.integers(0, 3))]  # fmt: skip
    low, high = -rng.uniform(0.2, 2), rng.uniform(0.2, 2)
    joint = (f"<joint name='{prefix}j{i}' axis='{rng.choice(['1 0 0', '0 1 0', '0 0 1'])}'"
             f" range='{low:.2f} {high:.2f}' armature='{rng.choice([0, 0.01])}'/>")  # fmt: skip
    own = ("<freejoint/>" if i == 0 else joint * turns[i]) + "".join(shapes)
    if i == 0 or turns[i] or rng.random() < 0.5:
        own = INERTIA.format(rng.uniform(0.2, 4)) + own
    place = " ".join(f"{x:.2f}" for x in rng.uniform(-0.3, 0.3, 2)) + (" -.2" if i else " 2")
    below = [j for j in range(i + 1, len(above)) if above[j] == i]
    return (f"<body name='{prefix}{i}' pos='{place}' childclass='hip'>{own}"
            f"{''.join(_body(rng, prefix, above, turns, j) for j in below)}</body>")  # fmt: skip


def _motor(rng, joint):
    if rng.random() < 0.5:
        return f"<position joint='{joint}' kp='{rng.integers(5, 30)}' ctrlrange='-1 1'/>"
    return f"<motor joint='{joint}' gear='{rng.integers(1, 9)}' ctrlrange='-1 1'/>"


def places(model, names, steps=50):
    """Where bodies are after so many steps, all controls at 0.3."""
    data = mujoco.MjData(model)
    data.ctrl = 0.3
    mujoco.mj_step(model, data, nstep=steps)
    return np.array([data.body(name).xpos for name in names])


def bursts(model):
    """Whether a robot that is left to itself is lost within 300 steps."""
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=300)
    warned = data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number
    return bool(warned) or not np.isfinite(data.qpos).all()


@pytest.mark.parametrize("seed", range(60))
def test_both_ends_move_as_mujoco_moves_the_robots_there(seed):
    rng = np.random.default_rng(seed)
    texts = [random_robot(rng, prefix) for prefix in "ab"]
    evolve = rvl.Evolution(*texts)
    both = [pair for pair in evolve.matching.bodies if None not in pair]
    for end, text in enumerate(texts):
        given = mujoco.MjModel.from_xml_string(text)
        found = places(evolve.model(float(end)), [ours for ours, _ in both])
        expected = places(given, [pair[end] for pair in both])
        np.testing.assert_allclose(found, expected, atol=2e-3)
    assert not any(bursts(evolve.model(alpha)) for alpha in (0.25, 0.5, 0.75))


@pytest.mark.parametrize("tie", [
    "<equality><joint joint1='a' joint2='b'/></equality>",
    "<equality><joint joint1='b' polycoef='.4 0 0 0 0'/></equality>",
    "<tendon><fixed name='t'><joint joint='a' coef='1'/></fixed><fixed name='u'><joint joint='b'"
    " coef='2'/></fixed></tendon><equality><tendon tendon1='t' tendon2='u'/></equality>",
])  # fmt: skip
def test_a_coupling_of_the_target_does_not_pull_at_the_source(tie):
    def arm(more):
        links = "".join(f"<body name='{name}_link' pos='.2 0 -.1'><joint name='{name}' axis='0 1 0'"
                        " damping='.01'/><geom size='.05'/>" for name in "ab")  # fmt: skip
        tip = "<body name='tip' pos='.2 0 0'/></body></body>"
        return f"<mujoco><worldbody>{links}{tip}</worldbody>{more}</mujoco>"

    names = ["b_link", "tip"]
    free, tied = (places(mujoco.MjModel.from_xml_string(arm(more)), names, 300)
                  for more in ("", tie))  # fmt: skip
    pulled = np.abs(free - tied).max()
    assert pulled > 0.01
    for ends, alpha in (((arm(""), arm(tie)), 0.0), ((arm(tie), arm("")), 1.0)):
        evolve = rvl.Evolution(*ends)
        found, other = (places(evolve.model(at), names, 300) for at in (alpha, 1 - alpha))
        assert np.abs(found - free).max() < 0.005 * pulled
        assert np.abs(other - tied).max() < 1e-9


def test_a_ball_with_a_limit_is_created_between_links_that_are_welded():
    def arm(joint):
        load = f"<body name='load' pos='.1 0 -.1'>{joint}<geom size='.05' pos='.1 0 0'/></body>"
        turns = "<joint name='a' axis='0 1 0'/><geom size='.1'/>"
        return f"<mujoco><worldbody><body name='arm'>{turns}{load}</body></worldbody></mujoco>"

    ends = [arm(""), arm("<joint name='b' type='ball' limited='true' range='0 1.5'/>")]
    evolve = rvl.Evolution(*ends)
    for alpha, text in enumerate(ends):
        expected = places(mujoco.MjModel.from_xml_string(text), ["load"], 200)
        np.testing.assert_allclose(places(evolve.model(alpha), ["load"], 200), expected, atol=1e-4)
