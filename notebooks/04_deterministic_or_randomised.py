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
# # Deterministic or randomised?
#
# In phase k of REvolveR the robots are not E(α) but E(β), with β drawn anew for every episode from
# [α, α + ξ]. That is *randomised* evolution. With ξ = 0 every robot of a phase is E(α), which is
# *deterministic* evolution. The paper's first ablation finds that randomised evolution earns more,
# and varies less, and says why: random robots make the policy robust.
#
# **The claim: here, most of what randomness seems to gain is gained by data.** Two things change
# with ξ: which robots a learner meets, and how much of what it saw the cleaning of the replay
# leaves it. In the last cell we hold the second equal, and see what is left of the first.
#
# The first cell says what is compared, and whether anything is trained here.

# %%
import numpy as np

import revolver_lab as rvl

lesson = rvl.lab.lesson("04_deterministic_or_randomised")
print(lesson)

# %% [markdown]
# ## What the paper found
#
# On the ant whose legs change in length and mass, with SAC and five seeds (the paper's ablation
# table, without shaping): 5363.89 ± 419.90 deterministic, 5844.46 ± 33.63 randomised. How sure can
# one be with five seeds? The cell takes the ± as the standard deviation over seeds, and prints how
# often a difference as large would come about by luck (Welch's t-test).

# %%
from scipy.stats import ttest_ind_from_stats

told = ttest_ind_from_stats(5844.46, 33.63, 5, 5363.89, 419.90, 5, equal_var=False)
print(f"difference {5844.46 - 5363.89:.0f}, p = {told.pvalue:.2f}")

# %% [markdown]
# Not a lot of luck is needed. What the paper reports may well be so, but five seeds cannot show
# it; and the paper does not compare what the two had to learn from.
#
# ## The whole ablation at once
#
# The pair of robots is the one that the first cell named; the reward is sparse. Four rows: the two
# variants as they come, and the two with equal data, of which more below. All learners of all rows
# and seeds are independent, and train side by side in one **population**: their networks are
# stacked and multiplied together. The figure shows what their policies earn on the target. (If
# this notebook trains, the figure is alive.)

# %%
lesson.watch()

# %% [markdown]
# ## As they come
#
# At the end, one dot for each seed: deterministic and randomised evolution, nothing else changed.

# %%
results = lesson.results()
as_they_come = results.select(["deterministic", "revolver"])
rvl.lab.plots.rows(as_they_come.scores(), cost=as_they_come.cost, title="As they come")

# %% [markdown]
# Before we call the one variant robust: a deterministic learner takes steps of 0.04 and meets 26
# robots, each next to the one before. A randomised one meets the robots between them, too. Is that
# all that differs?
#
# ## What each cleaning keeps
#
# When a phase begins, Algorithm 1 cleans the replay: transitions with β in [α, α + ξ] stay, all
# others go (line 31). Next appears how many transitions that leaves, phase by phase.

# %%
phases = np.arange(results.kept("revolver").shape[1])
rvl.lab.plots.curves(
    {name: results.kept(name) for name in as_they_come.methods},
    phases,
    cost=as_they_come.cost,
    xlabel="phase",
    ylabel="transitions that the cleaning left",
)

# %% [markdown]
# The deterministic learner begins every phase with an **empty** replay: ξ = 0 makes the window a
# single point, and α has moved on from it. It then learns from the eight transitions of the first
# tick, over and over, then from sixteen, and so on, and when it has some data it is taken away.
# How much a randomised learner keeps is for you to compute.
#
# ### Exercise 1: what one cleaning leaves
#
# A phase is over, α grows by l (`alpha_step`), and the replay is cleaned. The betas of the phase
# were drawn from [α, α + ξ]. Write a function of l and ξ: which fraction of that phase's
# transitions stays, on average? ξ = 0 is the deterministic variant. The cell prints what the check
# thinks of it.

# %%
from revolver_lab.exercises import deterministic_or_randomised as checks

stays = ...  # for example: lambda alpha_step, xi: alpha_step / xi
checks.one(stays)

# %% [markdown]
# ### Exercise 2: what the replay holds
#
# And all earlier phases? Each brought n transitions, and there were many of them. Write a function
# of l, ξ and n: how many transitions does the replay hold at the beginning of a phase, right after
# cleaning? Compare with the figure above: a phase brings n = 1600.

# %%
holds = ...  # for example: lambda alpha_step, xi, n: n
checks.two(holds)

# %% [markdown]
# ## With equal data
#
# So the two variants differ in two ways, and the comparison cannot tell which one matters. The
# remedy: a cleaning that leaves the **latest 1,600 transitions**, whatever their β. Both variants
# then learn from the same amount of equally fresh data, and differ in their robots alone.

# %%
rvl.lab.plots.rows(results.scores(), cost=results.cost, title="As they come, and with equal data")

# %% [markdown]
# The next cell prints the difference, randomised minus deterministic, on equal seeds, with a 95 %
# interval: first as they come, then with equal data.

# %%
for kind in ("", "-equal"):
    scores = results.scores()
    found = rvl.stats.paired(scores["revolver" + kind], scores["deterministic" + kind]).difference
    print(f"{kind or 'as they come':12} {found.value:6.1f} ({found.low:.1f} to {found.high:.1f})")

# %% [markdown]
# Why is it so harmful to clean everything away? One guess: the critic is carried from phase to
# phase, the policy follows it, and a few transitions, seen hundreds of times, are enough to spoil
# it. How would you test that guess?
#
# ## Other pairs of robots
#
# Recorded runs on the pairs that have all four rows: the mean of each, and the difference with
# equal data.

# %%
print(f"{'':24}" + "".join(f"{name:>20}" for name in lesson.methods))
for name in lesson.robots:
    scores = lesson.recorded(name).scores()
    found = rvl.stats.paired(scores["revolver-equal"], scores["deterministic-equal"]).difference
    means = "".join(f"{scores[method].mean():20.1f}" for method in lesson.methods)
    print(f"{name:24}{means}   {found.value:+.1f} ({found.low:+.1f} to {found.high:+.1f})")

# %% [markdown]
# How much starvation hurts depends on the expert, too. The next cell prints what both variants
# come to, as they come, with another expert that is equally good at home, on the first pair.

# %%
from revolver_lab.runs.course import OTHER_EXPERT

other = lesson.recorded(methods=["deterministic", "revolver"], expert=OTHER_EXPERT).scores()
found = rvl.stats.paired(other["revolver"], other["deterministic"]).difference
print(", ".join(f"{name} {each.mean():.1f}" for name, each in other.items()))
print(f"difference {found.value:+.1f} ({found.low:+.1f} to {found.high:+.1f})")

# %% [markdown]
# ## Over ξ, with equal data
#
# If random robots make a policy robust, a wider window should help, until it is so wide that
# robots appear that the policy cannot handle. Four widths, recorded, with equal data; the first is
# the deterministic variant.

# %%
widths = {"0": "deterministic-equal", "0.06": "xi-0.06-equal", "0.12": "revolver-equal"}
widths["0.3"] = "xi-0.3-equal"
wide = lesson.recorded(methods=[*widths.values()])
scores = {f"xi = {xi}": wide.scores()[name] for xi, name in widths.items()}
rvl.lab.plots.rows(scores, cost=wide.cost, title="Over xi, with equal data")

# %% [markdown]
# ## Over the length of a phase
#
# If starvation is the reason, there must be a milder cure than a new cleaning: fewer phases, each
# twice as long and with steps twice as large, so that the whole way costs the same. The replay is
# still emptied, but half as often, and has time to fill. (The published ant had phases of about
# 6,000 steps, which is several episodes; ours have 1,600, exactly one episode of each simulation.)

# %%
lengths = lesson.recorded(
    methods=["deterministic", "deterministic-long", "revolver", "revolver-long"]
)
rvl.lab.plots.rows(lengths.scores(), cost=lengths.cost, title="Phases of 1,600 and of 3,200 steps")

# %% [markdown]
# ## Robust against what?
#
# Robustness can be asked for directly: let two of the finished policies, one of each kind with
# equal data, act on the last fifth of the way, robots that are near the target but not it. Both
# trained on the target alone in the end. The band is over episodes of **one** policy each, so it
# says nothing about other seeds.

# %%
alphas, near = np.linspace(0.8, 1, 6), {}
for name in ("deterministic-equal", "revolver-equal"):
    policy = lesson.recorded().of(name)[0].policy()
    near[name] = rvl.evaluate(policy, lesson.robots[0], alphas, episodes=10, seed=5)
rvl.lab.plots.along_alpha(near, alphas, cost=results.cost, title="Near the target")

# %% [markdown]
# ### Exercise 3: what may be said?
#
# Before the experiment we agreed that a difference of less than 10 points does not matter. Below
# are four 95 % intervals of the difference, randomised minus deterministic. Give four words, each
# `"better"` (randomised is), `"worse"`, `"alike"` (the difference does not matter), `"unclear"`
# (more seeds are needed) or `"unfair"` (the comparison cannot show it).
#
# * (a) 4 seeds, +32, from −9 to +71.
# * (b) 20 seeds, −2, from −6 to +3.
# * (c) 20 seeds, +22, from +13 to +31, with equal data in the replay.
# * (d) 20 seeds, +40, from +25 to +55; after each cleaning the randomised learner kept 1,600
#   transitions and the deterministic one none. Does it show that random robots make a policy
#   robust?

# %%
words = ...  # for example: ["better", "better", "better", "better"]
checks.three(words)

# %% [markdown]
# ## The number that must hold
#
# Back to the claim, on recorded runs. The cell prints how much of the gap between randomised and
# deterministic evolution is left when both have the same amount of data.

# %%
scores = lesson.recorded().scores()
gap = (scores["revolver"] - scores["deterministic"]).mean()
equal = (scores["revolver-equal"] - scores["deterministic-equal"]).mean()
print(f"a gap of {gap:.0f} points, {equal:.0f} with equal data: {equal / gap:.0%} are left")
assert abs(equal) < 0.25 * gap

# %% [markdown]
# So on this robot, as they come, a learner that keeps data is compared with one that keeps none.
# That does not refute the paper, whose robot, reward and lengths are others: its phases hold
# several episodes, so that starvation should be milder there. It says what has to be held equal
# before "robust" is the word for the outcome. **What would you run to decide it on the ant?**
#
# **Go on:** the replay holds rewards, too, and REvolveR multiplies them:
# [05_what_h_does](05_what_h_does.ipynb).
