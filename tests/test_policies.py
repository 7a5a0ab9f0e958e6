"""Policies: they act as stable-baselines3 does, and their files are whole or refused."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from revolver_lab.cards import ModelCard, versions
from revolver_lab.errors import PolicyFileError, SettingsError
from revolver_lab.evolution.lifting import insert_zeros
from revolver_lab.files import write_atomically
from revolver_lab.learners.convert import from_sb3, tensors, to_sb3
from revolver_lab.learners.sb3 import build
from revolver_lab.learners.settings import LearnerSettings
from revolver_lab.policies import Policy
from revolver_lab.weights import load_weights, save_weights


def model(algorithm="SAC", seed=0, **settings):
    chosen = LearnerSettings(algorithm=algorithm, hidden=(16, 12), buffer_size=100, **settings)
    return build(chosen, 5, 3, seed=seed)


def linear(seed=0, head="tanh"):
    rng = np.random.default_rng(seed)
    weights = {"actor.0.weight": rng.normal(size=(3, 5)), "actor.0.bias": rng.normal(size=3)}
    return Policy(weights=weights, head=head, card=ModelCard(robot="toy", seed=seed))


@pytest.mark.parametrize("algorithm", ["SAC", "TD3", "DDPG"])
@pytest.mark.parametrize("layer_norm", [True, False])
def test_a_converted_policy_acts_as_stable_baselines3_predicts(algorithm, layer_norm):
    theirs = model(algorithm, layer_norm=layer_norm)
    observation = np.random.default_rng(1).normal(size=(200, 5)).astype(np.float32)
    expected, _ = theirs.predict(observation, deterministic=True)
    assert np.abs(from_sb3(theirs)(observation) - expected).max() < 1e-6
    assert np.abs(from_sb3(theirs)(observation[0]) - expected[0]).max() < 1e-6


def test_sampled_actions_have_the_mean_and_spread_of_stable_baselines3():
    theirs = model()
    observation = np.tile(np.linspace(-1, 1, 5, dtype=np.float32), (20_000, 1))
    expected, _ = theirs.predict(observation, deterministic=False)
    ours = from_sb3(theirs)(observation, deterministic=False, rng=np.random.default_rng(0))
    assert np.abs(ours.mean(0) - expected.mean(0)).max() < 0.02
    assert np.abs(ours.std(0) - expected.std(0)).max() < 0.02


@pytest.mark.parametrize("algorithm", ["SAC", "TD3"])
def test_a_policy_comes_back_from_file_and_into_another_model_with_its_critics(tmp_path, algorithm):
    first, second = model(algorithm, seed=1), model(algorithm, seed=2)
    loaded = Policy.load(from_sb3(first).save(tmp_path / "expert"))
    to_sb3(loaded, second)
    for name, tensor in tensors(first).items():
        assert np.array_equal(tensor.detach().numpy(), tensors(second)[name].detach().numpy()), name
    assert any(name.startswith("critic_target.1.2") for name in tensors(first))


def test_a_policy_without_critic_leaves_the_critic_alone():
    first, second = model(seed=1), model(seed=2)
    before = {k: v.detach().numpy().copy() for k, v in tensors(second).items()}
    to_sb3(from_sb3(first).without_critic(), second)
    after = {k: v.detach().numpy() for k, v in tensors(second).items()}
    changed = {k.split(".")[0] for k in after if not np.array_equal(before[k], after[k])}
    assert changed == {"actor"}


def test_a_critic_of_another_make_is_refused():
    with pytest.raises(PolicyFileError, match="without_critic"):
        to_sb3(from_sb3(model(layer_norm=True)), model(layer_norm=False))


def test_the_card_survives_and_its_json_is_readable(tmp_path):
    card = ModelCard(robot="cheetah-front-leg", alpha=0.3, steps=7, episode_return=1.5,
                     versions=versions(), command="make demo")  # fmt: skip
    path = linear().with_card(card).save(tmp_path / "a.safetensors")
    assert Policy.load(path).card == card
    assert '"robot": "cheetah-front-leg"' in (tmp_path / "a.json").read_text()


def garbage(path):
    path.write_bytes(os.urandom(500))


def empty(path):
    path.write_bytes(b"")


def torn(path):
    path.write_bytes(path.read_bytes()[:-40])


def flipped(path):
    content = bytearray(path.read_bytes())
    content[-3] ^= 255
    path.write_bytes(bytes(content))


def foreign(path):
    save_weights(path, {"layer": np.ones(3)}, {"format": "somebody else's"})


def pickled(path):
    path.write_bytes(b"\x80\x04cos\nsystem\n(S'echo hacked'\ntR.")


def huge_header(path):
    path.write_bytes((2**60).to_bytes(8, "little") + b"{}")


def a_folder(path):
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    "harm", [garbage, empty, torn, flipped, foreign, pickled, huge_header, a_folder, os.unlink]
)
def test_a_file_that_is_no_policy_is_refused(tmp_path, harm):
    path = linear().save(tmp_path / "a.safetensors")
    harm(path)
    with pytest.raises(PolicyFileError, match="Allowed"):
        Policy.load(path)


def test_weights_that_cannot_act_are_refused():
    good = dict(linear().weights)
    for bad in (
        {**good, "actor.0.bias": np.zeros(4)},
        {**good, "actor.0.weight": np.full((3, 5), np.nan)},
        {**good, "actor.1.weight": np.zeros((2, 9)), "actor.1.bias": np.zeros(2)},
        {"critic.0.0.weight": np.zeros((2, 2))},
    ):
        with pytest.raises(PolicyFileError):
            Policy(weights=bad, head="tanh")
    with pytest.raises(PolicyFileError, match="log_std"):
        Policy(weights=good, head="squashed_gaussian")
    with pytest.raises(PolicyFileError, match="softmax"):
        Policy(weights=good, head="softmax")


def test_a_policy_for_another_robot_is_refused_with_both_sizes():
    with pytest.raises(PolicyFileError, match=r"5 observations.*Allowed: 20 observations"):
        linear().fits(20, 7)


def test_drawing_without_a_stream_is_refused():
    with pytest.raises(SettingsError, match="rng"):
        from_sb3(model())(np.zeros(5), deterministic=False)


def test_an_interrupted_save_leaves_the_old_file_and_no_litter(tmp_path, monkeypatch):
    path = linear(0).save(tmp_path / "a.safetensors")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        linear(1).save(path)
    assert Policy.load(path).card.seed == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.json", "a.safetensors"]


def test_a_process_killed_while_saving_leaves_a_whole_policy(tmp_path):
    code = (
        "import sys, itertools, numpy as np\n"
        "from revolver_lab.policies import Policy\n"
        "for i in itertools.count():\n"
        "    w = {'actor.0.weight': np.full((400, 400), float(i)), 'actor.0.bias': np.zeros(400)}\n"
        "    Policy(weights=w, head='tanh').save(sys.argv[1])\n"
    )
    path = tmp_path / "a.safetensors"
    with subprocess.Popen([sys.executable, "-c", code, str(path)]) as process:
        deadline = time.monotonic() + 20
        while not path.exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        for _ in range(20):
            Policy.load(path)  # never half a file, not even to another process
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    assert len(np.unique(Policy.load(path).weights["actor.0.weight"])) == 1


def test_a_lifted_policy_ignores_what_was_created_and_moves_the_rest_as_before():
    policy = from_sb3(model())
    columns, rows = [0, 2, 3, 5, 6], [1, 2, 4]
    lifted = policy.lifted(columns, 8, rows, 5)
    rng = np.random.default_rng(0)
    observation = rng.normal(size=(50, 8)).astype(np.float32)
    action = lifted(observation)
    assert np.allclose(action[:, rows], policy(observation[:, columns]), atol=1e-6)
    assert not action[:, [0, 3]].any()


def test_a_lifted_critic_values_what_it_valued():
    policy = from_sb3(model(layer_norm=False))
    columns, rows = np.array([0, 2, 3, 5, 6]), np.array([1, 2, 4])
    lifted = policy.lifted(columns, 8, rows, 5)
    x = np.random.default_rng(0).normal(size=(9, 5 + 3))
    x_lifted = insert_zeros(x, np.concatenate([columns, 8 + rows]), 13, axis=1)
    x_lifted[:, [1, 4, 7, 8, 11]] = 7.0  # what was created may be anywhere
    before = x @ policy.weights["critic.1.0.weight"].T
    assert np.allclose(x_lifted @ lifted.weights["critic.1.0.weight"].T, before)


def test_files_are_written_into_folders_that_do_not_exist_yet(tmp_path):
    path = write_atomically(tmp_path / "a" / "b.txt", "text")
    assert path.read_text() == "text"
    weights, metadata = load_weights(save_weights(tmp_path / "c", {"x": np.ones(2)}, {"k": "v"}))
    assert weights["x"].tolist() == [1, 1]
    assert metadata == {"k": "v"}
