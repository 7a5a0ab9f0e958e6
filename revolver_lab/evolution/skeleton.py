"""A robot's kinematic tree as the matching sees it: bodies, joints, and what drives them."""

import mujoco

from revolver_lab.evolution.nodes import Link, Node, Tree

_FREE = mujoco.mjtJoint.mjJNT_FREE
_TYPES = {
    mujoco.mjtJoint.mjJNT_HINGE: "hinge",
    mujoco.mjtJoint.mjJNT_SLIDE: "slide",
    mujoco.mjtJoint.mjJNT_BALL: "ball",
}
_ON_JOINTS = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
_ON_SITES = (mujoco.mjtTrn.mjTRN_SITE, mujoco.mjtTrn.mjTRN_SLIDERCRANK)


class Skeleton:
    """The tree of one robot, with its names.

    Args:
        spec: A robot in which everything has a name; it is left as it was.

    Attributes:
        spec: The robot.
        tree: Its tree.
        bodies: Index in the tree of each body by name, without the world.
        joints: (owner, index) of each joint by name, without free joints.
    """

    def __init__(self, spec: mujoco.MjSpec):
        self.spec = spec
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        names = [body.name for body in spec.bodies]
        index = {name: i for i, name in enumerate(names)}
        parents = [index[b.parent.name] if b.parent is not None else -1 for b in spec.bodies]
        on_joints, on_bodies = _drives(spec)
        nodes = [
            Node(
                name=body.name,
                joints=_links(body, data, on_joints),
                drives=tuple(on_bodies.get(body.name, ())),
                place=tuple(data.body(body.name).xpos) if i else (0.0, 0.0, 0.0),
                mocap=bool(body.mocap),
            )
            for i, body in enumerate(spec.bodies)
        ]
        free = frozenset(
            i for i, b in enumerate(spec.bodies) if any(j.type == _FREE for j in b.joints)
        )
        self.tree = Tree(tuple(nodes), tuple(parents), free)
        self.bodies = {name: i for name, i in index.items() if i}
        self.joints = {
            link.name: (i, k) for i, node in enumerate(nodes) for k, link in enumerate(node.joints)
        }

    def free_joint(self, body: int) -> str:
        """Name of the free joint of the tree that a body belongs to."""
        while body not in self.tree.free:
            body = self.tree.parents[body]
        root = self.spec.body(self.tree.nodes[body].name)
        return next(joint.name for joint in root.joints if joint.type == _FREE)

    def depth(self) -> int:
        """Bodies on the longest path down from the world."""
        return max((depth + 1 for _, _, depth in self.levels()), default=0)

    def levels(self) -> tuple[tuple[str, str, int], ...]:
        """(name, parent's name, depth) of every body, parents before children, for drawings."""
        tree, found = self.tree, []
        waiting = [(body, 0) for body in reversed(self._children(0))]
        while waiting:
            body, depth = waiting.pop()
            found.append((tree.nodes[body].name, tree.nodes[tree.parents[body]].name, depth))
            waiting += [(child, depth + 1) for child in reversed(self._children(body))]
        return tuple(found)

    def _children(self, body: int) -> list[int]:
        """The bodies that hang from a body in the file."""
        return [i for i, parent in enumerate(self.tree.parents) if parent == body]


def _links(
    body: mujoco.MjsBody, data: mujoco.MjData, drives: dict[str, list[str]]
) -> tuple[Link, ...]:
    """The joints above a body, without a free joint."""
    return tuple(
        Link(
            name=joint.name,
            type=_TYPES[joint.type],
            drives=tuple(drives.get(joint.name, ())),
            axis=tuple(data.joint(joint.name).xaxis),
        )
        for joint in body.joints
        if joint.type != _FREE
    )


def _drives(spec: mujoco.MjSpec) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Labels of the actuators on each joint and on each body (with its sites)."""
    site_body = {site.name: site.parent.name for site in spec.sites}
    on_joints: dict[str, list[str]] = {}
    on_bodies: dict[str, list[str]] = {}
    for actuator in spec.actuators:
        label = str(actuator.trntype)
        if actuator.trntype in _ON_JOINTS:
            on_joints.setdefault(actuator.target, []).append(label)
        elif actuator.trntype in _ON_SITES:
            on_bodies.setdefault(site_body.get(actuator.target, ""), []).append(label)
        elif actuator.trntype == mujoco.mjtTrn.mjTRN_BODY:
            on_bodies.setdefault(actuator.target, []).append(label)
    return on_joints, on_bodies
