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
# # What h does
#
# Each reward that is earned on the robot E(β) is multiplied by exp(h β) before SAC learns from it
# (section 4.3 of the paper): robots nearer to the target count for more. Theorem 1 says where this
# moves the best policy: from the one that is best on E(α + ξ/2) to the one that is best on E(φ),
# with φ = α + ξ/2 + ¼ h ξ² and terms that are smaller.
#
# **The claim: the optimum moves towards the target for every h > 0, but by ⅛ h ξ², half of what the
# theorem says,** when the regret is V-shaped, as in the paper's proof. The last cell measures the
# coefficient by search, with no formula for it.
#
# The first cell says what is compared further down, and whether anything is trained here.

# %%
import numpy as np

import revolver_lab as rvl
from revolver_lab import shaping, theory

lesson = rvl.lab.lesson("05_what_h_does")
print(lesson)

# %% [markdown]
# ## What is minimised
#
# Take, with the proof, one robot φ of the window, and the policy that is best on it. On another
# robot E(β) this policy loses |β − φ|, in some unit: its **regret**. Over the window, with its
# weights, it loses
#
# > L(φ) = ∫ exp(h β) |β − φ| dβ, from α to α + ξ
#
# and training on shaped rewards looks for the φ of least L. The next cell draws L over φ for h = 0
# and h = 8, in a window of width 0.5 that begins at α = 0, each over its mean weight. Look for the
# lowest point of each curve, marked by a dot.

# %%
from matplotlib.figure import Figure

places = np.linspace(0, 0.5, 101)
figure = Figure(figsize=(6, 3), layout="constrained")
axes = figure.subplots()
for h, style in ((0.0, "-"), (8.0, "--")):
    axes.plot(places, [theory.regret(phi, h, 0.5) for phi in places], style, label=f"h = {h:g}")
    lowest = theory.best_phi(h, 0.5)
    axes.plot(lowest, theory.regret(lowest, h, 0.5), "ko")
    print(f"h = {h:g}: lowest at phi = {lowest:.4f}")
axes.set(xlabel="phi", ylabel="L")
axes.legend()
words = "L over phi: for h = 0 lowest in the middle of the window, at 0.25; for h = 8 steep on the "
rvl.lab.Drawing(figure=figure, alt=words + "left and lowest near the right end, at 0.42.")

# %% [markdown]
# ## Where the lowest point is
#
# Move φ a little to the right. Every robot to its left loses a little more, every robot to its
# right a little less, each with its weight. At the lowest point the two sides balance:
#
# > ∫ exp(h β) dβ from α to φ = ∫ exp(h β) dβ from φ to α + ξ
#
# So φ is the **weighted median** of the window. α falls out, for exp(h α) stands on both sides, and
# what is left can be solved for φ.
#
# ### Exercise 1: the closed form
#
# Let the regret be V-shaped: a policy that is best on E(φ) loses |β − φ| on E(β). With the weights
# exp(h β) on [α, α + ξ] the best φ has as much weight below as above. Write a function of h and xi
# (h > 0) that gives φ − α. The cell prints what the check thinks of it.

# %%
from revolver_lab.exercises import what_h_does as checks

best_place = ...  # for example: lambda h, xi: xi / 2
checks.one(best_place)

# %% [markdown]
# ## Three coefficients
#
# Expanded for a small window, the weighted median is
#
# > φ = α + ξ/2 + **⅛** h ξ² − h³ ξ⁴/192 + ...
#
# If the regret is a parabola, (β − φ)², as it is near a smooth optimum, φ is the weighted *mean*:
#
# > φ = α + ξ/2 + **1/12** h ξ² − h³ ξ⁴/720 + ...
#
# and for |β − φ|ᵖ the coefficient is 1 / (4 (p + 1)). No p of 1 or more gives ¼. The table
# compares, at ξ = 0.5, a search over φ that knows no formula, the closed forms, and the theorem's
# condition.

# %%
print("   h   V: search, formula    parabola: search, formula    the paper")
for h in (1.0, 8.0, 30.0):
    v = theory.best_phi(h, 0.5), theory.phi_v(h, 0.5)
    parabola = theory.best_phi(h, 0.5, power=2), theory.phi_quadratic(h, 0.5)
    print(
        f"{h:4g}      {v[0]:.4f}  {v[1]:.4f}             {parabola[0]:.4f}  {parabola[1]:.4f}"
        f"            {theory.phi_paper(h, 0.5):.4f}"
    )

# %% [markdown]
# ## Where the quarter comes from
#
# The proof sets a variation to zero and writes it as an integral of ∂/∂β, where β is also the
# variable that is integrated over. Such an integral sees only the two ends of the window: it
# vanishes where exp(h α) (φ − α) = exp(h (α + ξ)) (α + ξ − φ), where the weighted regret of the
# first robot equals that of the last. This gives φ = α + ξ / (1 + exp(−h ξ)), whose series has
# the ¼. What has to vary is φ, the thing that is chosen. (On its way the proof also changes a sign:
# its second and third lines subtract the two halves, its fourth adds them. With the minus there is
# no solution inside the window.)
#
# What the theorem is for stands: for every convex regret that grows on both sides of φ, a larger h
# moves φ towards the target.
#
# ## How far is that?
#
# ### Exercise 2: two sizes
#
# The published numbers: h = 1, ξ = 0.1, l<sub>k</sub> = 0.002; SAC with ent_coef = 0.2. Give two
# numbers: by how many steps l<sub>k</sub> does h move the optimum, compared with h = 0 (V-shaped
# regret, h ξ² / 8 is near enough)? And at the end of the path, where β = 1, with which temperature
# would SAC on unshaped rewards prefer the same actions?

# %%
sizes = ...  # for example: (1.25, 0.2)
checks.two(sizes)

# %% [markdown]
# The first is less than one step: at the next phase, α has moved on by more than that. The second
# is no small thing.
#
# ## The other thing that h does
#
# A multiple of all rewards changes no optimum, if rewards are all there is. SAC has its entropy H
# beside them: it maximises w r + ent_coef H, which prefers the same actions as
# r + (ent_coef / w) H. Within one phase exp(h β) is a constant, exp(h α), times exp(h (β − α)). The
# first factor moves nothing, and grows along the path: at h = 1 from 1 to e. SAC's temperature
# falls to 37 % of what was set, and the critic has to be rescaled all the way. Three forms of the
# weight tell the two apart:
#
# * **absolute**, exp(h β), the paper's;
# * **relative**, exp(h (β − α)): does not grow with α, but is a little above 1 in the mean;
# * **normalised**: the same over its mean in the phase, so that its mean is 1, as without shaping.
#
# All three move the optimum by the same amount. If a result depends on h in the first form only, it
# was not the shift. The cell prints the mean weight along the path, at h = 1 and our ξ = 0.12.

# %%
alphas = np.array([0.0, 0.25, 0.5, 0.75, 0.96])
print(f"{'alpha':10}", alphas)
for form in shaping.FORMS:
    print(f"{form:10}", shaping.mean_weight(alphas, 0.12, 1.0, form).round(3))

# %% [markdown]
# ### Exercise 3: the shift alone
#
# Take the rescaling away and leave the shift. Write a function of betas (an array), alpha, xi and
# h, which gives weights that are proportional to exp(h β) and have the mean 1 over
# β ~ U(α, min(α + ξ, 1)), whatever betas happen to be in the batch.

# %%
weights = ...  # for example: lambda betas, alpha, xi, h: np.exp(h * (betas - alpha))
checks.three(weights)

# %% [markdown]
# ## What to expect
#
# Before we look at learners: how large are both effects in our rows, with ξ = 0.12 and
# l<sub>k</sub> = 0.04? The cell prints the shift in steps, the largest mean weight on the path, and
# the h that would be needed to move the optimum by a single step.

# %%
from revolver_lab.methods import method

rows = [method(name).schedule for name in lesson.methods]
for name, row in zip(lesson.methods, rows):
    moved = theory.shift(row.shaping, row.xi) / row.alpha_step
    factor = shaping.mean_weight(row.alphas, row.xi, row.shaping, row.shaping_form).max()
    print(f"{name:24} shift {moved:.3f} steps, rewards times {factor:.2f} at most")
print(f"one step needs h = {theory.h_for_shift(0.04, xi=0.12):.0f}")

# %% [markdown]
# ## The ablation
#
# The same rows, trained with SAC at a fixed temperature, 72,000 steps for each learner; returns are
# unshaped, whatever was trained on. (If this notebook trains, the figure is alive.)

# %%
lesson.watch()

# %% [markdown]
# At the end, one dot for each seed.

# %%
results = lesson.results()
rvl.lab.plots.rows(results.scores(), cost=results.cost, title=f"{results.robot}: after training")

# %% [markdown]
# Recorded runs: the mean without shaping, and what each row differs from it on equal seeds, with a
# 95 % interval. A star marks an interval without 0 in it. (There are several comparisons in this
# table; with ten seeds such intervals miss the truth about once in ten times, by luck alone.)

# %%
for robot in lesson.robots:
    scores = lesson.recorded(robot).scores()
    print(f"{robot}: {scores['revolver'].mean():.1f} without shaping")
    for name in lesson.methods[1:]:
        found = rvl.stats.paired(scores[name], scores["revolver"]).difference
        star = "*" * (found.low > 0 or found.high < 0)
        print(f"  {name:24} {found.value:+6.1f} ({found.low:+.1f} to {found.high:+.1f}) {star}")

# %% [markdown]
# The paper reports a gain from h = 1 on its ant (in its ablation table, over five seeds). **Here it
# is a loss**: `revolver-h1` ends below the row without shaping. And it is not the shift that costs:
# `revolver-h1-normalised` shifts the optimum as far, and loses nothing; `revolver-h8-normalised`
# shifts it eight times as far, and gains nothing either. An effect of less than a twentieth of a
# step is hardly to be found with ten seeds, as the theory above says beforehand. Questions:
#
# * Where `revolver-h3` differs from 0 and `revolver-h8-normalised` does not, which of the two
#   effects of h was it? The latter shifts the optimum more than twice as far.
# * Which row would you add, with h = 0, to show the same by the temperature alone?
# * The critic does not see β. Does SAC then minimise the L above at all? It weighs rewards, but the
#   actor's loss is a plain average over the states in the replay.
#
# ## The number that must hold
#
# Back to the claim. For four widths of the window, the cell searches the best φ at ± a small h and
# prints the coefficient of h ξ²: the slope over h, divided by ξ². The theorem says 0.25.

# %%
small, widths = 0.05, (0.02, 0.1, 0.12, 0.5)
found = [theory.best_phi(h / xi, xi) for xi in widths for h in (-small, small)]
slopes = np.diff(np.reshape(found, (4, 2)))[:, 0] / (2 * small * np.array(widths))
print(f"coefficients of h xi^2: {slopes.round(4)}")
assert np.allclose(slopes, 1 / 8, rtol=1e-3)

# %% [markdown]
# So shaping points the right way, and not far.
#
# **Go on:** give the two sides of the V different slopes, `theory.phi_v(0.0, 0.12, q=0.8)`. A
# policy that loses more on evolved robots than on those behind has its optimum moved by (q − ½) ξ
# with no h at all. Which of the two is the stronger lever? Then:
# [06_what_must_be_carried](06_what_must_be_carried.ipynb).
