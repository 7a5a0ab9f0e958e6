"""`make demo-cheetah`: an expert fails on a changed cheetah; Algorithm 1 carries it there."""

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from revolver_lab.demos.parts import Board, draw, read_options, side_by_side, timed, written
from revolver_lab.evaluation import evaluate
from revolver_lab.experts import load_expert
from revolver_lab.methods import method
from revolver_lab.policies import Policy
from revolver_lab.progress import ProgressLines
from revolver_lab.recorder import Progress
from revolver_lab.robots import registry
from revolver_lab.transferring import transfer

ROBOT = "cheetah-front-leg"
STEPS = 72_000  # environment steps of each method
METHODS = {"direct": "direct fine-tuning on it", "revolver": "REvolveR, Algorithm 1"}
EPISODES = 20


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the demonstration; see `--help`."""
    options = read_options(__doc__, "revolver_lab.demos.cheetah", "out/cheetah", STEPS, arguments)
    expert, files = load_expert(ROBOT), []
    with timed(files):
        print(f"{ROBOT}: {registry.get(ROBOT).summary}. "
              "Reward: 1 for each of 200 steps fast in the speed trap.")  # fmt: skip
        source, untouched = evaluate(expert, ROBOT, [0.0, 1.0], EPISODES).mean(axis=1)
        _say("expert on the source robot", source)
        _say("expert on the target robot, untouched", untouched)
        print(f"Now {options.steps} steps on the way to the target robot, twice, side by side:")
        policies = _train(options)
        for name, words in METHODS.items():
            score = evaluate(policies[name], ROBOT, 1.0, EPISODES).mean()
            _say(f"target robot after {words}", score)
        files += draw(partial(_pictures, expert, policies["revolver"]), options.out)
        files += written(options.out, [*METHODS])


def _say(what: str, score: float) -> None:
    """Prints one number of the story."""
    print(f"  {what:<45} {score:6.1f} of 200  (mean of {EPISODES} episodes)", flush=True)


def _train(options: argparse.Namespace) -> dict[str, Policy]:
    """Runs every method in a process of its own; returns their policies."""
    jobs = {name: partial(_run, name, options.steps, options.seed, options.out / name)
            for name in METHODS}  # fmt: skip
    side_by_side(jobs, ProgressLines().show)
    return {name: Policy.load(options.out / name / "policy.safetensors") for name in METHODS}


def _run(name: str, steps: int, seed: int, out: Path, board: Board) -> None:
    """Runs one method and saves its log and policy; progress goes onto the board."""
    chosen = method(name)
    transfer(
        load_expert(ROBOT) if chosen.expert else None, ROBOT, chosen.schedule, steps=steps,
        seed=seed, evaluate_episodes=EPISODES, progress=partial(_put, board, name), out=out,
    )  # fmt: skip


def _put(board: Board, name: str, progress: Progress) -> None:
    """Puts progress onto the board."""
    board[name] = progress


def _pictures(expert: Policy, carried: Policy, out: Path) -> list[Path]:
    """Writes the film and the strip."""
    from revolver_lab import lab

    evolve = registry.load(ROBOT)
    rollouts = [
        lab.record(expert, evolve, 0.0, title="source"),
        lab.record(expert, evolve, 1.0, title="target, before"),
        lab.record(carried, evolve, 1.0, title="target, after"),
    ]
    lab.strip(evolve, path=out / "strip.png")
    film = lab.film(rollouts, out / "cheetah.gif", width=256, height=192, fps=10)
    return [film, out / "strip.png"]


if __name__ == "__main__":
    main()
