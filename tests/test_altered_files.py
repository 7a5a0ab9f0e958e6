"""A policy or checkpoint that was altered anywhere, its header too, is refused; older ones load."""

import json
from pathlib import Path

import numpy as np
import pytest
import safetensors.numpy

from revolver_lab.cards import ModelCard
from revolver_lab.errors import PolicyFileError
from revolver_lab.files import asset_folder
from revolver_lab.policies import Policy
from revolver_lab.weights import digest, load_weights, save_weights

CARD = ModelCard(robot="toy", episode_return=160.25, note="a note")
SHIPPED = sorted(asset_folder("experts").glob("*.safetensors"))


def linear():
    weights = {"actor.0.weight": np.eye(3, 5), "actor.0.bias": np.zeros(3)}
    return Policy(weights=weights, head="tanh", activation="relu", card=CARD)


def altered(path, old, new):
    content = path.read_bytes()
    assert len(old) == len(new)
    assert content.count(old) == 1
    path.write_bytes(content.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b'"activation":"relu"', b'"activation":"tanh"'),
        (b'"head":"tanh"', b'"heat":"tanh"'),
        (b"160.25", b"960.25"),
        (b"a note", b"a joke"),
        (b'\\"toy\\"', b'\\"ant\\"'),
        (b'"digest_of_all"', b'"digest_of_alm"'),
        (b"actor.0.bias", b"actor.1.bias"),
    ],
)
def test_a_policy_whose_header_was_altered_is_refused(tmp_path, old, new):
    path = linear().save(tmp_path / "a.safetensors")
    assert Policy.load(path).card == CARD
    altered(path, old, new)
    with pytest.raises(PolicyFileError, match="Allowed"):
        Policy.load(path)


def test_every_flipped_bit_of_a_small_file_is_noticed(tmp_path):
    path = save_weights(tmp_path / "a", {"x": np.ones(2)}, {"plain": json.dumps({"seconds": 1.5})})
    content, held = path.read_bytes(), load_weights(path)
    for i in range(len(content) * 8):
        harmed = bytearray(content)
        harmed[i // 8] ^= 1 << i % 8
        path.write_bytes(bytes(harmed))
        try:
            weights, told = load_weights(path)
        except PolicyFileError:
            continue
        assert (weights["x"].tolist(), told) == (held[0]["x"].tolist(), held[1])


def test_a_file_of_before_has_a_digest_of_its_arrays_and_still_loads(tmp_path):
    policy, path = linear(), tmp_path / "a.safetensors"
    told = {"format": "revolver_lab.policy/1", "head": "tanh", "activation": "relu", "card": "{}"}
    arrays = dict(policy.weights)
    path.write_bytes(safetensors.numpy.save(arrays, told | {"digest": digest(arrays)}))
    assert np.array_equal(Policy.load(path).weights["actor.0.weight"], np.eye(3, 5))
    content = bytearray(path.read_bytes())
    content[-3] ^= 255
    path.write_bytes(bytes(content))
    with pytest.raises(PolicyFileError, match="digest"):
        Policy.load(path)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_what_is_shipped_loads_and_is_the_same_once_it_is_written_anew(tmp_path, path):
    before = Policy.load(path)
    after = Policy.load(before.save(tmp_path / Path(path).name))
    assert digest(after.weights) == digest(before.weights)
    assert (after.card, after.head, after.activation) == (
        before.card, before.head, before.activation,
    )  # fmt: skip
