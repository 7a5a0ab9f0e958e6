"""Every command with its arguments; what a command does is imported when it is asked for."""

import argparse
from pathlib import Path

Commands = argparse._SubParsersAction
Parser = argparse.ArgumentParser

_POLICY = '"expert", a policy file, or a run\'s folder and learner: FOLDER:METHOD-SEED'
_ROBOTS = "a robot that `list` shows, or two files (MJCF, URDF): the source and the target"
_SHARED = {
    "robot": (("name",), {"metavar": "NAME", "help": "a robot that `list` shows"}),
    "robots": (("names",), {"metavar": "ROBOT", "nargs": "+", "help": _ROBOTS}),
    "alpha": (("--alpha",), {"type": float, "nargs": "+", "help": "which robots, in [0, 1]"}),
    "task": (("--task",), {"help": "which of the robot's rewards"}),
    "seed": (("--seed",), {"type": int, "default": 0, "help": "seed of everything random (0)"}),
    "steps": (("--steps",), {"type": int, "help": "environment steps"}),
}


def make_parser(description: str | None, version: str) -> Parser:
    """Returns the parser; the parsed `run` names the function, "module:function".

    Args:
        description: Of the whole.
        version: Of the package.
    """
    parser = Parser(prog="revolver-lab", description=description)
    parser.add_argument("--version", action="version", version=version)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in (_looking, _train_expert, _transfer, _many, _judging, _runs):
        add(commands)
    return parser


def _named(text: str) -> str:
    """Refuses an empty name, which would stand for the folder one works in."""
    if not text:
        raise argparse.ArgumentTypeError(
            "an empty name. Allowed: that of a file or folder. Name one."
        )
    return text


def _path(text: str) -> Path:
    """Returns a path that has a name."""
    return Path(_named(text))


def _add(commands: Commands, name: str, run: str, summary: str, *shared: str) -> Parser:
    """Adds a command with some of the shared arguments."""
    command = commands.add_parser(name, help=summary, description=summary)
    command.set_defaults(run=run)
    for argument in shared:
        flags, settings = _SHARED[argument]
        command.add_argument(*flags, **settings)
    return command


def _looking(commands: Commands) -> None:
    """Commands that look at robots."""
    listing = _add(commands, "list", "looking:show_list", "the registered robots")
    listing.add_argument("--short", action="store_true", help="names only")
    _add(commands, "doctor", "looking:doctor",
         "what was found here, and how to mend what is missing")  # fmt: skip
    _add(commands, "match", "looking:match", "what became what in two robots", "robots")
    strip = _add(commands, "strip", "looking:strip", "pictures of a robot along alpha",
                 "robots", "alpha")  # fmt: skip
    _pictures(strip, "x.png", 240, 200)
    gif = _add(commands, "gif", "looking:gif", "a film of a robot, or of a policy on it",
               "robots", "alpha", "task", "seed", "steps")  # fmt: skip
    _pictures(gif, "x.gif or x.mp4", 320, 240)
    gif.add_argument("--policy", type=_named, nargs="+", help=f"{_POLICY}; one, or one a picture")
    gif.add_argument("--title", nargs="+", help="words under the pictures, one or one a picture")
    gif.add_argument("--fps", type=float, default=20, help="frames a second (20)")
    gif.add_argument("--speed", type=float, default=1.0, help="of policies; 1 is real time (1)")


def _pictures(command: Parser, example: str, width: int, height: int) -> None:
    """Adds the arguments of the commands that draw."""
    command.add_argument("-o", "--out", type=_named, required=True, help=example)
    for side, usual in (("width", width), ("height", height)):
        about = f"of one picture [pixels] ({usual})"
        command.add_argument(f"--{side}", type=int, default=usual, help=about)
    command.add_argument("--camera", default="fit", help="a camera of the robot (fit: all of it)")


def _train_expert(commands: Commands) -> None:
    """The command that trains an expert."""
    train = _add(commands, "train-expert", "training:train_expert",
                 "train an expert on the source robot, by its recipe, or for so many --steps",
                 "robot", "seed", "steps", "task")  # fmt: skip
    train.add_argument(
        "-o", "--out", type=_named, required=True, help="folder for the policy and its card"
    )


def _transfer(commands: Commands) -> None:
    """The command that transfers."""
    move = _add(commands, "transfer", "training:transfer", "carry an expert to the target robot: "
                "one learner into a folder (--method), or methods times seeds as a run "
                "(--methods)", "steps", "task")  # fmt: skip
    move.add_argument("name", metavar="NAME", nargs="?", help="a robot that `list` shows")
    move.add_argument("--policy", type=_named, default="expert", help=_POLICY)
    one = move.add_argument_group("one learner")
    one.add_argument("--method", help="revolver (if nothing is said), direct, scratch, ...")
    one.add_argument("--seed", type=int, help="seed of everything random (0)")
    one.add_argument("-o", "--out", type=_named, help="folder for the log and the policy")
    many = move.add_argument_group("a run")
    many.add_argument("--methods", nargs="+", help="what is compared")
    many.add_argument("--seeds", type=int, nargs="+", help="seeds of every method")
    many.add_argument("--plan", type=_path, help="the config.json of a run, to train it again")
    many.add_argument("--processes", type=int, help="workers (2)")
    many.add_argument("--root", type=_path, help="where runs are (out/runs)")
    many.add_argument("--every", type=float, help="seconds between checkpoints (60)")


def _many(commands: Commands) -> None:
    """Commands that make many things at once."""
    sweep = _add(commands, "sweep", "sweeping:sweep",
                 "train methods times robots times seeds, as a file says")  # fmt: skip
    sweep.add_argument("file", metavar="FILE.toml", type=_path, help="what to train")
    sweep.add_argument("--jobs", type=int, help="processes here (2)")
    sweep.add_argument("--dask", metavar="ADDRESS", help="a Dask scheduler that gives the jobs out")
    sweep.add_argument("--root", type=_path, help="where runs are (out/runs)")
    sweep.add_argument("--every", type=float, default=60.0, help="seconds between checkpoints (60)")
    play = _add(commands, "record", "sweeping:record",
                "record demonstrations of a policy", "robot", "task", "seed")  # fmt: skip
    play.add_argument("--policy", type=_named, default="expert", help=_POLICY)
    play.add_argument("--alpha", type=float, default=0.0, help="the robot, in [0, 1] (0)")
    play.add_argument("--episodes", type=int, default=25, help="how many (25)")
    play.add_argument("--sampled", action="store_true", help="draw actions, not their mean")
    play.add_argument("--successes", action="store_true", help="keep only episodes that succeed")
    play.add_argument("-o", "--out", type=_named, required=True, help="x.npz")


def _judging(commands: Commands) -> None:
    """The command that evaluates a policy."""
    judge = _add(commands, "evaluate", "reporting:evaluate", "returns of a policy along alpha",
                 "robot", "alpha", "task", "seed")  # fmt: skip
    judge.add_argument("--policy", type=_named, default="expert", help=_POLICY)
    judge.add_argument("--episodes", type=int, default=10, help="episodes on each robot (10)")


def _runs(commands: Commands) -> None:
    """Commands that read runs."""
    tell = _add(commands, "report", "reporting:report",
                "the table of runs, with intervals, seeds and cost")  # fmt: skip
    which = "a run's folder, or a robot's name for what is recorded of it"
    tell.add_argument("runs", metavar="RUN", nargs="+", type=_named, help=which)
    tell.add_argument("--threshold", type=float, help="mean return from which on, it "
                      "included, a learner succeeds (half of the expert's gain at home over "
                      "idling); natural methods tell success themselves")  # fmt: skip
    tell.add_argument("--markdown", action="store_true", help="as a page would have it")
    tell.add_argument("--csv", type=_path, help="a file for the table")
    store = _add(commands, "keep", "reporting:keep", "copy finished runs, without what is large")
    store.add_argument("runs", metavar="FOLDER", nargs="+", type=_path, help="a run's folder")
    store.add_argument("-o", "--out", type=_path, required=True, help="folder of recorded runs")
    board = _add(commands, "tensorboard", "reporting:tensorboard",
                 "event files of what a run holds so far")  # fmt: skip
    board.add_argument("folder", metavar="FOLDER", type=_path, help="a run's folder")
    board.add_argument("-o", "--out", type=_path, help="where they go (FOLDER/tensorboard)")
