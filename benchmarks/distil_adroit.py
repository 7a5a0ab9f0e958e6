"""Makes the hand's experts: python -m benchmarks.distil_adroit door TEACHER.npz [--seed 0]."""

import argparse
import dataclasses
import itertools
from pathlib import Path

import numpy as np
import torch
from torch import nn

import revolver_lab as rvl
from revolver_lab.cards import ModelCard, commit, versions
from revolver_lab.evaluation import evaluate
from revolver_lab.files import asset_folder
from revolver_lab.policies import Policy

EPISODES = 64  # of a round, side by side
ROUNDS = 6  # the first with the teacher at the wheel, those that follow with the pupil
EPOCHS, BATCH, RATE = 60, 512, 2e-3
WIDTH = 32
SMALLEST_SCALE = 0.02  # of an input: what hardly varies must not be blown up
LABEL_LIMIT = 1.5  # actions are clipped at 1; further out a teacher's mean says nothing more
FRESH_SEED = 2_000_000  # of the episodes on the card, which no training saw


def read_teacher(path: str) -> Policy:
    """The expert of DAPG as a policy; the arrays are named in the data's own README."""
    with np.load(path, allow_pickle=False) as file:
        z = {name: np.asarray(file[name], dtype=np.float64) for name in file.files}
    weights = {}
    for i in range(3):
        weights |= {f"actor.{i}.weight": z[f"W{i}"], f"actor.{i}.bias": z[f"b{i}"]}
    weights |= {"actor.input_shift": z["in_shift"], "actor.input_scale": z["in_scale"] + 1e-8}
    weights |= {"actor.output_shift": z["out_shift"], "actor.output_scale": z["out_scale"]}
    weights["actor.log_std"] = z["log_std"]
    return Policy(weights=weights, head="gaussian", activation="tanh")


def mean_of(policy: Policy, observations: np.ndarray) -> np.ndarray:
    """The policy's mean before it is clipped, but for what lies far out."""
    mean, _ = policy._distribution(observations)
    return np.clip(mean, -LABEL_LIMIT, LABEL_LIMIT)


def play(env, policy: Policy, rng: np.random.Generator, deterministic: bool) -> np.ndarray:
    """Observations of one episode in every simulation, (n T, O)."""
    observation, _ = env.reset()
    seen = []
    for _ in range(env.task.episode_steps):
        seen.append(observation)
        observation, *_ = env.step(policy(observation, deterministic=deterministic, rng=rng))
    return np.concatenate(seen)


def fit(net: nn.Sequential, inputs: np.ndarray, labels: np.ndarray) -> float:
    """Least squares by Adam with a falling rate; returns the last epoch's mean squared error."""
    x, y = (torch.as_tensor(a, dtype=torch.float32) for a in (inputs, labels))
    steps = EPOCHS * -(-len(x) // BATCH)
    adam = torch.optim.Adam(net.parameters(), lr=RATE)
    falling = torch.optim.lr_scheduler.CosineAnnealingLR(adam, steps)
    losses: list[float] = []
    for _ in range(EPOCHS):
        losses = []
        for rows in torch.randperm(len(x)).split(BATCH):
            loss = (net(x[rows]) - y[rows]).square().mean()
            adam.zero_grad()
            loss.backward()
            adam.step()
            falling.step()
            losses.append(float(loss.detach()))
    return float(np.mean(losses))


def pupil(net: nn.Sequential, shift: np.ndarray, scale: np.ndarray, log_std: np.ndarray) -> Policy:
    """The network as a policy of our own."""
    layers = [module for module in net if isinstance(module, nn.Linear)]
    weights = {"actor.input_shift": shift, "actor.input_scale": scale, "actor.log_std": log_std}
    for i, layer in enumerate(layers):
        weights[f"actor.{i}.weight"] = layer.weight.detach().numpy().copy()
        weights[f"actor.{i}.bias"] = layer.bias.detach().numpy().copy()
    weights = {name: array.astype(np.float32) for name, array in weights.items()}
    return Policy(weights=weights, head="gaussian", activation="tanh")


def distil(name: str, teacher: Policy, seed: int) -> tuple[Policy, int]:
    """DAgger (Ross et al. 2011): the teacher labels what it, and then its pupil, run into.

    The spread of the pupil's actions, one number a motor, is the one nearest to the teacher's in
    Kullback-Leibler divergence: sigma^2 = sigma_teacher^2 + mean squared difference of the means.
    """
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    env = rvl.make_vec_env(name, EPISODES, seed=seed)
    sizes = teacher.observation_size, WIDTH, WIDTH, teacher.action_size
    links = [nn.Linear(a, b) for a, b in itertools.pairwise(sizes)]
    net = nn.Sequential(links[0], nn.Tanh(), links[1], nn.Tanh(), links[2])
    seen = np.concatenate([play(env, teacher, rng, mean) for mean in (True, False)])
    shift, scale = seen.mean(axis=0), np.maximum(seen.std(axis=0), SMALLEST_SCALE)
    student = teacher
    for lesson in range(ROUNDS):
        if lesson:
            seen = np.concatenate([seen, play(env, student, rng, deterministic=lesson % 2 == 1)])
        labels = mean_of(teacher, seen)
        error = fit(net, (seen - shift) / scale, labels)
        with torch.no_grad():
            means = net(torch.as_tensor((seen - shift) / scale, dtype=torch.float32)).numpy()
        residual = np.square(means - labels).mean(axis=0)
        log_std = 0.5 * np.log(np.exp(2 * teacher.weights["actor.log_std"]) + residual)
        student = pupil(net, shift, scale, log_std)
        held = evaluate(student, name, 0.0, 32, seed=seed + 1, task="sparse") > env.task.goal_steps
        print(f"round {lesson}: {len(seen)} steps, error {error:.4f}, success {held.mean():.2f}")
    return student, len(seen)


def main() -> None:
    """Distil one expert and ship it for both paths, which share its robot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", choices=("hammer", "relocate", "door"))
    parser.add_argument("teacher", help="arrays W0, b0, ..., in_shift, ..., log_std in an .npz")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    name = f"adroit-{given.scene}"
    expert, steps = distil(name, read_teacher(given.teacher), given.seed)
    rates = []
    for deterministic in (True, False):
        returns = evaluate(expert, name, 0.0, 100, seed=FRESH_SEED, task="sparse",
                           deterministic=deterministic)  # fmt: skip
        rates.append(float((returns > 25).mean()))
        print(
            f"deterministic {deterministic}: success {rates[-1]:.2f}, return {returns.mean():.1f}"
        )
        if deterministic:
            score = float(returns.mean())
    card = ModelCard(
        robot=name, algorithm="DAgger", steps=steps, seed=given.seed, episode_return=score,
        versions=versions(), commit=commit(),
        command=f"python -m benchmarks.distil_adroit {given.scene} {Path(given.teacher).name}"
        f" --seed {given.seed}",
        note="Distilled from the DAPG expert (Rajeswaran et al. 2018; hand_dapg, Apache-2.0) by "
        "imitation of its mean action, without reward. Success over 100 fresh episodes: "
        f"{rates[0]:.2f} by mean action, {rates[1]:.2f} sampled; the return is sparse.",
    )  # fmt: skip
    for path in (name, f"{name}-fingers"):
        mine = expert.with_card(dataclasses.replace(card, robot=path))
        print(mine.save(asset_folder("experts") / f"{path}.safetensors"))


if __name__ == "__main__":
    main()
