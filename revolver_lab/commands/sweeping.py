"""Commands that make many things at once: sweep, record."""

import sys

from revolver_lab.commands.parts import Arguments, policy_of, training, wrote
from revolver_lab.demonstration_sources import record as record_episodes
from revolver_lab.files import output_file, output_folder
from revolver_lab.runs.run import PROCESSES, ROOT
from revolver_lab.runs.summary import describe
from revolver_lab.runs.sweep import sweep as sweep_plans
from revolver_lab.runs.sweep_file import read_sweep
from revolver_lab.trajectories import Success


def sweep(arguments: Arguments) -> int:
    """Trains what a file asks for; what is there already is not trained again."""
    plans = read_sweep(arguments.file)

    def told(done: int, total: int) -> None:
        print(f"{done} of {total} jobs are done", file=sys.stderr, flush=True)

    with training():
        runs = sweep_plans(
            plans, root=arguments.root or ROOT,
            jobs=PROCESSES if arguments.jobs is None else arguments.jobs,
            cluster=arguments.dask, every=arguments.every, told=told,
        )  # fmt: skip
    for run in runs:
        print(f"{run.folder}\n{describe(run.results())}\n")
    return 0


def record(arguments: Arguments) -> int:
    """Records what a policy does, as demonstrations."""
    output_folder(output_file(arguments.out, ".npz").parent)
    found = record_episodes(
        policy_of(arguments.name, arguments.policy), arguments.name, arguments.episodes,
        alpha=arguments.alpha, seed=arguments.seed, task=arguments.task,
        deterministic=not arguments.sampled, success=Success() if arguments.successes else None,
    )  # fmt: skip
    path = found.save(arguments.out)
    print(
        f"{found.origin}: {int(found.lengths.sum())} steps, mean return {found.returns.mean():.4g}"
    )
    return wrote(path)
