"""Adds to one robot, at zero size, everything that only the other one has."""

from collections.abc import Callable

import mujoco
import numpy as np

from revolver_lab.evolution import copying, inertias, shrinking
from revolver_lab.evolution.assets import copy_asset
from revolver_lab.evolution.contacts import excuse_contacts
from revolver_lab.evolution.keyframes import extend_keyframes
from revolver_lab.evolution.naming import free_name
from revolver_lab.evolution.ties import pulls

Twins = dict[str, dict[str, str]]
_BALL = mujoco.mjtJoint.mjJNT_BALL


class Grower:
    """Grows one robot, the host, by what another one, the donor, has alone.

    Args:
        host: A robot in canonical form; it is changed in place.
        donor: The other one, in canonical form; it is left as it was.
        twins: For each kind of element, the host's name of each donor's that corresponds.

    Attributes:
        twins: The same, completed by what was created.
    """

    def __init__(self, host: mujoco.MjSpec, donor: mujoco.MjSpec, twins: Twins):
        self.host, self.donor = host, donor
        self.twins = {kind: dict(names) for kind, names in twins.items()}
        self._matched = set(self.twins["body"]) | {"world"}
        self.twins["body"]["world"] = "world"
        self.twins["camera"] = {camera.name: camera.name for camera in host.cameras}
        self._model = donor.compile()
        self._before = host.compile()
        self._geoms: list[str] = []
        self.held: list[str] = []

    def grow(self) -> Twins:
        """Add everything, in an order in which what is referred to is there first."""
        self._state_inertias()
        for body in self.donor.bodies[1:]:
            self._add_body(body)
        for body in self.donor.bodies:
            self._add_joints(body)
            self._add_shapes(body)
        self._add_rest()
        inertias.stay_massless(self.host, self._before, self._geoms)
        self._hold()
        excuse_contacts(self.host, self._before, self._model, self._geoms)
        return self.twins

    def _rename(self, kind: str, name: str) -> str | None:
        """The host's name of what the donor calls so; assets are brought along."""
        known = self.twins.setdefault(kind, {})
        if name not in known and kind in ("material", "hfield", "texture"):
            self._copy_asset(kind, name)
        return known.get(name)

    def _new_name(self, kind: str, plural: str, name: str) -> str:
        """A name for a created element that the host does not use yet."""
        taken = {element.name for element in getattr(self.host, plural)}
        taken |= set(self.twins.get(kind, {}).values())
        here = free_name(name, taken)
        self.twins.setdefault(kind, {})[name] = here
        return here

    def _copy_asset(self, kind: str, name: str) -> None:
        """Copy a material, with its textures, or a height field."""
        plural = {"material": "materials", "hfield": "hfields", "texture": "textures"}[kind]
        donor = next((e for e in getattr(self.donor, plural) if e.name == name), None)
        if donor is None:
            return
        here = self._new_name(kind, plural, name)
        copy = copy_asset(self.host, self.donor, self._model, kind, donor, here)
        if kind == "material":
            textures = [self._rename("texture", t) if t else "" for t in donor.textures]
            copy.textures = [t or "" for t in textures]

    def _state_inertias(self) -> None:
        """Write the host's inertias down where its compiler would also touch created bodies."""
        compiler = self.host.compiler
        from_geoms = compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
        bounds = compiler.boundmass > 0 or compiler.boundinertia > 0 or compiler.settotalmass > 0
        grows = len(self.donor.bodies) > len(self._matched)
        if not (grows and (from_geoms or bounds)):
            return
        for body in self.host.bodies[1:]:
            inertias.state_inertia(body, self._before)
        inertias.stop_inferring(compiler)

    def _add_body(self, body: mujoco.MjsBody) -> None:
        """Add one body, unless it has a twin."""
        if body.name in self._matched:
            return
        parent = self.host.body(self.twins["body"][body.parent.name])
        copy = copying.add_body(parent, body, self._new_name("body", "bodies", body.name))
        inner = body.parent.name not in self._matched
        medium = self.host.option.density > 0 or self.host.option.viscosity > 0
        shrinking.shrink_body(copy, self._model, body.name, inner=inner, medium=medium)

    def _add_joints(self, body: mujoco.MjsBody) -> None:
        """Add the joints of one body that have no twin, each after the twin of the one before."""
        twins = self.twins["joint"]
        if all(joint.name in twins for joint in body.joints):
            return
        here = self.host.body(self.twins["body"][body.name])
        if body.name not in self._matched:
            for joint in body.joints:
                copy = self._copy_joint(here, joint)
                shrinking.shrink_joint(copy, self._model, joint.name, self.host.option)
            return
        order = self._merged_order(body, here)
        for joint, ours in order:
            if not ours:
                self._new_name("joint", "joints", joint)
        backup = self.host.copy()  # kept as long as its joints are read: they do not keep it
        originals = {joint.name: joint for joint in backup.body(here.name).joints}
        for joint in list(here.joints):
            self.host.delete(joint)
        for joint, ours in order:
            if ours:
                copying.add_to_body(here, "joint", originals[joint], joint, lambda _, n: n)
            else:
                donor = next(j for j in body.joints if j.name == joint)
                self.held.append(self._copy_joint(here, donor).name)

    def _merged_order(self, body: mujoco.MjsBody, here: mujoco.MjsBody) -> list[tuple[str, bool]]:
        """The host's joints and the donor's own in one order: (name, whether it is the host's)."""
        order = [(joint.name, True) for joint in here.joints]
        place = 0
        for joint in body.joints:
            twin = self.twins["joint"].get(joint.name)
            if twin is None:
                order.insert(place, (joint.name, False))
                place += 1
            else:
                place = max(place, order.index((twin, True)) + 1)
        balls = {(joint.name, True) for joint in here.joints if joint.type == _BALL}
        balls |= {(joint.name, False) for joint in body.joints if joint.type == _BALL}
        return sorted(order, key=lambda entry: entry in balls)  # a ball has to come last

    def _copy_joint(self, here: mujoco.MjsBody, joint: mujoco.MjsJoint) -> mujoco.MjsJoint:
        """Add a copy of one joint at full size."""
        name = self.twins["joint"].get(joint.name)
        name = name or self._new_name("joint", "joints", joint.name)
        return copying.add_to_body(here, "joint", joint, name, self._rename)

    def _add_shapes(self, body: mujoco.MjsBody) -> None:
        """Add the geoms and sites of one body that have no twin; the scene's geoms stay out."""
        here = self.host.body(self.twins["body"][body.name])
        inner = body.name not in self._matched
        for geom in body.geoms:
            lone = geom.name not in self.twins["geom"] and body.name != "world"
            if lone and shrinking.can_shrink(geom):
                self._add_geom(here, geom, inner=inner)
        for site in body.sites:
            if site.name not in self.twins["site"]:
                name = self._new_name("site", "sites", site.name)
                copy = copying.add_to_body(here, "site", site, name, self._rename)
                shrinking.shrink_shape(copy, inner=inner and body.name != "world")

    def _add_geom(self, here: mujoco.MjsBody, geom: mujoco.MjsGeom, *, inner: bool) -> None:
        """Add one geom at zero size, with a mesh of its own if it has one."""
        if geom.meshname:
            mesh = next(m for m in self.donor.meshes if m.name == geom.meshname)
            name = self._new_name("mesh", "meshes", mesh.name)
            copy = copy_asset(self.host, self.donor, self._model, "mesh", mesh, name)
            sides = self._model.geom(geom.name).size
            shrinking.shrink_mesh(copy, self._model, mesh.name, float(8.0 * np.prod(sides)))
        name = self._new_name("geom", "geoms", geom.name)
        copy = copying.add_to_body(here, "geom", geom, name, self._rename)
        shrinking.shrink_shape(copy, inner=inner)
        self._geoms.append(name)

    def _add_rest(self) -> None:
        """Add tendons, actuators, constraints, contacts and sensors that have no twin."""
        for tendon in self._lone("tendon", "tendons"):
            name = self._new_name("tendon", "tendons", tendon.name)
            shrinking.shrink_tendon(copying.add_tendon(self.host, tendon, name, self._rename))
        for actuator in self._lone("actuator", "actuators"):
            name = self._new_name("actuator", "actuators", actuator.name)
            copy = copying.add_actuator(self.host, actuator, name, self._rename)
            shrinking.shrink_actuator(copy, self._model, actuator.name)
        for equality in self._lone("equality", "equalities"):
            name = self._new_name("equality", "equalities", equality.name)
            copy = copying.add_equality(self.host, equality, name, self._rename)
            apart = pulls(equality, self.donor, self._matched, self.twins, self._before)
            anchored = equality.name1 not in self._matched
            shrinking.shrink_equality(copy, anchored=anchored, apart=apart)
        self._add_contacts()
        for sensor in self._lone("sensor", "sensors"):
            name = free_name(sensor.name, {s.name for s in self.host.sensors})
            if copying.add_sensor(self.host, sensor, name, self._rename) is not None:
                self.twins.setdefault("sensor", {})[sensor.name] = name

    def _lone(self, kind: str, plural: str) -> list:
        """The donor's elements of one kind that have no twin."""
        known = self.twins.get(kind, {})
        return [element for element in getattr(self.donor, plural) if element.name not in known]

    def _add_contacts(self) -> None:
        """Add contact pairs and exclusions of created geoms and bodies, and of no others."""
        created: dict[str, Callable[[object], bool]] = {
            "pairs": lambda e: bool({e.geomname1, e.geomname2} & self._created("geom")),  # type: ignore
            "excludes": lambda e: bool({e.bodyname1, e.bodyname2} - self._matched),  # type: ignore
        }
        for plural, concerns in created.items():
            kind = plural.removesuffix("s")
            for contact in filter(concerns, self._lone(kind, plural)):
                name = self._new_name(kind, plural, contact.name)
                copying.add_contact(self.host, plural, contact, name, self._rename)

    def _created(self, kind: str) -> set[str]:
        """Names, in the donor, of created geoms."""
        ours = set(self._geoms)
        return {there for there, here in self.twins[kind].items() if here in ours}

    def _hold(self) -> None:
        """Hold the joints that were created where the host is welded."""
        for name in self.held:
            joint = self.host.joint(name)
            shrinking.spell_out_spring(joint, self._model, self._donor_name("joint", name))
            joint.armature = 0.0
            inertias.let_move(joint.parent, self._before)
        extend_keyframes(self.host, self._before)
        if not self.held:
            return
        model = self.host.compile()
        for name in self.held:
            dof = model.joint(name).dofadr[0]
            inertia = max(float(model.dof_M0[dof]), 1e-6)
            shrinking.hold_joint(self.host.joint(name), inertia, model.opt.timestep)

    def _donor_name(self, kind: str, name: str) -> str:
        """The donor's name of what the host calls so."""
        return next(there for there, here in self.twins[kind].items() if here == name)
