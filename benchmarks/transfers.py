"""Transfers with several seeds and methods at equal steps, recorded in assets/results/.

python benchmarks/transfers.py cheetah-front-leg --methods direct revolver --seeds 0 1 2 3 4
"""

import argparse
import csv
import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import numpy as np

from revolver_lab.transferring import transfer
from revolver_lab.cards import commit, versions
from revolver_lab.evaluation import evaluate
from revolver_lab.experts import load_expert
from revolver_lab.files import write_json
from revolver_lab.logs import write_table
from revolver_lab.methods import method

RESULTS = Path(__file__).parent.parent / "assets" / "results"
EVALUATION_SEED = 3_000_000  # seen by no training


def run(robot: str, name: str, seed: int, steps: int, episodes: int) -> dict:
    """Runs one method with one seed; returns a row of the table."""
    os.environ["OMP_NUM_THREADS"] = "1"
    chosen = method(name)
    expert = load_expert(robot) if chosen.expert else None
    log = transfer(expert, robot, chosen.schedule, steps=steps, seed=seed, evaluate_episodes=0)
    returns = evaluate(log.policy, robot, 1.0, episodes, seed=EVALUATION_SEED + seed)[0]
    return {
        "robot": robot, "method": name, "seed": seed, "steps": log.steps,
        "mean_return": float(returns.mean()), "std_over_episodes": round(float(returns.std()), 3),
        "lowest": returns.min(), "highest": returns.max(), "episodes": episodes,
        "wall_time_s": log.wall_time, "commit": commit(),
    }  # fmt: skip


def record(path: Path, row: dict) -> list[dict]:
    """Adds a row to the table, in place of an older one of the same method and seed."""
    rows = []
    if path.exists():
        with path.open() as file:
            rows = list(csv.DictReader(file))
    key = (row["method"], str(row["seed"]))
    rows = [old for old in rows if (old["method"], old["seed"]) != key]
    rows = sorted([*rows, row], key=lambda r: (r["method"], int(r["seed"])))
    write_table(path, rows)
    return rows


def summarise(rows: list[dict], path: Path) -> None:
    """Writes mean and standard deviation over seeds, with what it takes to repeat them."""
    robot, steps, summary = rows[0]["robot"], rows[0]["steps"], {}
    for name in sorted({row["method"] for row in rows}):
        means = [float(row["mean_return"]) for row in rows if row["method"] == name]
        seeds = [int(row["seed"]) for row in rows if row["method"] == name]
        summary[name] = {
            "mean": float(np.mean(means)),
            "std_over_seeds": float(np.std(means, ddof=1)) if len(means) > 1 else None,
            "seeds": seeds,
            "command": f"python benchmarks/transfers.py {robot} --steps {steps} --methods {name} "
            f"--seeds {' '.join(map(str, seeds))}",
        }
    content = {
        "summary": summary,
        "versions": versions(),
        "cpus": os.cpu_count(),
        "expert": load_expert(robot).card.to_json(),
        "note": "mean_return: mean action, unshaped, on E(1), on episodes that training never saw; "
        "std_over_seeds has n - 1 in it; wall times are of a machine that others shared",
    }
    write_json(path, content)


def main() -> None:
    """Runs what the command line asks for, two processes at a time."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robot")
    parser.add_argument("--methods", nargs="+", default=["direct", "revolver"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2, 3, 4])
    parser.add_argument("--steps", type=int, default=72_000)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    started, table = time.monotonic(), RESULTS / f"{options.robot}.csv"
    with ProcessPoolExecutor(options.jobs, multiprocessing.get_context("spawn")) as pool:
        jobs = [pool.submit(run, options.robot, name, seed, options.steps, options.episodes)
                for seed in options.seeds for name in options.methods]  # fmt: skip
        for job in as_completed(jobs):
            rows = record(table, job.result())
            summarise(rows, table.with_suffix(".json"))
            print(job.result(), f"{time.monotonic() - started:.0f} s", flush=True)


if __name__ == "__main__":
    main()
