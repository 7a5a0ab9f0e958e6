# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#     text_representation:
#       extension: .py
#       format_name: percent
#       format_version: '1.3'
#   kernelspec:
#     display_name: Python 3 (ipykernel)
#     language: python
#     name: python3
# ---

# %% [markdown]
# # What must be carried
#
# A policy travels through a thousand robots. What has to travel with it? There is the **actor**,
# which acts; there are the **critics**, which say how good an action is; there is the **replay**,
# what was seen so far; and there is the **optimiser**, Adam, which remembers its last gradients.
# The paper begins with the expert, whose actor and critics it goes on to update, and cleans the
# replay at every phase (line 31 of Algorithm 1). Here we leave them out, one at a time.
#
# **The claim: the expert's critic has to come along. With a new one, no seed gets where all seeds
# get with the old one,** although the actor is the same. The last cell compares every seed that
# carried its critic with every seed that did not.
#
# The first cell says what is compared, and whether anything is trained here.

# %%
import numpy as np

import revolver_lab as rvl

lesson = rvl.lab.lesson("06_what_must_be_carried")
print(lesson)

# %% [markdown]
# ## What an expert's file holds
#
# The cell loads the expert and prints its weights, added up by what they belong to. The *target
# critics* are copies of the critics that follow them slowly; what a critic is fitted to is computed
# with them.

# %%
name = lesson.robots[0]
expert = rvl.load_expert(name)
for part in ("actor", "critic", "critic_target"):
    arrays = [w for key, w in expert.weights.items() if key.split(".")[0] == part]
    print(f"{part:14} {len(arrays):2} arrays, {sum(w.size for w in arrays):,} numbers")

# %% [markdown]
# ### Exercise 1: pack
#
# A transfer with SAC begins. Name, in a set, what it takes over from the expert: `'actor'`,
# `'critics'`, `'target critics'`, `'replay'`, `'moments'` (Adam's). The cell prints what the check
# thinks of it.

# %%
from revolver_lab.exercises import what_must_be_carried as checks

packed = ...  # for example: {"actor", "replay"}
checks.one(packed)

# %% [markdown]
# ## What a critic knows
#
# Only the actor acts. Why is it not enough? From the first update on, the actor is changed so that
# the critic likes its actions better. A critic that knows nothing leads a good actor away.
#
# How much does the expert's critic know? The next cell writes down what a critic computes: from a
# state and an action, through two layers, a value. Nothing is printed yet.

# %%
hidden = 2


def value(weights, state, action):
    """Returns Q(s, a) of the first critic, (n,)."""
    x = np.concatenate([state, action], axis=1)
    for i in range(hidden):
        layer = {key: weights[f"critic.0.{i}.{key}"] for key in ("weight", "bias")}
        norm = {key: weights[f"critic.0.{i}.norm.{key}"] for key in ("weight", "bias")}
        x = x @ layer["weight"].T + layer["bias"]
        x = (x - x.mean(1, keepdims=True)) / np.sqrt(x.var(1, keepdims=True) + 1e-5)
        x = np.maximum(norm["weight"] * x + norm["bias"], 0)
    return (x @ weights["critic.0.2.weight"].T + weights["critic.0.2.bias"])[:, 0]


# %% [markdown]
# We ask critics a simple question: here is the expert's action, there is one drawn at random from
# all actions; which is better? The expert plays eight episodes on each of six robots, and the
# question is put in every state: to the expert's own critic, and to forty ignorant ones, which have
# the same weights, shuffled. Nothing is printed yet; it takes some seconds.

# %%
import time

alphas, rng, began = np.linspace(0, 1, 6), np.random.default_rng(0), time.perf_counter()
shuffled = [
    {key: rng.permutation(w.ravel()).reshape(w.shape) for key, w in expert.weights.items()}
    for _ in range(40)
]
prefers = np.empty((41, 6, 8))
for place, alpha in enumerate(alphas):
    env = rvl.make_vec_env(name, 8, alphas=alpha, seed=0, nthread=1)
    states = [env.reset()[0]]
    for _ in range(198):
        states.append(env.step(expert(states[-1]))[0])
    seen = np.concatenate(states)
    own, other = expert(seen), rng.uniform(-1, 1, (len(seen), expert.action_size))
    for k, critic in enumerate([expert.weights, *shuffled]):
        liked = value(critic, seen, own) > value(critic, seen, other)
        prefers[k, place] = liked.reshape(-1, 8).mean(axis=0)

# %% [markdown]
# The figure shows how often they preferred the expert's action; one half is what a coin does. (Its
# legend counts each shuffled critic as a seed.)

# %%
rvl.lab.plots.along_alpha(
    {"the expert's critic": prefers[0], "shuffled critics": prefers[1:]},
    alphas,
    cost=rvl.stats.Cost(steps=0, seconds=time.perf_counter() - began, evaluation_steps=6 * 8 * 199),
    ylabel="prefers the expert's action",
    title="Is the expert's action better than a random one?",
)

# %% [markdown]
# At home the expert's critic can tell, and the ignorant ones can not. Far from home it hardly can
# any longer: it has never seen these states. So a critic that is carried is worth something where
# the next robot is near, and that is what phases are for.
#
# ## What an optimiser knows
#
# Adam scales each step by the gradients it has seen, its *moments*. A policy file does not hold
# them, so that every transfer begins with fresh ones. What if every **phase** did?
#
# ### Exercise 2: the first step
#
# Adam begins with moments of zero (its β<sub>1</sub> = 0.9, β<sub>2</sub> = 0.999, ε can be left
# out). Write a function of a gradient g and the learning rate lr: by how much does the very first
# step change the weight?

# %%
first_step = ...  # for example: lambda g, lr: -lr * g
checks.two(first_step)

# %% [markdown]
# ## What a replay gathers
#
# A replay that is never cleaned keeps everything: the legs of all robots that ever were. More data
# is better, one might think.
#
# ### Exercise 3: of what?
#
# No cleaning: ξ = 0.12, l = 0.04, every phase brings the same number of transitions, and the phase
# at α = 0.8 begins, the 21st. Which fraction of the replay has β < α?

# %%
fraction = ...  # for example: 0.8
checks.three(fraction)

# %% [markdown]
# ## One at a time
#
# Now with learning. Each row is `revolver`, with a single thing changed:
#
# | row | what is changed |
# |---|---|
# | `critic-reset` | the transfer begins with new critics and target critics |
# | `no-cleaning` | the replay is never cleaned |
# | `window-0.33` | the cleaning keeps β in [α − 0.21, α + 0.12], three phases and more |
# | `optimiser-fresh` | Adam's moments are set to zero at every phase |
#
# The figure shows what the policies earn on the target. (If this notebook trains, the figure is
# alive, and there is a button to stop it.)

# %%
lesson.watch()

# %% [markdown]
# At the end, one dot for each seed.

# %%
results = lesson.results()
rvl.lab.plots.rows(results.scores(), cost=results.cost, title=f"{results.robot}: after training")

# %% [markdown]
# Where is it lost? The next figure shows what the episodes of training earned, phase by phase: on
# the robots of the phase, with actions drawn from the policy.

# %%
earned = {
    row: np.array([[p["episode_return"] for p in one.phases] for one in results.of(row)])
    for row in results.methods
}
phases = np.arange(earned["revolver"].shape[1])
rvl.lab.plots.curves(earned, phases, cost=results.cost, xlabel="phase", title="In training")

# %% [markdown]
# The actor is the same in all rows, so all begin alike. (Updates begin at 2,000 transitions, in the
# second phase.) The next cell prints the mean returns of the first five phases, on robots near home
# that the untrained expert mostly handles.

# %%
for row, table in earned.items():
    print(f"{row:16}", table[:, :5].mean(axis=0).round())

# %% [markdown]
# Compare the rows within a few phases of home. What a new critic takes from the actor there was not
# lost to new robots: the actor *unlearns* what it could do.
#
# And this is what the cleanings left in the replay.

# %%
kept = {row: results.kept(row) for row in ("revolver", "window-0.33", "no-cleaning")}
rvl.lab.plots.curves(
    kept, phases, cost=results.cost, xlabel="phase", ylabel="transitions that the cleaning left"
)

# %% [markdown]
# ## How much is it?
#
# Recorded runs of this pair: what each row differs from `revolver` on equal seeds, with a 95 %
# interval. A star marks an interval without 0 in it.

# %%
scores = lesson.recorded().scores()
print(f"{'revolver':16} {scores['revolver'].mean():6.1f}")
for row in lesson.methods[1:]:
    found = rvl.stats.paired(scores[row], scores["revolver"]).difference
    star = "*" * (found.low > 0 or found.high < 0)
    print(f"{row:16} {found.value:+6.1f} ({found.low:+.1f} to {found.high:+.1f}) {star}")

# %% [markdown]
# And on other robots, the two rows that say most: mean returns with everything
# carried, without the critic, and without the cleaning.

# %%
for robot in lesson.robots:
    means = lesson.recorded(robot, ["revolver", "critic-reset", "no-cleaning"]).scores()
    full, reset, uncleaned = (means[row].mean() for row in means)
    print(f"{robot:24} {full:5.1f}: new critics {reset:5.1f}, no cleaning {uncleaned:5.1f}")

# %% [markdown]
# Read every row for itself, and every pair of robots too. Some questions that the numbers leave:
#
# * `critic-reset` differs much from seed to seed. Would you have seen that with the paper's five?
#   And would a new critic do as well as the old one, if it had time to learn while the actor is
#   held still?
# * A learner without cleaning gets more data of everything, the target too, and less of it in each
#   batch. If it does worse on one pair and not on another, what is different about the pairs?
# * The paper's cleaning is a line without an argument. Is `window-0.33` worse than the paper's
#   window anywhere, beyond its interval? If not, what may one say?
# * After exercise 2, did you expect fresh moments to be a disaster? There are
#   twenty-five wild beginnings, and after each of them two hundred updates. What do you make of it?
#
# ## The number that must hold
#
# Back to the claim, on recorded runs. The cell prints how often a seed that carried its critic ends
# with more than one that did not.

# %%
scores = lesson.recorded().scores()
often = rvl.stats.probability_of_improvement(scores["revolver"], scores["critic-reset"])
print(f"carried beats reset in {often.value:.0%} of all pairs of {often.seeds} seeds each")
assert often.value > 0.95

# %% [markdown]
# An actor knows what to do, and its critic why. Take the reasons away, and the habit does not last.
#
# **Go on:** ask the critic of a policy that has arrived, with `lesson.recorded().of("revolver")[0]`
# and its `policy()`, about actions on the target, and on the source. Has it forgotten where it came
# from?
