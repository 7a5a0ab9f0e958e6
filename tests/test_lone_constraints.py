"""A constraint that only one robot has holds on the whole path, and not at all in the other."""

import mujoco
import numpy as np
import pytest

import revolver_lab as rvl

GUIDED = """<mujoco><option timestep=".002"/><worldbody>{place}
<body name="a" pos="0 0 1"><joint name="z" type="slide" axis="0 0 1"/>
<joint name="j" axis="0 1 0" damping=".1"/><geom name="a" size=".05" pos=".2 0 0"/>
<body name="b" pos=".4 0 0"><joint name="k" axis="0 1 0" damping=".1"/>
<geom name="b" size=".04" pos=".1 0 0"/></body></body></worldbody>{rest}</mujoco>"""
PLACE = "<body name='m' mocap='true' pos='.6 0 1.1'/>"
TIES = {
    "a weld": "<weld name='e' body1='b' body2='m'/>",
    "a connect": "<connect name='e' body1='b' body2='m' anchor='.1 0 0'/>",
    "a coupling": "<joint name='e' joint1='j' joint2='k' polycoef='.3 1 0 0 0'/>",
}
FREE = GUIDED.format(place=PLACE, rest="")


def tied(name, more=""):
    tie = TIES[name].replace("/>", f" {more}/>")
    return GUIDED.format(place=PLACE, rest=f"<equality>{tie}</equality>")


def fallen(model, data=None, steps=1000):
    data = data or mujoco.MjData(model)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return data.qpos.copy()


@pytest.mark.parametrize("back", [False, True])
@pytest.mark.parametrize("name", TIES)
def test_the_robot_without_does_not_feel_it_and_the_robot_with_it_does(name, back):
    texts = [FREE, tied(name)][:: -1 if back else 1]
    evolve = rvl.Evolution(*texts)
    ends = [fallen(mujoco.MjModel.from_xml_string(text)) for text in texts]
    assert np.abs(ends[0] - ends[1]).max() > 0.1
    for alpha, end in enumerate(ends):
        np.testing.assert_allclose(fallen(evolve.model(alpha)), end, atol=1e-9)


@pytest.mark.parametrize("name", TIES)
def test_it_holds_everywhere_else_and_hardly_next_to_the_robot_without(name):
    evolve = rvl.Evolution(FREE, tied(name))
    free, nearly = (fallen(evolve.model(alpha))[0] for alpha in (0.0, 1e-9))
    assert nearly == pytest.approx(free, rel=0.01)
    assert [evolve.model(a).eq_active0[0] for a in (0.0, 1e-12, 0.5, 1.0)] == [0, 1, 1, 1]


def test_what_holds_in_a_live_physics_follows_alpha_and_what_a_user_let_go_stays_so():
    evolve = rvl.Evolution(FREE, tied("a weld"))
    physics = evolve(0.0)
    for alpha, holds in ((0.0, 0), (0.5, 1), (1.0, 1), (0.0, 0)):
        evolve.set_alpha(physics, alpha)
        assert physics.data.eq_active[0] == holds
    evolve.set_alpha(physics, 0.3)
    physics.data.eq_active[0] = 0
    evolve.set_alpha(physics, 0.9)
    assert physics.data.eq_active[0] == 0


def test_what_does_not_hold_at_first_stays_so():
    evolve = rvl.Evolution(FREE, tied("a weld", "active='false'"))
    assert not any(evolve.model(alpha).eq_active0[0] for alpha in (0.0, 0.5, 1.0))
