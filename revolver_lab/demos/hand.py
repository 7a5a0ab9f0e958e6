"""`make demo`: a hand that opens doors loses three fingers, step by step, and goes on opening."""

import argparse
import dataclasses
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from revolver_lab.demos.now import Moment, Now
from revolver_lab.demos.parts import Board, draw, read_options, side_by_side, timed, written
from revolver_lab.experts import load_expert
from revolver_lab.gates import PILOT_GATE, Gate
from revolver_lab.natural_log import Iteration, Trial
from revolver_lab.natural_loop import NaturalTransfer
from revolver_lab.policies import Policy
from revolver_lab.progress import ProgressLines, describe_iteration
from revolver_lab.robots import registry

ROBOT = "adroit-door"
STEPS = 1_500_000  # of each learner at most; the gate ends it before
EPISODES = 100
LEAD, FOLLOW = "revolver", "direct"
_EVERY = 5.0  # seconds between pictures of where it is [s]
_WAIT = 0.05  # [s]


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the demonstration; see `--help`."""
    options = read_options(__doc__, "revolver_lab.demos.hand", "out", STEPS, arguments)
    expert, files = load_expert(ROBOT), []
    with timed(files):
        print(f"{ROBOT}: {registry.get(ROBOT).summary}. "
              "Reward: 1 for each of 200 steps in which the door is open.")  # fmt: skip
        home = NaturalTransfer(expert, ROBOT, seed=options.seed)
        source, untouched = (home.examine(alpha, EPISODES) for alpha in (0.0, 1.0))
        _say("expert, five fingers", source)
        _say("expert, two fingers, untouched", untouched)
        print("Now it trains on the way from five to two; beside it, as long, on two alone.")
        print("(The time left is at the latest pace, until alpha is 1; then, until it is sure.)")
        trials = _train(options)
        _say("two fingers after direct fine-tuning", trials[FOLLOW])
        _say("two fingers after REvolveR", trials[LEAD])
        print(f"Both after {trials[LEAD].steps:,} and {trials[FOLLOW].steps:,} steps of training.")
        carried = Policy.load(options.out / LEAD / "policy.safetensors")
        files += draw(partial(_pictures, expert, carried, options.seed), options.out)
        files += written(options.out, [FOLLOW, LEAD])


def _say(what: str, trial: Trial) -> None:
    """Prints one row of the table."""
    opened = f"{sum(trial.successes)} of {len(trial.successes)}"
    print(f"  {what:<38} opened {opened:>10}   mean return {trial.mean:6.1f}", flush=True)


def _train(options: argparse.Namespace) -> dict[str, Trial]:
    """Runs both learners, a process each; returns what they do on two fingers at the end."""
    shared = {"steps": options.steps, "seed": options.seed}
    jobs = {
        LEAD: partial(_lead, out=options.out / LEAD, **shared),
        FOLLOW: partial(_follow, out=options.out / FOLLOW, **shared),
    }
    lines, now = ProgressLines(), Now(ROBOT, options.out / "now.png", _EVERY)
    history: list[Iteration] = []

    def look(board: Mapping[str, Any]) -> None:
        if LEAD not in board:
            return  # it has failed, and the other follows
        made = board[LEAD].iteration
        if made not in history[-1:]:
            history.append(made)
        others = [describe_iteration(FOLLOW, board[FOLLOW].iteration)] if FOLLOW in board else []
        lines.write([describe_iteration(LEAD, made, _left(history)), *others])
        now.show(board[LEAD])

    with now:
        return side_by_side(jobs, look)


def _left(history: Sequence[Iteration], window: int = 30) -> float | None:
    """Returns the time left at the pace of the latest iterations [s], where that can be told."""
    first, last = history[-window:][0], history[-1]
    gone = last.alpha - first.alpha
    if gone <= 0 or last.alpha == 1.0:
        return None
    return (1 - last.alpha) / gone * (last.wall_time - first.wall_time)


def _lead(board: Board, steps: int, seed: int, out: Path) -> Trial:
    """REvolveR: alpha goes on as the gate allows."""
    try:
        loop = _loop(PILOT_GATE, steps, seed, board, LEAD)
        loop.run()
        board["end"] = loop.steps
    finally:
        board.setdefault("end", 0)  # whatever happens, nobody waits for it
    return _ended(loop, out)


def _follow(board: Board, steps: int, seed: int, out: Path) -> Trial:
    """Direct fine-tuning: as many steps as the other has had by then, and no more."""
    loop = _loop(dataclasses.replace(PILOT_GATE, alpha_start=1.0), steps, seed, board, FOLLOW)

    def pause() -> bool:
        while LEAD not in board or board[LEAD].iteration.steps <= loop.steps:
            if "end" in board:
                return loop.steps >= board["end"]
            time.sleep(_WAIT)
        return False

    loop.run(pause)
    return _ended(loop, out)


def _loop(gate: Gate, steps: int, seed: int, board: Board, name: str) -> NaturalTransfer:
    """Returns a learner that shows on the board how it is doing."""

    def report(made: Iteration) -> None:
        board[name] = Moment(iteration=made, policy=loop.learner.policy())

    loop = NaturalTransfer(
        load_expert(ROBOT), ROBOT, gate, steps=steps, seed=seed, nthread=1, report=report
    )
    return loop


def _ended(loop: NaturalTransfer, out: Path) -> Trial:
    """Plays fresh episodes on two fingers, and saves the log and the policy."""
    trial = loop.examine(1.0, EPISODES)
    loop.result().save(out)
    return trial


def _pictures(expert: Policy, carried: Policy, seed: int, out: Path) -> list[Path]:
    """Writes the film, at half speed, and the strip."""
    from revolver_lab import lab

    evolve = registry.load(ROBOT)
    rollouts = [
        lab.record(expert, evolve, 0.0, seed=seed, title="expert, five fingers"),
        lab.record(expert, evolve, 1.0, seed=seed, title="expert, two fingers"),
        lab.record(carried, evolve, 1.0, seed=seed, title="carried, two fingers"),
    ]
    lab.strip(evolve, path=out / "strip.png")
    film = lab.film(rollouts, out / "hand.gif", fps=12.5, speed=0.5)
    return [film, out / "strip.png"]


if __name__ == "__main__":
    main()
