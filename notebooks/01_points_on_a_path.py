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
# # Points on a path
#
# How does one robot become another? A robot file is a tree of bodies and joints, and a few hundred
# numbers. Section 4.1 of the REvolveR paper (ICML 2022) does it in two steps: **match** the two
# trees, then **mix** the numbers,
#
# > θ(α) = (1 − f(α)) θ<sub>S</sub> + f(α) θ<sub>T</sub>
#
# Here θ<sub>S</sub> and θ<sub>T</sub> list the numbers of source and target, and f rises from
# f(0) = 0 to f(1) = 1. The robot with the numbers θ(α) is E(α).
#
# **The claim: with f(α) = α, the robots we compile lie on a straight line.** The last
# cell measures the furthest that any of 101 robots strays from it.

# %% [markdown]
# ## Two robots
#
# The first cell writes down a gripper with a finger and a thumb, as MJCF text. Nothing appears yet.

# %%
GRIPPER = """
<mujoco model="gripper">
  <default>
    <geom type="capsule" size=".02" rgba=".2 .4 .6 1"/>
    <joint axis="0 1 0" range="-40 40"/>
  </default>
  <worldbody>
    <light pos="0 -1 2" dir="0 1 -2"/>
    <geom name="table" type="plane" size="1 1 .1" rgba=".8 .8 .8 1"/>
    <body name="palm" pos="0 0 .06">
      <geom name="palm" type="box" size=".1 .05 .06" rgba=".3 .35 .45 1"/>
      <body name="finger" pos=".07 0 .06"> <joint name="knuckle"/>
        <geom name="finger" fromto="0 0 0 0 0 .16"/>
        <geom name="pad" type="sphere" pos="0 0 .16" size=".03" rgba=".9 .6 .2 1"/>
      </body>
      <body name="thumb" pos="-.07 0 .06"> <joint name="base"/>
        <geom name="thumb" fromto="0 0 0 0 0 .14"/>
      </body>
    </body>
  </worldbody>
  <actuator> <motor joint="knuckle"/> <motor joint="base"/> </actuator>
</mujoco>"""

# %% [markdown]
# And a hand: its palm is wider, the pad is larger, the thumb is turned by 60 degrees, the finger
# has a **tip** with a joint of its own, and there is a **little** finger.

# %%
HAND = """
<mujoco model="hand">
  <default>
    <geom type="capsule" size=".02" rgba=".2 .4 .6 1"/>
    <joint axis="0 1 0" range="-40 40"/>
  </default>
  <worldbody>
    <body name="palm" pos="0 0 .06">
      <geom name="palm" type="box" size=".12 .05 .06" rgba=".3 .35 .45 1"/>
      <body name="finger" pos=".09 0 .06"> <joint name="knuckle"/>
        <geom name="finger" fromto="0 0 0 0 0 .16"/>
        <geom name="pad" type="sphere" pos="0 0 .16" size=".05" rgba=".9 .6 .2 1"/>
        <body name="fingertip" pos="0 0 .16"> <joint name="tip"/>
          <geom name="fingertip" fromto="0 0 0 0 0 .12"/> </body>
      </body>
      <body name="thumb" pos="-.1 0 .06" euler="0 -60 0"> <joint name="base"/>
        <geom name="thumb" fromto="0 0 0 0 0 .14"/> </body>
      <body name="little" pos="0 0 .06"> <joint name="little"/>
        <geom name="little" fromto="0 0 0 0 0 .2" rgba=".8 .35 .3 1"/> </body>
    </body>
  </worldbody>
  <actuator> <motor joint="knuckle"/> <motor joint="tip"/> <motor joint="base"/>
    <motor joint="little"/> </actuator>
</mujoco>"""

# %% [markdown]
# Two files are all it takes. Below appears a slider that pulls the gripper into a hand: watch the
# fingertip and the little finger come out of nothing.

# %%
import revolver_lab as rvl

evolve = rvl.Evolution(GRIPPER, HAND)
rvl.lab.explore(evolve)

# %% [markdown]
# For readers without Python, the same as a film strip.

# %%
strip = rvl.lab.strip(evolve, width=170, height=160)
rvl.lab.picture(
    strip,
    "Film strip, alpha 0 to 1. A palm with finger and thumb; the thumb leans over more and more, "
    "while a little finger grows from the palm and a tip from the finger, out of nothing.",
)

# %% [markdown]
# ## Matching: what became what
#
# Before numbers can be mixed, every body needs a partner. Starting from the root, the two trees are
# laid over each other; **what one robot lacks is created there at zero size**, with its joint and
# its motor, so that afterwards both trees are the same. Among all ways to do so, the one that
# creates least is taken. This is figure 2 of the paper, for our two robots: dashed is what was
# created.

# %%
rvl.lab.show(evolve.matching)

# %% [markdown]
# A limb of no size and no mass changes nothing: E(0) moves as the gripper did. But it has joints
# that the gripper had not, so its vectors of positions, velocities and actions are longer. The next
# cell prints the joints in the order in which MuJoCo numbers them: down the tree, limb by limb.

# %%
model = evolve.model(0)
print([model.joint(i).name for i in range(model.njnt)])

# %% [markdown]
# ### Exercise 1: zero insertion
#
# The gripper holds its joints at `q = [knuckle, base]`. Write a function that returns the same pose
# for E(0), a list of four numbers. The cell prints what the check thinks of it.

# %%
from revolver_lab.exercises import points_on_a_path as checks

lifted = ...  # for example: lambda q: [q[0], q[1]]
checks.one(lifted)

# %% [markdown]
# ## Theta: what there is to mix
#
# θ collects every continuous number of the matched robots: places, sizes, densities, ranges,
# gears. The next cell prints those that change, with their values at α = 0, 0.5 and 1.
# Find the created limbs: their mass starts at nearly nothing.

# %%
import numpy as np

theta = [evolve.theta(alpha) for alpha in (0, 0.5, 1)]
for i in np.flatnonzero(evolve.theta_changed):
    print(f"{evolve.theta_names[i]:36}", *(f"{values[i]:10.4g}" for values in theta))

# %% [markdown]
# Three kinds of rows deserve a second look.
#
# * `geom/pad/size[0]` is the radius of the pad. Its mass is not in the list: it *follows* from
#   radius and density when the robot is compiled, as its surface does. What is mixed is the
#   parameter, never what follows from it. (Created limbs are the exception: they list a mass, for
#   it has to start at nearly nothing.)
# * `body/thumb/quat[1]` is an angle, in radians, about y. The file holds a quaternion, but
#   quaternions cannot be mixed number by number. θ holds the rotation from source to target
#   as a vector, axis times angle, and mixing that turns the thumb evenly. (The same motion is known
#   as *slerp*.)
# * `margin` and `armature` of what was created fade out along the way: the first keeps limbs out of
#   contact while they are nearly nothing, the second steadies joints that as yet carry no mass.
#
# ### Exercise 2: between
#
# Return two things for every α: the mass of the pad [kg], and the quaternion (w, x, y, z)
# of the thumb. The radius goes from 0.03 m to 0.05 m at a density of 1000 kg/m³, the thumb from 0
# to −60 degrees about y, and f(α) = α.

# %%
between = ...  # for example: lambda alpha: (0.3, [1, 0, 0, 0])
checks.two(between)

# %% [markdown]
# ## f: how fast to go
#
# f decides how the way is spread over [0, 1]. The figure below shows the radius of the pad for
# three of them: `linear`, the choice of the paper; `smoothstep`, which changes slowly at both ends;
# and `ramp(0.5, 1)`, which waits and then hurries. They start and end alike, as every f must.

# %%
from matplotlib.figure import Figure

alphas = np.linspace(0, 1, 101)
pad = evolve.theta_names.index("geom/pad/size[0] [m]")
figure = Figure(figsize=(6, 3), layout="constrained")
axes = figure.subplots()
for f, style in (("linear", "-"), ("smoothstep", "--"), (rvl.ramp(0.5, 1), ":")):
    other = rvl.Evolution(GRIPPER, HAND, f=f)
    label = f if isinstance(f, str) else "ramp(0.5, 1)"
    axes.plot(alphas, [other.theta(a)[pad] for a in alphas], style, linewidth=2, label=label)
axes.set(xlabel="alpha", ylabel="radius of the pad [m]")
axes.legend()
words = "Radius of the pad over alpha, from 0.03 m to 0.05 m: a straight line for linear, an S for "
words += "smoothstep; for ramp(0.5, 1) flat until the middle, then straight and twice as steep."
rvl.lab.Drawing(figure=figure, alt=words)

# %% [markdown]
# Every parameter may have an f of its own. In the strip below the little finger grows on the
# first half of the way, and the rest of the hand on the second.

# %%
early, late = rvl.ramp(0, 0.5), rvl.ramp(0.5, 1)
staged = rvl.Evolution(GRIPPER, HAND, f={"*/little/*": early, "*": late}, name="little-first")
strip = rvl.lab.strip(staged, width=170, height=160)
rvl.lab.picture(
    strip,
    "Film strip, alpha 0 to 1. Until the middle only the little finger grows; after it the thumb "
    "leans over and the fingertip grows.",
)

# %% [markdown]
# ### Exercise 3: an f of your own
#
# Write an f that rests at 0 until α = 1/2 and then rises to 1 without a jump and without a
# corner. When the check is content, pass it to `rvl.Evolution(GRIPPER, HAND, f=rest_then_rise)` and
# explore that.

# %%
rest_then_rise = ...  # for example: lambda alpha: alpha**2 * (3 - 2 * alpha)
checks.three(rest_then_rise)

# %% [markdown]
# ## The number that must hold
#
# The claim was a straight line. The cell compiles 101 robots, reads the pad's radius [m] and the
# thumb's angle [rad] back from each, and prints how far the furthest is from
# (1 − α) θ<sub>S</sub> + α θ<sub>T</sub>.

# %%
models = [evolve.model(alpha) for alpha in alphas]
radius = np.array([model.geom("pad").size[0] for model in models])
quat = np.array([model.body("thumb").quat for model in models])
angle = 2 * np.arctan2(quat[:, 2], quat[:, 0])

from_radius = np.abs(radius - ((1 - alphas) * 0.03 + alphas * 0.05)).max()
from_angle = np.abs(angle - alphas * np.deg2rad(-60)).max()
print(f"furthest from the line: {max(from_radius, from_angle):.1e}")
assert max(from_radius, from_angle) < 1e-12

# %% [markdown]
# What is left is rounding. Every α is a robot, and near alphas are near robots: a policy can
# take the way in steps as small as it needs.
#
# **Go on:** give the hand a fourth finger and look at the matching again; or say yourself what
# becomes what, with `rvl.Evolution(GRIPPER, HAND, pins={"thumb": "little"})`, and see which
# limb is created now.
