"""Continuous robot evolution: one robot becomes another, and its policy goes with it."""

import importlib
from typing import TYPE_CHECKING, Any

from revolver_lab.envs.registration import register_environments

__version__ = "0.1.0"

# gymnasium has no entry points: it knows our robots only if they are registered here. That costs
# its import, and nothing of ours or of MuJoCo's.
register_environments()

# Public name -> module that holds it. Nothing of it is imported before it is used: the package
# loads without torch, GL or files.
_PUBLIC = {
    "Evolution": "revolver_lab.evolution.evolution",
    "ramp": "revolver_lab.evolution.ramps",
    "names": "revolver_lab.robots.registry",
    "load": "revolver_lab.robots.registry",
    "suite": "revolver_lab.envs.suite",
    "make_vec_env": "revolver_lab.envs.vector",
    "Policy": "revolver_lab.policies",
    "load_expert": "revolver_lab.experts",
    "train_expert": "revolver_lab.experts",
    "Schedule": "revolver_lab.schedule",
    "transfer": "revolver_lab.transferring",
    "evaluate": "revolver_lab.evaluation",
    "lab": "revolver_lab.lab",
    "errors": "revolver_lab.errors",
    "stats": "revolver_lab.stats",
}
_MODULES = {"suite", "lab", "errors", "stats"}
__all__ = [
    "Evolution",
    "Policy",
    "Schedule",
    "errors",
    "evaluate",
    "lab",
    "load",
    "load_expert",
    "make_vec_env",
    "names",
    "ramp",
    "stats",
    "suite",
    "train_expert",
    "transfer",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first used."""
    if name not in _PUBLIC:
        raise AttributeError(f"module 'revolver_lab' has no attribute {name!r}; it has {__all__}")
    if name not in ("errors", "names"):
        importlib.import_module("revolver_lab._versions").check()
    module = importlib.import_module(_PUBLIC[name])
    value = module if name in _MODULES else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names, for completion in a notebook."""
    return [*__all__, "__version__"]


if TYPE_CHECKING:
    from revolver_lab import errors, lab, stats
    from revolver_lab.envs import suite
    from revolver_lab.envs.vector import make_vec_env
    from revolver_lab.evaluation import evaluate
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.evolution.ramps import ramp
    from revolver_lab.experts import load_expert, train_expert
    from revolver_lab.policies import Policy
    from revolver_lab.robots.registry import load, names
    from revolver_lab.schedule import Schedule
    from revolver_lab.transferring import transfer
