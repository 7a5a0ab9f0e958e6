"""Small robots as MJCF text, for tests that need two that differ in one known way."""

FEATURES = """
<mujoco model="features">
  <compiler angle="{angle}" eulerseq="zyx"/>
  <option timestep="{timestep}" density="1.2" viscosity="0.01"/>
  <default>
    <geom friction="{friction} .01 .001"/>
    <default class="soft"><joint damping="{damping}"/></default>
  </default>
  <worldbody>
    <light name="sun" pos="0 0 3" dir="0 0 -1"/>
    <camera name="side" pos="0 -3 1" xyaxes="1 0 0 0 0.3 1"/>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="trunk" pos="0 0 {height}" euler="{tilt} 0 10">
      <freejoint name="root"/>
      <geom name="shell" type="box" size="{size} .1 .05" density="500"/>
      <frame name="mount" pos="{size} 0 0" euler="0 {tilt} 0">
        <frame name="inner" pos="0 0 .02" axisangle="0 0 1 30">
          <site name="tip" pos=".01 0 0" size=".01"/>
          <body name="thigh" pos="0 .02 0" childclass="soft">
            <joint name="hip" axis="0 1 {axis}" range="-30 {upper}" ref="5" springref="3"
                   stiffness="2"/>
            <geom name="bone" type="capsule" fromto="0 0 0 0 {lean} -{length}" size=".03"/>
            <body name="foot" pos="0 0 -{length}">
              <inertial pos="0 0 -.02" mass="{mass}" fullinertia=".002 .002 .001 .0001 0 0"/>
              <joint name="ankle" type="slide" axis="0 0 1" range="-.05 .05"/>
              <geom name="pad" type="ellipsoid" size=".05 .03 .02" pos="0 0 -.02"/>
            </body>
          </body>
        </frame>
      </frame>
    </body>
  </worldbody>
  <tendon>
    <fixed name="link" stiffness="{spring}">
      <joint joint="hip" coef="1"/><joint joint="ankle" coef="{spring}"/>
    </fixed>
  </tendon>
  <actuator>
    <position name="servo" joint="hip" kp="{gain}" ctrlrange="-1 1"/>
    <motor name="push" joint="ankle" gear="{gain}" ctrlrange="-1 1" forcerange="-{gain} {gain}"/>
  </actuator>
  <keyframe><key name="stand" qpos="0 0 {height} 1 0 0 0 0 0"/></keyframe>
</mujoco>
"""

SOURCE = dict(
    angle="degree", timestep=0.005, friction=0.8, damping=0.5, height=0.9, tilt=20, size=0.2,
    axis=0, upper=60, lean=0.0, length=0.4, mass=0.5, spring=1.0, gain=10.0,
)  # fmt: skip
TARGET = SOURCE | dict(
    timestep=0.0025, friction=1.2, damping=0.1, height=1.3, tilt=35, size=0.3, axis=0.5,
    upper=90, lean=0.1, length=0.7, mass=1.5, spring=2.5, gain=30.0,
)  # fmt: skip


def features(**changes: object) -> str:
    """A floating robot that uses every way MJCF has to place a thing; see SOURCE for the slots."""
    return FEATURES.format(**(SOURCE | changes))


def mid(alpha: float, source: dict = SOURCE, target: dict = TARGET) -> dict:
    """The slots of the robot between, where a slot is a number."""
    return {
        key: (1 - alpha) * value + alpha * target[key] if not isinstance(value, str) else value
        for key, value in source.items()
    }


def pendulum(*, length: float = 1.0, radius: float = 0.05, body: str = "", extra: str = "") -> str:
    """One hinge and one rod."""
    return f"""<mujoco model="pendulum"><worldbody>
      <body name="pole" pos="0 0 2"><joint name="hinge" axis="0 1 0" damping=".1"/>
        <geom name="rod" type="capsule" fromto="0 0 0 0 0 -{length}" size="{radius}"/>{body}
      </body></worldbody>
      <actuator><motor name="motor" joint="hinge" gear="5" ctrlrange="-1 1"/></actuator>{extra}
    </mujoco>"""
