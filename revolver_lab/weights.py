"""Named arrays in a safetensors file: written atomically, refused when torn, never executed."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from revolver_lab.errors import PolicyFileError
from revolver_lab.files import write_atomically

_DIGEST, _OLDER = "digest_of_all", "digest"  # older files have one of their arrays alone
_LARGEST_FILE = 1 << 28  # bytes; what this package writes is below 10 MB


def save_weights(
    path: str | Path, weights: Mapping[str, np.ndarray], metadata: Mapping[str, str]
) -> Path:
    """Writes arrays, metadata and a digest of both, atomically.

    Args:
        path: The file.
        weights: Arrays by name.
        metadata: Strings by name, kept in the header.
    """
    from safetensors.numpy import save

    arrays = {name: np.ascontiguousarray(weights[name]) for name in sorted(weights)}
    whole = {**metadata, _DIGEST: _digest_of_all(arrays, metadata)}
    return write_atomically(path, save(arrays, metadata=whole))


def load_weights(
    path: str | Path, *, largest: int = _LARGEST_FILE
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Reads what `save_weights` wrote.

    Args:
        path: The file.
        largest: A larger file is refused [bytes].

    Returns:
        Arrays by name, and the metadata.

    Raises:
        PolicyFileError: If the file is missing, torn, altered or of another kind.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    path = Path(path)
    try:
        if path.stat().st_size > largest:
            raise refusal(path, f"is larger than {largest} bytes")
        content = path.read_bytes()
    except OSError as error:
        raise refusal(path, f"cannot be read ({error.strerror})") from error
    try:
        weights = load(content)
        metadata = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
        metadata = dict(metadata.get("__metadata__", {}))
    except (SafetensorError, ValueError, KeyError, AttributeError, TypeError,
            RecursionError) as error:  # fmt: skip
        raise refusal(path, f"is torn or of another kind ({str(error)[:60]})") from error
    told, older = metadata.pop(_DIGEST, None), metadata.pop(_OLDER, None)
    whole = told == _digest_of_all(weights, metadata) if told else older == digest(weights)
    if not whole:
        raise refusal(path, "holds something that does not match its digest")
    return weights, metadata


def _digest_of_all(weights: Mapping[str, np.ndarray], metadata: Mapping[str, str]) -> str:
    """Returns the SHA-256 of arrays and metadata."""
    told = json.dumps(dict(metadata), sort_keys=True)
    return hashlib.sha256(f"{digest(weights)}{told}".encode()).hexdigest()


def digest(weights: Mapping[str, np.ndarray]) -> str:
    """Returns the SHA-256 of names, shapes, types and numbers, as hexadecimal digits."""
    summary = hashlib.sha256()
    for name in sorted(weights):
        array = np.ascontiguousarray(weights[name])
        summary.update(f"{name}:{array.dtype.str}:{array.shape};".encode())
        summary.update(array.tobytes())
    return summary.hexdigest()


def count_layers(weights: Mapping[str, np.ndarray], network: str) -> int:
    """Returns how many linear layers a network has.

    Args:
        weights: Arrays by name.
        network: The network's name, "actor" or "critic.0" for example.

    Example:
        >>> count_layers({"actor.0.weight": None, "actor.1.weight": None}, "actor")
        2
    """
    layers = 0
    while f"{network}.{layers}.weight" in weights:
        layers += 1
    return layers


def with_targets(weights: Mapping[str, np.ndarray], head: str) -> dict[str, np.ndarray]:
    """Returns a policy's arrays, the targets it lacks filled in from what they follow.

    Args:
        weights: Arrays by name.
        head: The policy's head; only "tanh" has a target of its actor.

    Example:
        >>> sorted(with_targets({"critic.0.0.bias": np.zeros(1)}, "squashed_gaussian"))
        ['critic.0.0.bias', 'critic_target.0.0.bias']
    """
    given = dict(weights)
    networks = {"critic": "critic_target"} | ({"actor": "actor_target"} if head == "tanh" else {})
    for online, target in networks.items():
        for name in [n for n in given if n.startswith(f"{online}.")]:
            given.setdefault(target + name[len(online) :], given[name])
    return given


def refusal(path: str | Path, what: str) -> PolicyFileError:
    """Builds the error for a file that cannot be a policy."""
    return PolicyFileError(
        f"policy file {str(path)!r} {what}",
        "a .safetensors file that Policy.save wrote",
        "Save the policy again, or restore the file from its source.",
    )
