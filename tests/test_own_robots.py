"""A robot of one's own, in a file, goes by its name wherever ours do: here and in workers."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from natural_puck import EXPERT

import revolver_lab as rvl
from revolver_lab import cli
from revolver_lab.errors import PolicyFileError, RevolverError, SettingsError, UnknownNameError
from revolver_lab.robots import own, register, registry
from revolver_lab.runs import Plan, Run
from revolver_lab.runs.sweep import sweep
from revolver_lab.runs.sweep_file import plans_of

TESTS = Path(__file__).parent
FILE = f"""
import sys
from pathlib import Path
sys.path.append({str(TESTS)!r})
from natural_puck import PUCK, Barren, Reach
from revolver_lab.robots import Robot

HERE = Path(__file__).parent
NAME, MASS = "my-puck", 1

def puck(old, new):
    return PUCK.format(mass=MASS, old=old, new=new, damping=1)

MINE = Robot(name=NAME, source=lambda: puck(5, 0.001), target=lambda: puck(0.001, 5),
             tasks={{"sparse": Reach, "barren": Barren}}, expert=HERE / "expert.safetensors",
             summary="one motor for the other")
NUMBER = 3
"""
TINY = {
    "methods": ["mini"], "seeds": [0, 1], "steps": 160, "evaluate_episodes": 2,
    "method": {"mini": {"settings": {"trajectories": 4, "length": 20, "hidden": [4],
                                     "value_hidden": [4], "warm_batches": 1}}},
}  # fmt: skip


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A file with a robot, not registered yet; nothing is known of it afterwards."""
    monkeypatch.setenv(own.VARIABLE, "")
    EXPERT.save(tmp_path / "expert.safetensors")
    (tmp_path / "mine.py").write_text(FILE)
    return tmp_path / "mine.py"


def test_a_registered_robot_of_ones_own_goes_by_its_name(mine, capsys):
    assert register(f"{mine}:MINE") == "my-puck"
    assert register(f"{mine}:MINE") == "my-puck"  # again is no clash
    assert rvl.names()[-1] == "my-puck"
    assert rvl.load("my-puck") is rvl.load("my-puck")
    assert rvl.load("my-puck").model(0.5).actuator_gear[0, 0] == pytest.approx(2.5, abs=0.01)
    assert rvl.suite.load("own", "my-puck", alpha=0.5).action_spec().shape == (2,)
    env = rvl.make_vec_env("my-puck", 3, task="barren", seed=0)
    assert env.reset()[0].shape == (3, 2)
    here, there = rvl.evaluate(rvl.load_expert("my-puck"), "my-puck", [0, 1], episodes=5)
    assert here.mean() > there.mean()
    assert cli.main(["list"]) == 0
    assert "one motor for the other" in capsys.readouterr().out
    assert cli.main(["evaluate", "my-puck", "--alpha", "0", "--episodes", "5"]) == 0
    assert f"{here.mean():.4g}" in capsys.readouterr().out


def test_workers_and_sweeps_are_told_of_it(mine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    register("mine.py:MINE")
    (plan,) = plans_of(TINY | {"robots": ["my-puck"]})
    by_worker = Run(plan, root="runs").start(processes=1).wait()
    monkeypatch.chdir("/")
    (swept,) = sweep([plan], root=tmp_path / "swept", jobs=2)
    assert by_worker.scores()["mini"].tolist() == swept.results().scores()["mini"].tolist()


def test_a_fresh_process_finds_it_by_the_variable_or_says_what_is_missing(mine, tmp_path):
    def listed(**changes):
        code = "import revolver_lab as rvl; print(rvl.load('my-puck').name)"
        return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                              env=os.environ | changes, cwd=tmp_path)  # fmt: skip

    assert listed(REVOLVER_LAB_ROBOTS="mine.py:MINE").stdout == "my-puck\n"
    assert "register" in listed(REVOLVER_LAB_ROBOTS="").stderr


def test_a_plan_is_of_the_robot_it_was_made_with(mine):
    register(f"{mine}:MINE")
    (plan,) = plans_of(TINY | {"robots": ["my-puck"]})
    assert Plan.from_json(plan.to_json()) == plan
    mine.write_text(FILE.replace('MASS = "my-puck", 1', 'MASS = "my-puck", 2'))
    os.utime(mine, (0, 0))  # whatever the clock's grain
    with pytest.raises(SettingsError, match="has changed"):
        Plan.from_json(plan.to_json())
    (other,) = plans_of(TINY | {"robots": ["my-puck"]})
    assert other.name != plan.name
    assert rvl.load("my-puck").model(0).body("puck").mass == 2


def test_ours_keep_the_names_of_their_folders(monkeypatch):
    plan = Plan(robot="adroit-door", methods=["npg-direct"], seeds=[0])
    assert plan.likeness is None
    assert "likeness" not in plan.to_json()


@pytest.mark.parametrize(
    ("place", "what"),
    [
        ("nothing", "nothing"),
        ("mine.py", "mine"),
        ("mine.py:", "mine"),
        ("mine.py:NUMBER", "an? int"),
        ("mine.py:OTHER", "OTHER"),
        ("none.py:MINE", "none.py"),
        ("no_such_module:MINE", "no_such_module"),
        ("torn.py:MINE", "SyntaxError"),
        ("loud.py:MINE", "ZeroDivisionError"),
        ("ours.py:MINE", "not taken"),
        ("odd.py:MINE", "My/Puck"),
        (3, "place = 3"),
    ],
)
def test_what_is_no_robot_is_refused_and_not_remembered(place, what, mine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("torn.py").write_text("def")
    Path("loud.py").write_text("1 / 0")
    Path("ours.py").write_text(FILE.replace("my-puck", "adroit-door"))
    Path("odd.py").write_text(FILE.replace("my-puck", "My/Puck"))
    with pytest.raises(SettingsError, match=what):
        register(place)
    assert own.places() == []
    assert rvl.names() == [*registry.RECORDS]


def test_an_expert_that_is_not_there_is_told_with_its_place(mine):
    register(f"{mine}:MINE")
    (mine.parent / "expert.safetensors").unlink()
    with pytest.raises(PolicyFileError, match=r"my-puck.*expert\.safetensors"):
        rvl.load_expert("my-puck")


def test_two_files_cannot_have_one_name_and_ours_are_found_whatever_is_listed(mine, monkeypatch):
    register(f"{mine}:MINE")
    twin = mine.with_name("twin.py")
    twin.write_text(FILE)
    with pytest.raises(SettingsError, match="not taken"):
        register(f"{twin}:MINE")
    monkeypatch.setenv(own.VARIABLE, "gone.py:MINE")
    assert rvl.load("ball-in-cup-weak-motors").name == "ball-in-cup-weak-motors"
    with pytest.raises(RevolverError, match=r"gone\.py"):
        rvl.load("my-puck")
    monkeypatch.setenv(own.VARIABLE, "")
    with pytest.raises(UnknownNameError, match="register"):
        rvl.load("my-puck")
