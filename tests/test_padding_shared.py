"""What padding does with parts that are shared, and with what it creates."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl
from revolver_lab.evolution.matching import match
from revolver_lab.evolution.padding import pad
from revolver_lab.evolution.reading import read_robot
from revolver_lab.evolution.rerooting import reroot_state


def chain(names, *, up=False, more=""):
    """Three floating links in a row, each with a hinge; rooted at the first."""
    text = more
    for i, name in reversed(list(enumerate(names))):
        joint = "<freejoint name='f'/>" if i == 0 else f"<joint name='{name}' axis='0 1 0'/>"
        place = "0 0 1" if i == 0 else "-.3 .02 0" if up else ".3 -.02 0"
        text = f"<body name='{name}' pos='{place}'>{joint}<geom size='.1'/>{text}</body>"
    return f"<mujoco><worldbody>{text}</worldbody></mujoco>"


def test_where_both_are_rooted_elsewhere_both_end_up_rooted_as_the_source():
    tail = "<body name='d' pos='0 .3 0'><joint name='d' axis='1 0 0'/><geom size='.05'/></body>"
    source, target = read_robot(chain("abc")), read_robot(chain("cba", up=True, more=tail))
    twins = pad(source, target, match(source, target, root=("b", "b")))
    forth = dict(twins.pairs["body"]) | {"world": "world"}
    assert {forth[name] for name in "abc"} == set("abc")
    for body in twins.source.bodies:
        if body.name != "world":
            assert twins.target.body(forth[body.name]).parent.name == forth[body.parent.name]
    assert twins.source.body("a").parent.name == "world"
    before, after = target.compile(), twins.target.compile()
    data = mujoco.MjData(before), mujoco.MjData(after)
    data[0].qvel[:] = np.random.default_rng(0).normal(size=before.nv)
    data[1].qpos[:], data[1].qvel[:] = reroot_state(before, after, data[0].qpos, data[0].qvel)
    for model, state in zip((before, after), data):
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        mujoco.mj_step(model, state, nstep=50)
        mujoco.mj_kinematics(model, state)
    for name in "abcd":
        here = data[1].body(name if name == "d" else forth[name]).xpos
        there = data[0].body(name if name == "d" else forth[name]).xpos
        np.testing.assert_allclose(here, there, atol=1e-6)


def tetrahedra(first, second):
    """Two hinged bodies with a mesh each; corners differ by how tall they are."""
    meshes = "".join(
        f"<mesh name='m{z}' vertex='0 0 0 .1 0 0 0 .1 0 0 0 {z}'/>" for z in {first, second}
    )
    bodies = "".join(
        f"<body name='{name}' pos='{x} 0 0'><joint name='{name}' axis='0 1 0'/>"
        f"<geom name='{name}' type='mesh' mesh='m{z}'/></body>"
        for name, x, z in (("p", 0, first), ("q", 1, second))
    )
    return f"<mujoco><asset>{meshes}</asset><worldbody>{bodies}</worldbody></mujoco>"


@pytest.mark.parametrize("back", [False, True])
def test_a_mesh_that_two_geoms_share_becomes_a_different_one_in_each(back):
    texts = [tetrahedra(0.1, 0.1), tetrahedra(0.1, 0.3)]
    texts = texts[::-1] if back else texts
    evolve = rvl.Evolution(*texts)
    for alpha, text in enumerate(texts):
        ours, alone = evolve.model(float(alpha)), mujoco.MjModel.from_xml_string(text)
        for name in "pq":
            mass = ours.body(name).mass[0], alone.body(name).mass[0]
            assert mass[0] == pytest.approx(mass[1], rel=1e-6)
            size = [model.geom(name).rbound[0] for model in (ours, alone)]
            assert size[0] == pytest.approx(size[1], rel=1e-6)
