"""The commands of `revolver-lab`: thin calls into the package, and errors in one line."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import revolver_lab as rvl
from revolver_lab import _gl, _versions
from revolver_lab.errors import MissingExtraError, RevolverError, SettingsError

if TYPE_CHECKING:
    from revolver_lab.policies import Policy
    from revolver_lab.recorder import Progress

Arguments = argparse.Namespace
BAD_USE = 2
"""Exit code after an error that the user can mend; argparse uses it too."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Args:
        argv: Words after `revolver-lab`; by default those of the shell.

    Returns:
        0, or 2 after an error, which is one line on stderr.

    Example:
        >>> main(["list", "--short"])
        cheetah-front-leg
        ...
        0
    """
    arguments = _parser().parse_args(argv)
    try:
        if arguments.run is not _doctor:
            _versions.check()
            _gl.choose()
        return arguments.run(arguments)
    except BrokenPipeError:  # the reader had enough, as `| head` does
        sys.stderr.close()
        return 0
    except (RevolverError, OSError) as problem:
        print(f"revolver-lab: {' '.join(str(problem).split())}", file=sys.stderr)
    except KeyboardInterrupt:
        print("revolver-lab: stopped", file=sys.stderr)
    return BAD_USE


def _list(arguments: Arguments) -> int:
    """Registered robots, one a line."""
    from revolver_lab.robots import registry

    for name in registry.names():
        robot = registry.get(name)
        print(name if arguments.short else f"{name:<22} {robot.summary:<40} {robot.origin}")
    return 0


def _doctor(_: Arguments) -> int:
    """What was found here; 2 if something that everything needs is wrong."""
    from revolver_lab.lab.doctor import probe_report

    findings = probe_report()
    print(*findings, sep="\n")
    return BAD_USE if any(f.mend and not f.needed_for for f in findings) else 0


def _strip(arguments: Arguments) -> int:
    """A film strip along alpha."""
    evolve = rvl.load(arguments.name)
    size = _size(arguments)
    rvl.lab.strip(evolve, arguments.alpha or rvl.lab.ALPHAS, path=arguments.out, **size)
    return _wrote(arguments.out)


def _gif(arguments: Arguments) -> int:
    """A film of the robot along alpha, or of a policy on its robots."""
    shown = evolve = rvl.load(arguments.name)
    if arguments.policy is not None:
        policy = _policy(arguments.name, arguments.policy)
        shown = [
            rvl.lab.record(
                policy, evolve, alpha, task=arguments.task, seed=arguments.seed,
                steps=arguments.steps, title=arguments.title or arguments.name,
            )
            for alpha in arguments.alpha or (0.0, 0.5, 1.0)
        ]  # fmt: skip
    elif arguments.alpha:
        raise SettingsError(
            "--alpha without --policy", "--alpha with --policy", "Try: revolver-lab strip."
        )
    rvl.lab.film(shown, arguments.out, fps=arguments.fps, **_size(arguments))
    return _wrote(arguments.out)


def _train_expert(arguments: Arguments) -> int:
    """Train the expert of a robot."""
    with _training():
        rvl.train_expert(
            arguments.name, seed=arguments.seed, out=arguments.out, progress=_shown(arguments.name)
        )
    return _wrote(arguments.out)


def _transfer(arguments: Arguments) -> int:
    """Carry an expert to the target robot by one of the methods."""
    from revolver_lab.methods import method

    chosen = method(arguments.method)
    expert = _policy(arguments.name, arguments.policy) if chosen.expert else None
    with _training():
        log = rvl.transfer(
            expert, arguments.name, chosen.schedule, steps=arguments.steps,
            seed=arguments.seed, progress=_shown(arguments.name), out=arguments.out,
        )  # fmt: skip
    print(f"{chosen.name} on {log.robot}: {log.steps} steps, {log.wall_time:.0f} s")
    for found in log.evaluations[-1:]:
        print(f"mean return on the target {found.mean:.4g}")
    return _wrote(arguments.out)


def _evaluate(arguments: Arguments) -> int:
    """Unshaped returns of a policy along alpha."""
    alphas = arguments.alpha or list(rvl.lab.ALPHAS)
    policy = _policy(arguments.name, arguments.policy)
    returns = rvl.evaluate(
        policy, arguments.name, alphas, arguments.episodes, arguments.seed, task=arguments.task
    )
    print("alpha   mean return   lowest   highest")
    for alpha, row in zip(alphas, returns, strict=True):
        print(f"{alpha:<7.4g} {row.mean():<13.4g} {row.min():<8.4g} {row.max():.4g}")
    return 0


def _policy(name: str, given: str) -> "Policy":
    """The shipped expert of a robot, or the policy in a file."""
    return rvl.load_expert(name) if given == "expert" else rvl.Policy.load(given)


@contextlib.contextmanager
def _training() -> Iterator[None]:
    """Say how to get torch, where it is missing."""
    try:
        yield
    except ModuleNotFoundError as problem:
        if (problem.name or "").partition(".")[0] not in ("torch", "stable_baselines3"):
            raise
        raise MissingExtraError(
            f"{problem.name} is missing", "the train extra", "pip install 'revolver-lab[train]'"
        ) from problem


def _shown(name: str) -> "Callable[[Progress], None]":
    """A callback that tells on stderr how a training is doing."""
    from revolver_lab.progress import ProgressLines

    lines = ProgressLines(sys.stderr)
    return lambda progress: lines.show({name: progress})


def _size(arguments: Arguments) -> dict[str, int]:
    """The size of one picture [pixels]."""
    return {"width": arguments.width, "height": arguments.height}


def _wrote(path: str | None) -> int:
    """Name the file or folder that was written."""
    if path is not None:
        print(f"wrote {path}")
    return 0


def _parser() -> argparse.ArgumentParser:
    """Every command with its options."""
    parser = argparse.ArgumentParser(prog="revolver-lab", description=rvl.__doc__)
    parser.add_argument("--version", action="version", version=rvl.__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    listing = _command(commands, "list", _list, "the registered robots")
    listing.add_argument("--short", action="store_true", help="names only")
    _command(commands, "doctor", _doctor, "what was found here, and how to mend what is missing")

    strip = _command(commands, "strip", _strip, "pictures of a robot along alpha", "robot", "alpha")
    _pictures(strip, "x.png", 240, 200)
    gif = _command(commands, "gif", _gif, "a film of a robot, or of a policy on it",
                   "robot", "alpha", "task", "seed", "steps")  # fmt: skip
    _pictures(gif, "x.gif or x.mp4", 320, 240)
    gif.add_argument("--policy", help='a policy file, or "expert"')
    gif.add_argument("--title", help="words under the pictures")
    gif.add_argument("--fps", type=float, default=20, help="frames a second (20)")

    train = _command(commands, "train-expert", _train_expert, "train an expert on the source robot",
                     "robot", "seed")  # fmt: skip
    train.add_argument("-o", "--out", required=True, help="folder for the policy and its card")
    move = _command(commands, "transfer", _transfer, "carry an expert to the target robot",
                    "robot", "seed", "steps")  # fmt: skip
    move.add_argument("--method", default="revolver", help="revolver, direct, scratch, ...")
    move.add_argument("--policy", default="expert", help='a policy file, or "expert"')
    move.add_argument("-o", "--out", help="folder for the log and the policy")
    judge = _command(commands, "evaluate", _evaluate, "returns of a policy along alpha",
                     "robot", "alpha", "task", "seed")  # fmt: skip
    judge.add_argument("--policy", default="expert", help='a policy file, or "expert"')
    judge.add_argument("--episodes", type=int, default=10, help="episodes on each robot (10)")
    return parser


_SHARED = {
    "robot": (("name",), {"metavar": "NAME", "help": "a robot that `list` shows"}),
    "alpha": (("--alpha",), {"type": float, "nargs": "+", "help": "which robots, in [0, 1]"}),
    "task": (("--task",), {"help": "which of the robot's rewards"}),
    "seed": (("--seed",), {"type": int, "default": 0, "help": "seed of everything random (0)"}),
    "steps": (("--steps",), {"type": int, "help": "environment steps"}),
}


def _command(
    commands: "argparse._SubParsersAction[argparse.ArgumentParser]",
    name: str,
    run: Callable[[Arguments], int],
    summary: str,
    *shared: str,
) -> argparse.ArgumentParser:
    """Add a command with some of the shared arguments."""
    command = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    for argument in shared:
        flags, settings = _SHARED[argument]
        command.add_argument(*flags, **settings)
    return command


def _pictures(command: argparse.ArgumentParser, example: str, width: int, height: int) -> None:
    """Add the arguments of the commands that draw."""
    command.add_argument("-o", "--out", required=True, help=example)
    for side, usual in (("width", width), ("height", height)):
        about = f"of one picture [pixels] ({usual})"
        command.add_argument(f"--{side}", type=int, default=usual, help=about)


if __name__ == "__main__":
    sys.exit(main())
