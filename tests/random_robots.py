"""Random floating robots as MJCF, for tests that hold for any robot."""

import numpy as np

FLOOR = "<geom name='floor' type='plane' size='5 5 .1'/>"


def random_robot(rng, bodies, *, balls=False, floor=False):
    """A floating tree with up to two joints a body, offsets, turned frames and references."""
    children = {i: [] for i in range(bodies)}
    for i in range(1, bodies):
        children[int(rng.integers(0, i))].append(i)

    def numbers(*values):
        return " ".join(f"{v:.4f}" for v in np.ravel(values))

    motors = []

    def joint(i, k):
        # MuJoCo has no rotation after a ball: a ball stands alone, so that it can be turned round.
        kind = "ball" if balls and i % 2 and k == 0 else rng.choice(["hinge", "slide"])
        name = f"j{i}{k}"
        damping = f"damping='.2' armature='{rng.uniform(0.005, 0.02):.4f}'"
        place = f"pos='{numbers(rng.uniform(-0.1, 0.1, 3))}'"
        if kind == "ball":
            return f"<joint name='{name}' type='ball' {damping} {place} stiffness='1'/>"
        motors.append(f"<motor name='m{name}' joint='{name}' gear='{rng.uniform(-2, 2):.2f}'/>")
        limits = "range='-.4 .5' limited='true'" if kind == "slide" else "range='-100 90'"
        ref = f"ref='{rng.uniform(-0.1, 0.1) if kind == 'slide' else rng.uniform(-40, 40):.3f}'"
        axis = numbers(rng.normal(size=3))
        more = f"axis='{axis}' {limits} {ref} stiffness='3' springref='.1'"
        return f"<joint name='{name}' type='{kind}' {damping} {place} {more}/>"

    def body(i):
        pos = [0, 0, 0.8] if i == 0 else rng.uniform(-0.4, 0.4, 3)
        turn = numbers(rng.uniform(-60, 60, 3))
        count = 2 if rng.random() < 0.4 and not (balls and i % 2) else 1
        joints = "".join(joint(i, k) for k in range(count)) if i else "<freejoint name='f'/>"
        ends = numbers(rng.uniform(-0.15, 0.15, 6))
        geom = (
            f"<geom name='g{i}' type='capsule' fromto='{ends}' size='.05' contype='{int(floor)}'/>"
        )
        below = "".join(body(c) for c in children[i])
        return (
            f"<body name='b{i}' pos='{numbers(pos)}' euler='{turn}'>"
            f"{joints}{geom}<site name='s{i}' pos='.1 0 .05'/>{below}</body>"
        )

    tree = body(0)
    gravity = "0 0 -9.81" if floor else "0 0 0"
    return (
        f"<mujoco><option timestep='.002' gravity='{gravity}' cone='elliptic' tolerance='0'"
        " iterations='300' ls_iterations='100'/>"
        f"<worldbody>{FLOOR if floor else ''}{tree}</worldbody>"
        f"<actuator>{''.join(motors)}</actuator>"
        "<sensor><subtreecom name='com' body='b0'/></sensor></mujoco>"
    )
