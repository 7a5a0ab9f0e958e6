"""E(0) and E(1) are the two robots exactly, and every robot between is the one in between."""

import math
import os
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest
from robots_text import SOURCE, TARGET, features, mid, pendulum

import revolver_lab as rvl
from revolver_lab.errors import AlphaError, ParameterError
from revolver_lab.evolution import live
from revolver_lab.evolution.canonical import canonical

GYM = Path(gymnasium.__file__).parent / "envs/mujoco/assets"
SUITE = Path(__import__("dm_control").__file__).parent / "suite"
INSTALLED = [GYM / f"{n}.xml" for n in ("ant", "humanoid", "half_cheetah", "walker2d", "swimmer")]
INSTALLED += [SUITE / f"{n}.xml" for n in ("fish", "quadruped", "manipulator", "humanoid_CMU")]
pytestmark = pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass'")


def differing(a: mujoco.MjModel, b: mujoco.MjModel) -> list[str]:
    """Every array, option and statistic in which two compiled models differ by a bit."""
    ours, theirs = live.read(a), live.read(b)
    return [name for name in ours if ours[name].tobytes() != theirs[name].tobytes()]


def bigger(path: Path) -> tuple[mujoco.MjSpec, mujoco.MjSpec]:
    source = mujoco.MjSpec.from_file(str(path))
    for kind in ("bodies", "joints", "geoms"):
        for i, element in enumerate(getattr(source, kind)):
            element.name = element.name or f"{kind}_{i}"
    target = source.copy()
    for geom in target.geoms:
        if geom.parent.name != "world" and np.isfinite(geom.size).all():
            geom.size = 1.2 * np.array(geom.size)
    for joint in target.joints:
        joint.damping = 2.0 * np.array(joint.damping)
    return source, target


@pytest.mark.parametrize("path", INSTALLED, ids=lambda p: p.stem)
def test_both_ends_are_the_two_robots_to_the_last_bit(path):
    source, target = bigger(path)
    evolve = rvl.Evolution(source, target)
    assert differing(evolve.model(0), source.compile()) == []
    assert differing(evolve.model(1), target.compile()) == []
    assert evolve.model(1).tex_data.tobytes() == source.compile().tex_data.tobytes()


def test_frames_degrees_and_angles_written_in_any_way_end_exactly_where_they_should():
    evolve = rvl.Evolution(features(), features(**TARGET))
    for alpha, slots in ((0, SOURCE), (1, TARGET)):
        expected = mujoco.MjModel.from_xml_string(features(**slots))
        ours, theirs = live.read(evolve.model(alpha)), live.read(expected)
        for name in ours:
            # Folding a frame that was written in angles costs one rounding.
            np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=1e-14, err_msg=name)


def test_the_canonical_form_compiles_to_the_same_robot():
    spec = mujoco.MjSpec.from_string(features(tilt=0))
    ours, theirs = live.read(canonical(spec).compile()), live.read(spec.compile())
    for name in ours:
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0, atol=1e-15, err_msg=name)


@pytest.mark.parametrize("alpha", [0.25, 0.5, 0.9])
def test_a_robot_between_is_the_file_with_the_numbers_between(alpha):
    # An oracle that knows nothing of specs: interpolate the text, then let MuJoCo compile it.
    # Lengths, masses, ranges and gains are slots here; what turns (tilt, axis) has its own tests.
    target = TARGET | {"tilt": SOURCE["tilt"], "axis": SOURCE["axis"]}
    evolve = rvl.Evolution(features(), features(**target))
    expected = mujoco.MjModel.from_xml_string(features(**mid(alpha, target=target)))
    ours, theirs = live.read(evolve.model(alpha)), live.read(expected)
    for name in ours:
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-9, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("f", ["linear", "smoothstep", math.sqrt])
def test_theta_is_linear_in_f_and_exact_at_both_ends(f):
    evolve = rvl.Evolution(features(), features(**TARGET), f=f)
    at = {"linear": lambda a: a, "smoothstep": lambda a: a * a * (3 - 2 * a)}.get(f, f)
    source, target = evolve.theta(0), evolve.theta(1)
    assert len(evolve.theta_names) == len(source)
    assert len(set(evolve.theta_names)) == len(source)
    for alpha in (0.2, 0.7):
        expected = source + at(alpha) * (target - source)
        np.testing.assert_allclose(evolve.theta(alpha), expected, rtol=1e-12, atol=1e-12)
    back = rvl.Evolution(features(**TARGET), features(), f=f)
    moved = [not name.endswith("[rad]") for name in evolve.theta_names]
    np.testing.assert_array_equal(back.theta(0)[moved], target[moved])


def test_theta_names_what_changed_with_its_unit():
    evolve = rvl.Evolution(pendulum(), pendulum(length=2.0))
    names = np.array(evolve.theta_names)[evolve.theta_changed]
    assert names.tolist() == ["geom/rod/fromto[5] [m]"]


@pytest.mark.parametrize("alpha", [0.0, 0.123, 0.5, 1.0])
def test_a_moved_model_rolls_out_as_a_fresh_compile_bit_for_bit(alpha):
    evolve = rvl.Evolution(features(), features(**TARGET))
    moved = evolve.model(0.8)
    evolve.write_model(moved, 0.3)
    evolve.write_model(moved, alpha)
    fresh = rvl.Evolution(features(), features(**TARGET)).model(alpha)
    assert differing(moved, fresh) == []
    states = []
    for model in (moved, fresh):
        data, rng = mujoco.MjData(model), np.random.default_rng(0)
        for _ in range(200):
            data.ctrl[:] = rng.uniform(-1, 1, model.nu)
            mujoco.mj_step(model, data)
        states.append(np.concatenate([data.qpos, data.qvel, data.sensordata]))
    np.testing.assert_array_equal(*states)


def test_set_alpha_moves_a_physics_and_keeps_its_state():
    evolve = rvl.Evolution(pendulum(), pendulum(length=2.0))
    physics = evolve(0.2)
    physics.data.qpos[:] = 0.4
    model, data = physics.model.ptr, physics.data.ptr
    evolve.set_alpha(physics, 1.0)
    assert physics.model.ptr is model
    assert physics.data.ptr is data
    assert physics.data.qpos[0] == 0.4
    # The rod's middle, by hand: one metre along the pole from the hinge at a height of two.
    np.testing.assert_allclose(
        physics.named.data.geom_xpos["rod"], [-math.sin(0.4), 0, 2 - math.cos(0.4)], atol=1e-12
    )


@pytest.mark.parametrize("alpha", [-0.1, 1.1, math.nan, math.inf, "0.5", None, [0.1, 0.2], 1 + 2j])
def test_an_alpha_that_is_no_number_in_0_1_is_refused(alpha):
    evolve = rvl.Evolution(pendulum(), pendulum(length=2.0))
    for use in (evolve.model, evolve.theta, evolve):
        with pytest.raises(AlphaError, match=r"Allowed: a number in \[0, 1\]"):
            use(alpha)


def test_a_parameter_can_have_a_ramp_of_its_own():
    evolve = rvl.Evolution(
        pendulum(), pendulum(length=2, radius=0.1), f={"geom/rod/size*": rvl.ramp(0.5, 1)}
    )
    assert evolve.model(0.5).geom("rod").size.tolist() == [0.05, 0.75, 0.0]


def test_differences_are_told_in_the_words_of_a_file_and_not_all_of_very_many():
    def chain(option, joint, count):
        link = "<body name='b{0}' pos='.1 0 0'><joint name='j{0}' {1}/><geom size='.01'/>"
        bodies = "".join(link.format(i, joint) for i in range(count)) + "</body>" * count
        return f"<mujoco><option {option}/><worldbody>{bodies}</worldbody></mujoco>"

    limit = "limited='true' range='0 1'"
    few = chain("integrator='implicitfast' cone='elliptic'", limit, 1), chain("", "", 1)
    told = "j0/limited: true -> false; .*integrator: implicitfast -> euler; .*elliptic -> pyramidal"
    with pytest.raises(ParameterError, match=told):
        rvl.Evolution(*few)
    with pytest.raises(ParameterError, match="j19/limited: true -> false; and 3 more"):
        rvl.Evolution(chain("", limit, 23), chain("", "", 23))


def test_discrete_differences_are_listed_and_refused():
    target = pendulum(body='<geom name="hand" size=".1" condim="4" contype="2"/>')
    source = pendulum(body='<geom name="hand" size=".1" condim="3" contype="1"/>')
    with pytest.raises(
        ParameterError, match=r"geom/hand/contype: 1 -> 2; geom/hand/condim: 3 -> 4"
    ):
        rvl.Evolution(source, target)
    one = {"geom/hand/contype": 0.5}
    with pytest.raises(ParameterError, match=r"attributes that differ: geom/hand/condim: 3 -> 4\."):
        rvl.Evolution(source, target, switch=one)
    evolve = rvl.Evolution(source, target, switch=one | {"geom/hand/condim": 0.75})
    found = [evolve.model(a).geom("hand") for a in (0.4, 0.5, 0.8)]
    assert [g.contype[0] for g in found] == [1, 2, 2]
    assert [g.condim[0] for g in found] == [3, 3, 4]


@pytest.mark.parametrize("switch", [0.0, 1.5, "0.5", {"geom/typo/type": 0.5}])
def test_a_switch_that_cannot_work_is_refused(switch):
    with pytest.raises(ParameterError):
        rvl.Evolution(pendulum(), pendulum(), switch=switch)


def test_inertias_stated_in_one_robot_and_inferred_in_the_other_meet_exactly():
    stated = '<inertial pos="0 0 -.4" mass="3" diaginertia=".1 .1 .01"/>'
    source, target = pendulum(), pendulum(body=stated)
    evolve = rvl.Evolution(source, target)
    for alpha, text in ((0, source), (1, target)):
        ours, theirs = evolve.model(alpha), mujoco.MjModel.from_xml_string(text)
        for name in ("mass", "inertia", "ipos", "iquat"):
            a, b = getattr(ours, f"body_{name}"), getattr(theirs, f"body_{name}")
            np.testing.assert_array_equal(a, b, err_msg=name)
    half = [mujoco.MjModel.from_xml_string(x).body("pole").mass[0] for x in (source, target)]
    assert evolve.model(0.5).body("pole").mass[0] == pytest.approx(sum(half) / 2)


@pytest.mark.parametrize("size", ['mass="2"', 'density="3000"'])
def test_masses_written_as_mass_or_density_meet_exactly(size):
    source, target = pendulum(), pendulum().replace('name="rod"', f'name="rod" {size}')
    evolve = rvl.Evolution(source, target)
    for alpha, text in ((0, source), (1, target)):
        expected = mujoco.MjModel.from_xml_string(text).body("pole")
        assert evolve.model(alpha).body("pole").mass[0] == expected.mass[0]
        np.testing.assert_array_equal(evolve.model(alpha).body("pole").inertia, expected.inertia)


def test_ends_written_as_fromto_or_as_pose_and_size_meet_exactly():
    target = pendulum().replace('fromto="0 0 0 0 0 -1.0" size="0.05"', 'pos="0 0 -1" size=".1 1"')
    evolve = rvl.Evolution(pendulum(), target)
    assert differing(evolve.model(0), mujoco.MjModel.from_xml_string(pendulum())) == []
    assert differing(evolve.model(1), mujoco.MjModel.from_xml_string(target)) == []


def test_a_rod_written_from_the_other_end_does_not_vanish_halfway():
    ends = 'fromto="0 0 0 0 0 -1.0"', 'fromto="0 0 -1.0 0 0 0"'
    evolve = rvl.Evolution(pendulum(), pendulum().replace(*ends))
    masses = [evolve.model(alpha).body("pole").mass[0] for alpha in np.linspace(0, 1, 11)]
    np.testing.assert_allclose(masses, masses[0])


def test_solref_in_two_forms_has_no_in_between():
    soft = pendulum(body='<geom name="hand" size=".1" solref="0.02 1"/>')
    stiff = pendulum(body='<geom name="hand" size=".1" solref="-100 -10"/>')
    with pytest.raises(ParameterError, match="time constant"):
        rvl.Evolution(soft, stiff)


def _mesh(scale: str, vertex: str = "0 0 0 1 0 0 0 1 0 0 0 1") -> str:
    asset = f'<asset><mesh name="m" vertex="{vertex}" scale="{scale}"/></asset>'
    return pendulum(body='<geom name="shape" type="mesh" mesh="m" pos=".1 0 0"/>', extra=asset)


@pytest.mark.parametrize("ends", [("-1 1 1", "1 -1 1"), ("1 1 1", "-2 -1 3"), ("1 1 1", "-1 1 1")])
def test_a_mesh_vanishes_where_its_mirror_image_appears_and_is_flat_nowhere(ends):
    evolve = rvl.Evolution(*map(_mesh, ends))
    for alpha, scale in enumerate(ends):
        alone = mujoco.MjModel.from_xml_string(_mesh(scale)).body("pole")
        for field in ("mass", "ipos", "inertia"):
            found = getattr(evolve.model(alpha).body("pole"), field)
            np.testing.assert_allclose(found, getattr(alone, field), rtol=1e-5, atol=1e-7)
    assert evolve.model(0.5).body("pole").mass[0] > 0.1


def test_a_mesh_changes_its_scale_along_the_path():
    evolve = rvl.Evolution(_mesh("1 1 1"), _mesh("1 2 3"))
    for alpha, scale in ((0, "1 1 1"), (0.5, "1 1.5 2"), (1, "1 2 3")):
        expected = mujoco.MjModel.from_xml_string(_mesh(scale))
        ours, theirs = live.read(evolve.model(alpha)), live.read(expected)
        for name in ("mesh_vert", "geom_pos", "body_mass", "body_inertia", "geom_rbound"):
            np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-6, atol=1e-7)


def test_two_meshes_that_share_their_faces_deform_into_each_other():
    bent = "0 0 0 2 .2 0 0 1 .3 .1 0 1.5"
    evolve = rvl.Evolution(_mesh("1 1 1"), _mesh("1 1 1", bent))
    numbers = [np.fromstring(v, sep=" ") for v in ("0 0 0 1 0 0 0 1 0 0 0 1", bent)]
    for alpha in (0.0, 0.5, 1.0):
        vertex = " ".join(map(repr, ((1 - alpha) * numbers[0] + alpha * numbers[1]).tolist()))
        expected = mujoco.MjModel.from_xml_string(_mesh("1 1 1", vertex))
        ours = evolve.model(alpha)
        np.testing.assert_allclose(ours.body_mass, expected.body_mass, rtol=1e-5)
        np.testing.assert_allclose(ours.body_ipos, expected.body_ipos, atol=1e-5)


def test_the_cache_is_bounded_and_still_right_when_it_forgets():
    small = rvl.Evolution(pendulum(), pendulum(length=2), cache_bytes=5000)
    large = rvl.Evolution(pendulum(), pendulum(length=2))
    for alpha in np.linspace(0, 1, 51):
        assert differing(small.model(alpha), large.model(alpha)) == []
    assert small.cache_nbytes <= 5000 < large.cache_nbytes
    moved = small.model(1)
    small.write_model(moved, 0.02)
    assert differing(moved, large.model(0.02)) == []


def test_the_nearest_cached_robot_is_at_most_half_a_grid_step_away():
    evolve = rvl.Evolution(pendulum(), pendulum(length=2))
    draws = np.random.default_rng(0).uniform(size=200)
    near = np.array([evolve.nearest(a) for a in draws])
    assert np.abs(near - draws).max() <= 0.0005
    assert len({evolve.nearest(a) for a in np.linspace(0, 1, 5001)}) == 1001


def test_a_model_that_an_equal_evolution_made_is_moved_whole_though_this_one_has_seen_no_other():
    first, second = (rvl.Evolution(pendulum(), pendulum(length=2)) for _ in range(2))
    for alpha in (0.0, 0.3):
        moved = first.model(1.0)
        second.write_model(moved, alpha)
        assert differing(moved, first.model(alpha)) == []


def test_a_model_of_another_robot_cannot_be_moved():
    evolve = rvl.Evolution(pendulum(), pendulum(length=2))
    with pytest.raises(ParameterError, match="another robot"):
        evolve.write_model(mujoco.MjModel.from_xml_string(features()), 0.5)


def test_the_robots_given_are_left_as_they_were():
    source, target = (mujoco.MjSpec.from_string(features(**s)) for s in (SOURCE, TARGET))
    before = source.to_xml(), target.to_xml()
    rvl.Evolution(source, target).model(0.5)
    assert (source.to_xml(), target.to_xml()) == before


def test_importing_evolution_reads_no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    assert os.environ.get("DISPLAY") is None
    assert rvl.Evolution(pendulum(), pendulum(length=2)).model(0.5).nbody == 2


@pytest.mark.parametrize("case", ["mesh", "rod"])
def test_a_moved_physics_draws_what_a_fresh_one_draws(case):
    from revolver_lab import _gl

    if not _gl.choose().works:
        pytest.skip("no OpenGL here")
    light = '<light pos="0 -1 3"/><camera name="side" pos="0 -4 2" xyaxes="1 0 0 0 0 1"/>'
    ends = {
        "mesh": (_mesh("1 1 1"), _mesh("1 2 0.5")),
        "rod": (pendulum(), pendulum(length=2.0)),
    }[case]
    ends = [text.replace("<worldbody>", f"<worldbody>{light}") for text in ends]
    evolve = rvl.Evolution(*ends)
    moved, fresh = evolve(0.0), evolve(0.8)
    first = moved.render(120, 160, camera_id="side")
    contexts = moved.contexts
    evolve.set_alpha(moved, 0.8)
    frames = [physics.render(120, 160, camera_id="side") for physics in (moved, fresh)]
    np.testing.assert_array_equal(*frames)
    assert (frames[0] != first).any()
    assert moved.contexts is contexts


def test_the_path_has_the_memory_of_its_larger_end():
    box = "<mujoco><size memory='{}'/><worldbody><geom size='.1'/></worldbody></mujoco>"
    for ends in (("1M", "40M"), ("40M", "1M")):
        evolve = rvl.Evolution(*map(box.format, ends))
        assert evolve.model(0.0).narena == evolve.model(1.0).narena == 40 * 2**20


def test_a_refused_alpha_is_told_as_a_plain_number():
    with pytest.raises(AlphaError, match=r"alpha = 1\.5\. "):
        rvl.load("cheetah-front-leg").model(np.float64(1.5))


def test_what_is_equal_in_both_robots_stays_so_to_the_last_bit():
    evolve = rvl.Evolution(features(), features(**TARGET))
    still = ~evolve.theta_changed
    assert still.sum() > 50
    start = evolve.theta(0.0)[still].tobytes()
    assert all(evolve.theta(a)[still].tobytes() == start for a in np.linspace(0, 1, 101))
