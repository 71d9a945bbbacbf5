"""A Bullet world with a few robots of one structure, kept for reuse.

Robots stand in the same place and touch the floor alone, so that a robot's numbers do not depend on its place in the
world. There are no Bullet joint limits: the order in which Bullet solves them depends on how many robots there are, and
with it the last bits; stops are part of the drive path. Masses and friction of each robot, and gravity, are patched
between uses; anything else needs another world.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pybullet as p

from ee_dist.engines.loop import gravity_vector
from ee_dist.robots.model import Part, Robot
from ee_dist.trials.log import State

FLOOR_GROUP, ROBOT_GROUP = 1, 2
SOLVER_ITERATIONS = 10
"""A fixed number: stopping at a residual would let the robots of a world decide each other's precision."""
NO_TOP_SPEED = 1e9
"""rad/s: a limit that no joint meets. Bullet's own is 100 rad/s, which a wheel or a rotor may pass."""

_JOINTS = {"hinge": p.JOINT_REVOLUTE, "slide": p.JOINT_PRISMATIC, "fixed": p.JOINT_FIXED}


def structure_key(robot: Robot) -> str:
    """What a world cannot change after it was built."""
    parts = tuple(replace(q, mass_kg=0.0, inertia_kg_m2=(0.0,) * 6, grip=1.0) for q in robot.present_parts)
    joints = tuple(replace(j, freedom=1.0) for j in robot.present_joints)
    drives = tuple((d.joint, d.rotor_inertia) for d in robot.drives)
    sensors = tuple((s.kind, s.target) for s in robot.sensors if s.kind == "touch")
    start = (robot.start_position_m, robot.start_rotation, robot.free_base, robot.time_step_s)
    # The principal axes of a part are fixed when it is built. Most parts' are those of their frame.
    oblique = {j.child for j in robot.present_joints if sum(map(bool, j.axis)) > 1}
    turned = [q for q in robot.present_parts if any(q.inertia_kg_m2[3:]) or q.name in oblique]
    turns = tuple(_principal(_with_rotor(robot, q))[1] for q in turned)
    return repr((parts, joints, drives, sensors, start, turns, robot.world.has_floor, robot.world.compliance_m_n))


class World:
    """``size`` robots of one structure. ``links[k]`` is Bullet's link of motor k, or -1 where the joint is lost."""

    def __init__(self, robot: Robot, size: int) -> None:
        self.size = size
        self.structure = structure_key(robot)
        self.client = p.connect(p.DIRECT)
        if self.client < 0:
            raise RuntimeError("pybullet: no further physics client can be opened")
        self._patched: list[tuple[object, ...]] = [()] * size
        c = self.client
        p.setPhysicsEngineParameter(
            fixedTimeStep=robot.time_step_s,
            numSolverIterations=SOLVER_ITERATIONS,
            solverResidualThreshold=0,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,
            physicsClientId=c,
        )
        self.floor = -1
        if robot.world.has_floor:
            plane = p.createCollisionShape(p.GEOM_PLANE, physicsClientId=c)
            self.floor = p.createMultiBody(0, plane, physicsClientId=c)
            p.setCollisionFilterGroupMask(self.floor, -1, FLOOR_GROUP, ROBOT_GROUP, physicsClientId=c)
            p.changeDynamics(self.floor, -1, lateralFriction=1.0, physicsClientId=c)
        joints = {j.child: j for j in robot.present_joints}
        self.order = _depth_first(robot)
        link = {name: i for i, name in enumerate(self.order)}
        link[robot.root.name] = -1
        self.link_of_part = link
        by_name = {j.name: link[j.child] for j in robot.present_joints}
        self.links = [by_name.get(d.joint, -1) for d in robot.drives]
        slides = {j.name for j in robot.present_joints if j.kind == "slide"}
        self.slid_rotors = [
            (by_name[d.joint], d.rotor_inertia) for d in robot.drives if d.joint in slides and d.rotor_inertia > 0
        ]
        """Link and kg of each rotor that a slide moves: inertia, and no weight."""
        self.joint_links = [(j, link[j.child]) for j in robot.present_joints if j.kind != "fixed"]
        movable = [k for k in sorted(link.values()) if k >= 0 and joints[self.order[k]].kind != "fixed"]
        self.freedoms = len(movable)
        """Joints that can move, in Bullet's order."""
        self.joint_places = [movable.index(k) if k >= 0 else -1 for k in self.links]
        """Place of motor k's joint among them."""
        self.touch_links = [link.get(s.target, -2) for s in robot.sensors if s.kind == "touch"]
        self.frames = {q.name: _principal(_with_rotor(robot, q)) for q in robot.present_parts}
        self.bodies = [self._add(robot, link) for _ in range(size)]
        # Contacts must exist in the saved state: restoring one without any leaves stale ones behind.
        p.performCollisionDetection(physicsClientId=c)
        self.start = p.saveState(physicsClientId=c)

    def _add(self, robot: Robot, link: dict[str, int]) -> int:
        c = self.client
        root = robot.root
        parts = [robot.part(name) for name in self.order]
        joints = [robot.joint_of(name) for name in self.order]
        frames = [self.frames[q.name] for q in parts]
        body = p.createMultiBody(
            root.mass_kg if robot.free_base else 0.0,
            self._shape(root),
            -1,
            robot.start_position_m,
            robot.start_rotation,
            baseInertialFramePosition=root.com_m,
            baseInertialFrameOrientation=self.frames[root.name][1],
            linkMasses=[_with_rotor(robot, q).mass_kg for q in parts],
            linkCollisionShapeIndices=[self._shape(q) for q in parts],
            linkVisualShapeIndices=[-1] * len(parts),
            linkPositions=[j.position_m for j in joints],
            linkOrientations=[j.rotation for j in joints],
            linkInertialFramePositions=[q.com_m for q in parts],
            linkInertialFrameOrientations=[f[1] for f in frames],
            linkParentIndices=[link[j.parent] + 1 for j in joints],
            linkJointTypes=[_JOINTS[j.kind] for j in joints],
            linkJointAxis=[j.axis for j in joints],
            physicsClientId=c,
        )
        mask = FLOOR_GROUP if robot.world.has_floor else 0
        for k in range(-1, len(parts)):
            p.setCollisionFilterGroupMask(body, k, ROBOT_GROUP, mask, physicsClientId=c)
            p.changeDynamics(
                body, k, linearDamping=0, angularDamping=0, jointDamping=0, restitution=0, physicsClientId=c
            )
            if robot.world.compliance_m_n > 0:
                stiffness = 1 / robot.world.compliance_m_n
                p.changeDynamics(
                    body, k, contactStiffness=stiffness, contactDamping=0.02 * stiffness, physicsClientId=c
                )
        if any(math.isinf(replace(joint, freedom=1.0).ends[1]) for joint, _ in self.joint_links):
            # It is one number for all joints of a robot. Where all have stops it stays: any other could change a last bit.
            p.changeDynamics(body, -1, maxJointVelocity=NO_TOP_SPEED, physicsClientId=c)
        driven = set(robot.motor_names)
        for joint, k in self.joint_links:
            # Bullet's own motors are off: torques are ours.
            p.setJointMotorControl2(body, k, p.VELOCITY_CONTROL, force=0, physicsClientId=c)
            if joint.start and joint.name not in driven:
                p.resetJointState(body, k, joint.start, physicsClientId=c)
        return body

    def _shape(self, part: Part) -> int:
        if not part.shapes:
            return -1
        kinds, radii, extents, lengths, positions, turns = [], [], [], [], [], []
        for s in part.shapes:
            kinds.append(
                {"box": p.GEOM_BOX, "sphere": p.GEOM_SPHERE, "capsule": p.GEOM_CAPSULE}.get(s.kind, p.GEOM_CYLINDER)
            )
            radii.append(0.0 if s.kind == "box" else s.size[0])
            extents.append(s.size if s.kind == "box" else (0.0, 0.0, 0.0))
            lengths.append(s.size[1] if len(s.size) == 2 else 0.0)
            positions.append(s.position_m)
            turns.append(s.rotation)
        return p.createCollisionShapeArray(
            shapeTypes=kinds,
            radii=radii,
            halfExtents=extents,
            lengths=lengths,
            collisionFramePositions=positions,
            collisionFrameOrientations=turns,
            physicsClientId=self.client,
        )

    # -- use ---------------------------------------------------------------------------------------------------------

    def prepare(self, robots: Sequence[Robot], starts: Sequence[State | None]) -> None:
        """Stand a robot in each place, at its start. All share this world's structure and one gravity."""
        c = self.client
        p.restoreState(self.start, physicsClientId=c)
        p.setGravity(*gravity_vector(robots[0]), physicsClientId=c)
        for k, (robot, start) in enumerate(zip(robots, starts, strict=True)):
            masses = tuple((q.mass_kg, q.inertia_kg_m2, q.grip) for q in robot.present_parts)
            patch = (masses, robot.world.friction)
            if patch != self._patched[k]:
                self._apply(self.bodies[k], robot)
                self._patched[k] = patch
            if start is not None:
                self._place(self.bodies[k], robot, start)

    def _apply(self, body: int, robot: Robot) -> None:
        for part in robot.present_parts:
            k = self.link_of_part[part.name]
            grown = _with_rotor(robot, part)
            diagonal, turn = _principal(grown)
            if not np.allclose(turn, self.frames[part.name][1]):
                raise RuntimeError(f"pybullet: the principal axes of {part.name} changed in place")
            p.changeDynamics(
                body,
                k,
                mass=grown.mass_kg if k >= 0 or robot.free_base else 0.0,
                localInertiaDiagonal=diagonal,
                lateralFriction=robot.world.friction * part.grip,
                physicsClientId=self.client,
            )

    def _place(self, body: int, robot: Robot, start: State) -> None:
        c = self.client
        self.put(body, start)
        if start.base_pose is not None and robot.free_base:
            turn = [float(v) for v in start.base_pose[3:]]
            position = [float(v) for v in start.base_pose[:3]]
            com, orientation = p.multiplyTransforms(position, turn, robot.root.com_m, self.frames[robot.root.name][1])
            p.resetBasePositionAndOrientation(body, com, orientation, physicsClientId=c)
            if start.base_twist is not None:
                twist = [float(v) for v in start.base_twist]
                p.resetBaseVelocity(body, twist[:3], twist[3:], physicsClientId=c)

    def put(self, body: int, state: State) -> None:
        """Joint positions and speeds of one robot, from here on."""
        for k, link in enumerate(self.links):
            if link >= 0:
                joint, speed = float(state.joints[k]), float(state.speeds[k])
                p.resetJointState(body, link, joint, speed, physicsClientId=self.client)

    def close(self) -> None:
        p.disconnect(self.client)


def _depth_first(robot: Robot) -> list[str]:
    """Names of the carried parts in the order in which Bullet numbers links, whatever the order in which they are given."""
    carried = {j.child: j.parent for j in robot.present_joints}
    order: list[str] = []
    waiting = [robot.root.name]
    while waiting:
        name = waiting.pop()
        order.append(name)
        waiting += [q.name for q in reversed(robot.present_parts) if carried.get(q.name) == name]
    return order[1:]


def _with_rotor(robot: Robot, part: Part) -> Part:
    """Bullet knows no rotor inertia: it is given to the part that the joint moves, about the joint's axis.

    Unlike a true rotor's, it also resists when the parent moves. For a slide it adds to the mass, whose weight is taken off again
    (``slid_rotors``).
    """
    for joint in robot.joints:
        if joint.child != part.name:
            continue
        for drive in robot.drives:
            if drive.joint == joint.name and drive.rotor_inertia > 0:
                if joint.kind == "slide":
                    return replace(part, mass_kg=part.mass_kg + drive.rotor_inertia)
                x, y, z = joint.axis
                add = np.array([x * x, y * y, z * z, x * y, x * z, y * z]) * drive.rotor_inertia
                grown = np.array(part.inertia_kg_m2) + add
                xx, yy, zz, xy, xz, yz = (float(v) for v in grown)
                return replace(part, inertia_kg_m2=(xx, yy, zz, xy, xz, yz))
    return part


def _principal(part: Part) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Principal moments and the quaternion of their axes."""
    xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
    if xy == 0 and xz == 0 and yz == 0:
        return (xx, yy, zz), (0.0, 0.0, 0.0, 1.0)
    values, axes = np.linalg.eigh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return tuple(float(v) for v in values), _quaternion(axes)


def _quaternion(m: np.ndarray) -> tuple[float, ...]:
    """Of a rotation matrix, scalar last, by the largest component."""
    k = np.array([[m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0], [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
                  [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], 0],
                  [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]]) / 3  # fmt: skip
    q = np.linalg.eigh(k)[1][:, -1]
    return tuple(float(v) for v in (q if q[3] >= 0 else -q))
