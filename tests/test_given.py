"""What is wrong is refused before anything is computed, by whoever is asked, and says little."""

import numpy as np
import pytest
from natural_puck import EXPERT, Reach, puck

import revolver_lab as rvl
from revolver_lab.demonstration_sources import from_minari, record
from revolver_lab.errors import DemonstrationsError, SettingsError
from revolver_lab.lab.encoders import MOVIES, check_path
from revolver_lab.learners.natural.settings import NaturalSettings
from revolver_lab.logs import write_table
from revolver_lab.natural_transfer import natural_transfer
from revolver_lab.policies import Policy
from revolver_lab.trajectories import Success

SMALL = NaturalSettings(trajectories=4, length=20, hidden=(4,), value_hidden=(8,))
CHEETAH = "cheetah-front-leg"


def transfer(**changes):
    return rvl.transfer(**{"expert": None, "evolve": CHEETAH} | changes)


def natural(**changes):
    usual = {"expert": EXPERT, "evolve": puck(), "task": Reach(), "settings": SMALL, "steps": 90}
    return natural_transfer(**usual | {"evaluate_episodes": 2} | changes)


def evaluated(**changes):
    usual = {"policy": EXPERT, "evolve": puck(), "alphas": 0.0, "task": Reach(), "episodes": 1}
    return rvl.evaluate(**usual | changes)


def recorded(**changes):
    return record(**{"policy": EXPERT, "evolve": puck(), "episodes": 1, "task": Reach()} | changes)


def vector(**changes):
    return rvl.make_vec_env(puck(), 2, task=Reach(), **changes)


def expert(**changes):
    return rvl.train_expert(CHEETAH, **changes)


@pytest.mark.parametrize("seed", [-1, 1.5, "a", True, [0.5], np.nan])
@pytest.mark.parametrize("ask", [transfer, natural, evaluated, recorded, vector, expert])
def test_a_seed_that_is_none_is_refused_by_all(ask, seed):
    with pytest.raises(SettingsError, match=r"seed.*whole number"):
        ask(seed=seed)


@pytest.mark.parametrize("count", [-1, 1.5, "3", True, np.nan, None])
@pytest.mark.parametrize(
    ("ask", "name"),
    [(evaluated, "episodes"), (recorded, "episodes"), (natural, "evaluate_episodes")],
)
def test_a_number_of_things_that_is_none_is_refused_by_all(ask, name, count):
    with pytest.raises(SettingsError, match=rf"{name} = .*whole number"):
        ask(**{name: count})


@pytest.mark.parametrize(
    ("ask", "changes", "what"),
    [
        (transfer, {"expert": "a.safetensors"}, "expert = 'a.safetensors'.*Policy or None"),
        (transfer, {"schedule": "fast"}, "schedule = 'fast'.*Schedule or a Method or None"),
        (transfer, {"learner": {}}, "learner = {}.*a LearnerSettings"),
        (natural, {"expert": 3}, "expert = 3"),
        (natural, {"demonstrations": "x.npz", "algorithm": "DAPG"}, "demonstrations = 'x.npz'"),
        (natural, {"success": 0.9}, "success = 0.9.*a Success"),
        (natural, {"evolve": None}, "robot = None.*a str or a Evolution"),
        (natural, {"task": Reach}, "a Task, ready made"),
        (natural, {"nthread": -1}, "nthread = -1"),
        (recorded, {"success": True}, "success = True"),
        (vector, {"nthread": "all"}, "nthread = 'all'"),
        (natural, {"gate": "pilot"}, "gate = 'pilot'.*a Gate"),
        (natural, {"settings": {}}, "settings = {}.*a NaturalSettings"),
        (evaluated, {"policy": None}, "policy = None.*Policy.load"),
        (recorded, {"policy": "x" * 500}, "policy = 'x{79}\\. "),
    ],
)
def test_what_is_of_another_kind_is_refused_by_name(ask, changes, what):
    with pytest.raises(SettingsError, match=what):
        ask(**changes)


@pytest.mark.parametrize("ask", [transfer, natural, expert])
def test_where_nothing_can_be_saved_nothing_is_trained(ask, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(SettingsError, match=r"out = .*nothing can be written.*Choose another"):
        ask(out=tmp_path / "file" / "results")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("ask", [transfer, natural, expert])
def test_an_empty_name_is_no_place_to_save(ask, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SettingsError, match=r"out = ''.*the name of a folder"):
        ask(out="")
    assert not list(tmp_path.iterdir())


def test_a_policy_and_a_log_say_what_they_are_in_a_line():
    log = natural()
    assert repr(log) == f"NaturalLog('puck', seed 0, {log.steps} steps, " \
                        f"{log.evaluations[-1].mean:.4g} on the target)"  # fmt: skip
    assert repr(log.policy) == "Policy(2 observations, 2 actions, gaussian, tanh, from NPG)"
    assert repr(EXPERT).endswith("from ?)")


def saved_demonstrations(path):
    recorded().save(path)


def table(path):
    write_table(path, [{"a": 1}])


@pytest.mark.parametrize("name", [".", "", "folder.gif", "folder", "file/x.gif", None, 3])
@pytest.mark.parametrize("save", [EXPERT.save, saved_demonstrations, table,
                                  lambda path: check_path(path, MOVIES)])  # fmt: skip
def test_what_cannot_be_a_file_is_no_place_to_save(save, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("folder.gif", "folder", "folder.npz", "folder.safetensors"):
        (tmp_path / folder).mkdir()
    (tmp_path / "file").write_text("kept")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SettingsError):
        save(name)
    assert sorted(tmp_path.rglob("*")) == before


def test_decimals_are_no_ending_and_a_policy_is_not_its_card(tmp_path):
    assert EXPERT.save(tmp_path / "alpha-0.5").name == "alpha-0.5.safetensors"
    assert EXPERT.save(tmp_path / "walk").name == "walk.safetensors"
    assert EXPERT.save(tmp_path / "walk.mine").name == "walk.mine"
    with pytest.raises(SettingsError, match=r"\.json"):
        EXPERT.save(tmp_path / "walk.json")
    assert Policy.load(tmp_path / "walk.safetensors").action_size == EXPERT.action_size


@pytest.mark.parametrize(
    "settings", [{"goal_steps": -1}, {"goal_steps": 2.5}, {"goal_steps": "many"},
                 {"least_return": "much"}, {"least_return": np.nan}, {"least_return": True}],
)  # fmt: skip
def test_a_success_that_no_trajectory_could_be_told_by_is_refused(settings):
    with pytest.raises(SettingsError, match=next(iter(settings))):
        Success(**settings)


@pytest.mark.parametrize("dataset", [3, None, ["D4RL/door/human-v2"]])
def test_what_is_no_minari_dataset_is_refused(dataset):
    with pytest.raises(DemonstrationsError, match="a MinariDataset, or its name"):
        from_minari(dataset)
