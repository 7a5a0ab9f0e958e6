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
# # Meet the robots
#
# Take two robots: one whose gait we know, and another with shorter legs, or more of them. Between
# the two lies a continuum of robots, each a little more like the second. We write E(α) for
# the robot at place α on the way: E(0) is the **source**, E(1) the **target**, and for
# every number between there is a robot that one can build, look at, and let run.
#
# **The claim: E(0) is the source and E(1) the target, exactly,** in every single number of their
# models. The last cell counts the numbers that differ.
#
# Nothing is trained here. Run the cells from the top with Shift+Enter.

# %% [markdown]
# The first cell loads a cheetah whose front leg is going to shrink. It prints its name, and how
# many of the numbers that describe it change on the way.

# %%
import revolver_lab as rvl

chosen = "cheetah-front-leg"
evolve = rvl.load(chosen)
print(evolve)

# %% [markdown]
# ## Drag a robot
#
# Below appears the cheetah, under a slider for α. Drag it, or select it and use the arrow
# keys: the front leg grows shorter, and the numbers that change are listed next to the picture.
# (This slider needs Python. On an exported page its place is empty, and the next one stands in.)

# %%
rvl.lab.explore(evolve)

# %% [markdown]
# Here comes the same slider again, recorded. It needs no Python behind it: export this notebook as
# a web page, send it to a friend, and it still moves.

# %%
rvl.lab.static_slider(evolve, frames=21, width=400, height=300)

# %% [markdown]
# ## All of them
#
# Next appear the pairs of robots that are built in, one film strip each, with α growing from
# left to right at one scale, and a line above it that says what changes. Some changes hide well:
# a picture does not show that a leg grows heavier, and the feet that grow out of nothing at the
# tips of the Ant's legs, in `ant-leg-emerge`, are hardly to be seen at this size.

# %%
from IPython.display import display

from revolver_lab.robots import registry

for name in rvl.names():
    print(f"{name}: {registry.get(name).summary}")
    strip = rvl.lab.strip(rvl.load(name), width=170, height=140)
    words = f"Film strip of {name}, alpha 0 to 1 in six pictures: {registry.get(name).summary}."
    display(rvl.lab.picture(strip, words))

# %% [markdown]
# ## What a policy knows
#
# A **policy** turns what a robot senses into what its motors do. The expert loaded below learnt to
# run on the source, and has met no other body. We let it act for four seconds on the source and on
# the target. A point is earned for every moment beyond the fifth metre that is run faster than
# 2 m/s; the cell prints the points.

# %%
expert = rvl.load_expert(chosen)
at_home = rvl.lab.record(expert, evolve, 0.0, steps=80, title="at home: E(0)")
abroad = rvl.lab.record(expert, evolve, 1.0, steps=80, title="abroad: E(1)")
print(f"source: {at_home.score:.0f} points, target: {abroad.score:.0f} points")

# %% [markdown]
# And here is what happened: the same policy, with the same weights, in two bodies side by side.
# Press play, or walk through time with the arrow keys.

# %%
rvl.lab.compare([at_home, abroad], width=260, height=195, fps=6)

# %% [markdown]
# Where does it begin to fail? The slider below has the expert on board. Choose an α, press
# play to watch it act on that robot, and look for the body at which it stumbles.

# %%
rvl.lab.explore(evolve, expert, alpha=0.3)

# %% [markdown]
# The policy that is an expert at home fails abroad. To carry it from the one to the other, a little
# at a time along α, is what this package is about.
#
# ## The number that must hold
#
# Back to the claim. The cell below builds source and target from their own files, as if there were
# no E, and compares every number of their models with E(0) and E(1). It prints how many
# numbers were compared and how many differ.

# %%
from revolver_lab.evolution.live import read

robot, compared, differing = registry.get(chosen), 0, 0
for own, alpha in ((robot.source(), 0.0), (robot.target(), 1.0)):
    there, here = read(own.compile()), read(evolve.model(alpha))
    compared += sum(there[name].size for name in there)
    differing += sum((there[name] != here[name]).sum() for name in there)

print(f"{compared} numbers compared, {differing} differ")
assert differing == 0

# %% [markdown]
# So the line of robots begins and ends exactly where it should, and a policy that has arrived at
# α = 1 has arrived on the target itself.
#
# **Go on:** choose another of the names above in the first cell and run everything again (there is
# an expert for all of them but the Humanoid, and what is rewarded differs). How E(α) is made, and
# how to make your own, is the subject of [01_points_on_a_path](01_points_on_a_path.ipynb).
