"""`make demo`: an expert fails on a changed robot; Algorithm 1 carries it there, with a film."""

import argparse
import functools
import multiprocessing
import os
import queue
import time
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

from revolver_lab.errors import RevolverError
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
METHODS = ("direct", "revolver")
EPISODES = 20


def main(arguments: list[str] | None = None) -> None:
    """Runs the demonstration; see `--help`."""
    parser = argparse.ArgumentParser(prog="python -m revolver_lab.demo", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the files")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--steps", type=int, default=STEPS, help="environment steps a method")
    options = parser.parse_args(arguments)
    started = time.monotonic()
    robot = registry.get(ROBOT)
    expert = load_expert(ROBOT)
    print(f"{ROBOT}: {robot.summary}. Reward: 1 for each of 200 steps fast in the speed trap.")
    source, untouched = evaluate(expert, ROBOT, [0.0, 1.0], EPISODES).mean(axis=1)
    _say("expert on the source robot", source)
    _say("expert on the target robot, untouched", untouched)
    print(f"Now {options.steps} steps on the way to the target robot, twice, side by side:")
    policies = _train(options)
    for name in METHODS:
        score = evaluate(policies[name], ROBOT, 1.0, EPISODES).mean()
        words = {"direct": "direct fine-tuning on it", "revolver": "REvolveR, Algorithm 1"}[name]
        _say(f"target robot after {words}", score)
    files = _pictures(expert, policies["revolver"], options)
    files += sorted(p for name in METHODS for p in (options.out / name).iterdir())
    minutes, seconds = divmod(round(time.monotonic() - started), 60)
    print(f"Done in {minutes} min {seconds} s. Files written:")
    print("\n".join(f"  {path}" for path in files))


def _say(what: str, score: float) -> None:
    """Prints one number of the story."""
    print(f"  {what:<45} {score:6.1f} of 200  (mean of {EPISODES} episodes)", flush=True)


def _train(options: argparse.Namespace) -> dict[str, Policy]:
    """Runs every method in a process of its own; returns their policies."""
    context = multiprocessing.get_context("spawn")
    lines, latest = ProgressLines(), {}
    with context.Manager() as manager, ProcessPoolExecutor(len(METHODS), context) as pool:
        messages = manager.Queue()
        runs = [pool.submit(_run, name, options.steps, options.seed, options.out / name, messages)
                for name in METHODS]  # fmt: skip
        while not all(run.done() for run in runs):
            latest |= _receive(messages)
            if latest:
                lines.show(latest)
        _raise_first(runs)
    return {name: Policy.load(options.out / name / "policy.safetensors") for name in METHODS}


def _run(name: str, steps: int, seed: int, out: Path, messages: Any) -> None:
    """Runs one method and saves its log and policy; progress goes into the queue."""
    os.environ["OMP_NUM_THREADS"] = "1"  # two one-thread processes: one core each
    chosen = method(name)
    transfer(
        load_expert(ROBOT) if chosen.expert else None, ROBOT, chosen.schedule, steps=steps,
        seed=seed, evaluate_episodes=EPISODES, progress=functools.partial(_send, messages, name),
        out=out,
    )  # fmt: skip


def _send(messages: Any, name: str, progress: Progress) -> None:
    """Puts progress into the queue."""
    messages.put((name, progress))


def _receive(messages: Any) -> dict[str, Progress]:
    """Takes what has come in the last half second, newest last."""
    latest = {}
    try:
        while True:
            name, progress = messages.get(timeout=0.5)
            latest[name] = progress
    except queue.Empty:
        return latest


def _raise_first(runs: list[Future]) -> None:
    """Raises what went wrong in a process, if anything did."""
    for run in runs:
        run.result()


def _pictures(expert: Policy, carried: Policy, options: argparse.Namespace) -> list[Path]:
    """Writes the film and the strip; where nothing can be drawn, says how to mend that."""
    from revolver_lab import lab

    evolve = registry.load(ROBOT)
    film, strip = options.out / "cheetah.gif", options.out / "strip.png"
    rollouts = [
        lab.record(expert, evolve, 0.0, title="source"),
        lab.record(expert, evolve, 1.0, title="target, before"),
        lab.record(carried, evolve, 1.0, title="target, after"),
    ]
    try:
        options.out.mkdir(parents=True, exist_ok=True)
        lab.strip(evolve, path=strip)
        return [lab.film(rollouts, film, width=256, height=192, fps=10), strip]
    except RevolverError as error:
        print(f"No film: {error}")
        return []


if __name__ == "__main__":
    main()
