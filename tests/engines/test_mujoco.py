"""What is MuJoCo's own: how a robot becomes numbers in a compiled model, threads, contact, robots that blow up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from engine_robots import BOX_HALF_M, RADIUS_M, at, ball, calm_commands, loose_drive, mixed_models, network, run, sled

from ee_dist.engines.contract import EngineError, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.bodies import Group
from ee_dist.engines.mujoco.contact import IMPEDANCE, contact
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.mujoco.model import NOTHING_TO_TOUCH, UNUSED, Model, of_length_one, structure_key
from ee_dist.robots.mass_matrix import mass_matrix
from ee_dist.robots.model import Joint, Part, Robot, Shape
from ee_dist.robots.quadruped import quadruped

EXTRA = (
    quadruped().with_joint("hip_rear_left", kind="slide"),
    quadruped().with_joint("knee_rear_right", kind="fixed"),
    replace(quadruped(), free_base=False),
)


@pytest.mark.parametrize("robot", [*mixed_models(), *EXTRA], ids=range(len(mixed_models()) + len(EXTRA)))
def test_a_filled_model_has_the_mass_matrix_of_the_robot(robot: Robot) -> None:
    model = Model(robot)
    model.fill(model.numbers(robot))
    m, data = model.compiled, mujoco.MjData(model.compiled)
    mujoco.mj_forward(m, data)
    matrix = np.zeros((m.nv, m.nv))
    mujoco.mj_fullM(m, data, matrix)
    expected = mass_matrix(robot)
    # MuJoCo orders joints by tree, the formula by the list of the robot's joints.
    free = 6 if robot.free_base else 0
    moving = [j for j in robot.present_joints if j.kind != "fixed"]
    order = list(range(free)) + [int(m.joint(j.name).dofadr[0]) for j in moving]
    assert matrix[np.ix_(order, order)] == pytest.approx(expected, abs=1e-12)


def test_a_filled_model_remembers_nothing_of_the_robot_before() -> None:
    heavy, light = quadruped().with_part("body", mass_kg=5.0), quadruped().with_world(tilt_x_rad=0.2)
    assert structure_key(heavy) == structure_key(light)
    used, fresh = Model(heavy), Model(light)
    used.fill(used.numbers(heavy))
    for model in (used, fresh):
        model.fill(model.numbers(light))
    names = [n for n in dir(fresh.compiled) if isinstance(getattr(fresh.compiled, n, None), np.ndarray)]
    assert len(names) > 100
    for name in names:
        a, b = getattr(used.compiled, name), getattr(fresh.compiled, name)
        assert a.tobytes() == b.tobytes(), name
    assert used.compiled.opt.gravity.tobytes() == fresh.compiled.opt.gravity.tobytes()


def bent(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with every joint elsewhere, turned, and about another axis, and the base turned where it is bolted."""
    joints = tuple(
        replace(
            j,
            position_m=tuple(np.array(j.position_m) + rng.normal(size=3) / 50),
            rotation=tuple(quaternion(rng)),
            axis=tuple(np.round(unit(rng.normal(size=3)), 6)),
        )
        for j in robot.joints
    )
    start = robot.start_rotation if robot.free_base else tuple(quaternion(rng))
    return replace(robot, joints=joints, start_rotation=start)


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def quaternion(rng: np.random.Generator) -> np.ndarray:
    return np.round(unit(np.array([*(0.2 * rng.normal(size=3)), 1.0])), 7)


@pytest.mark.parametrize("free_base", [True, False])
def test_where_joints_are_and_how_they_turn_is_a_row_of_numbers(free_base: bool) -> None:
    """What the compiler would make of each robot by itself, to the last bit, though it is asked once."""
    rng = np.random.default_rng(0)
    robot = replace(quadruped().with_world(has_floor=free_base), free_base=free_base)
    robots = [bent(robot, rng) for _ in range(6)]
    assert len({structure_key(r) for r in robots}) == 1
    shared = Model(robots[0])
    for other in robots:
        own = Model(other)
        for model in (shared, own):
            model.fill(model.numbers(other))
        for name in ("body_pos", "body_quat", "jnt_axis", "body_invweight0", "dof_M0", "body_simple", "geom_pos"):
            assert getattr(shared.compiled, name).tobytes() == getattr(own.compiled, name).tobytes(), name
    together = MuJoCoEngine(1).rollout([Rollout(r, network(k), 60) for k, r in enumerate(robots)])
    for k, (r, log) in enumerate(zip(robots, together, strict=True)):
        (alone,) = MuJoCoEngine(1).rollout([Rollout(r, network(k), 60)])
        assert log.sensors.tobytes() == alone.sensors.tobytes()


def test_lengths_are_made_one_as_by_the_compiler() -> None:
    rng = np.random.default_rng(1)
    for k in range(300):
        turn, axis = rng.normal(size=4), rng.normal(size=3)
        if k % 3:
            turn, axis = (np.round(unit(v), 16 if k % 3 == 1 else 8) for v in (turn, axis))
        spec = mujoco.MjSpec()
        body = spec.worldbody.add_body(quat=turn)
        body.explicitinertial, body.mass, body.inertia = True, 1.0, [1.0, 1.0, 1.0]
        body.add_joint(type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        m = spec.compile()
        assert of_length_one(turn).tobytes() == m.body_quat[1].tobytes()
        assert of_length_one(axis).tobytes() == m.jnt_axis[0].tobytes()


def test_shapes_count_only_where_there_is_a_floor() -> None:
    bare = replace(quadruped(), parts=tuple(replace(p, shapes=()) for p in quadruped().parts))
    hung, bare_hung = (r.with_world(has_floor=False) for r in (quadruped(), bare))
    assert structure_key(quadruped()) != structure_key(bare)
    assert structure_key(hung) == structure_key(bare_hung)
    assert Model(hung).compiled.ngeom == 0


def test_only_structure_is_compiled_anew() -> None:
    engine = MuJoCoEngine(threads=1)
    models = [quadruped().with_part("body", mass_kg=1.0 + 0.1 * i).with_world(friction=0.1 * (i + 1)) for i in range(9)]
    logs = engine.rollout([Rollout(m, network(0), 50) for m in models])
    assert len(engine._models) == 1
    assert len({log.sensors.tobytes() for log in logs}) == len(models)
    engine.rollout([Rollout(quadruped().without("lower_rear_left"), network(0), 5)])
    assert len(engine._models) == 2
    engine.close()
    assert not engine._models


@pytest.mark.parametrize("fixed", [True, False])
def test_what_a_robot_without_a_floor_leaves_out_moves_no_bit(fixed: bool) -> None:
    robot = replace(quadruped().with_world(has_floor=False), free_base=not fixed)
    short, whole = Model(robot), Model(robot)
    for model in (short, whole):
        model.fill(model.numbers(robot))
    assert short.compiled.opt.disableflags & NOTHING_TO_TOUCH
    assert (short.compiled.opt.integrator == mujoco.mjtIntegrator.mjINT_EULER) is fixed
    whole.compiled.opt.disableflags = int(UNUSED)
    whole.compiled.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    rng, states = np.random.default_rng(3), [mujoco.MjData(m.compiled) for m in (short, whole)]
    for _ in range(300):
        torques = rng.normal(0, 0.3, short.compiled.nv)
        for model, data in zip((short, whole), states, strict=True):
            data.qfrc_applied[:] = torques - 0.05 * data.qvel
            mujoco.mj_step(model.compiled, data)
        assert states[0].qpos.tobytes() == states[1].qpos.tobytes()
    assert np.abs(states[0].qvel).max() > 0.5


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_change_no_bit(threads: int) -> None:
    rollouts = [Rollout(m, network(i), 200, pose=True) for i, m in enumerate(mixed_models() * 3)]
    one, many = MuJoCoEngine(threads=1), MuJoCoEngine(threads=threads, least=1)
    for a, b in zip(one.rollout(rollouts), many.rollout(rollouts), strict=True):
        assert a.sensors.tobytes() == b.sensors.tobytes()
        assert a.base_pose is not None
        assert b.base_pose is not None
        assert a.base_pose.tobytes() == b.base_pose.tobytes()


def test_threads_are_for_batches_that_are_worth_them() -> None:
    """They wait for one another in every step: of few robots one thread is faster, and much so beside another program."""
    engine = MuJoCoEngine(threads=4)
    assert [engine.threads_for(n) for n in (1, 25, 63, 64, 128, 1000)] == [1, 1, 1, 2, 4, 4]
    assert [MuJoCoEngine(threads=1).threads_for(n) for n in (1, 1000)] == [1, 1]


def test_a_rollout_is_what_mj_step_makes_of_its_torques() -> None:
    for robot in (quadruped(), quadruped().with_part("body", mass_kg=2.0).with_world(friction=0.4, tilt_x_rad=0.1)):
        (log,) = MuJoCoEngine(threads=1).rollout([Rollout(robot, network(4), 150, pose=True)])
        assert log.torques is not None
        assert log.joints is not None
        assert log.base_pose is not None
        group = Group(Model(robot), [Rollout(robot, network(4), 150)], threads=1)
        model = group.batch.get_model(0)
        data = mujoco.MjData(model)
        data.qpos[:] = group.positions[0]
        for row in range(150):
            assert data.qpos[7:].tobytes() == log.joints[row].tobytes()
            assert data.qpos[:3].tobytes() == log.base_pose[row, :3].tobytes()
            data.qfrc_applied[6:] = log.torques[row]
            mujoco.mj_step(model, data)


def test_a_robot_that_blows_up_says_so_and_harms_no_other(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    wild = quadruped()
    for drive in wild.drives:
        wild = wild.with_drive(drive.joint, kp=1e7, torque_limit=1e9, speed_limit=float("inf"), rotor_inertia=0.0)
    calm = Commands(calm_commands(0, 200))
    engine = MuJoCoEngine(threads=2, least=1)
    first, second, third = engine.rollout([Rollout(m, calm, 200, pose=True) for m in (quadruped(), wild, quadruped())])
    assert not second.finite
    assert first.finite
    assert first.sensors.tobytes() == third.sensors.tobytes()
    (alone,) = engine.rollout([Rollout(quadruped(), calm, 200, pose=True)])
    assert first.sensors.tobytes() == alone.sensors.tobytes()
    assert not list(tmp_path.iterdir()), "no log file in the user's folder"
    assert "WARNING" not in capfd.readouterr().err


def test_an_error_in_one_simulation_is_that_robots_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    from mujoco import batch as native

    step, calls = native.Batch.step, []

    def fail_once(self: native.Batch) -> None:
        step(self)
        calls.append(1)
        if len(calls) == 20:
            raise native.SimulationError(np.array([1]), "stack overflow")

    monkeypatch.setattr(native.Batch, "step", fail_once)
    logs = MuJoCoEngine(threads=1).rollout([Rollout(quadruped(), network(i), 50) for i in range(3)])
    assert [log.finite for log in logs] == [True, False, True]


def test_what_cannot_be_built_is_said_in_a_line() -> None:
    broken = replace(ball(), parts=(replace(ball().root, shapes=(Shape("sphere", (-1.0,)),)),))
    with pytest.raises(EngineError, match="mujoco cannot build 'ball'") as caught:
        run(MuJoCoEngine(1), broken, 2)
    assert "\n" not in str(caught.value)


def test_a_part_listed_before_the_one_that_carries_it_is_built_all_the_same() -> None:
    whole = quadruped()
    body, *others = whole.parts
    backwards = replace(whole, parts=(body, *others[::-1]))
    calm = calm_commands(1, 60)
    engine = MuJoCoEngine(1)
    assert run(engine, backwards, 60, commands=calm).sensors == pytest.approx(
        run(engine, whole, 60, commands=calm).sensors, abs=1e-6
    )


def test_shapes_lie_on_the_floor_by_their_own_size() -> None:
    lying = (0.0, np.sin(np.pi / 4), 0.0, np.cos(np.pi / 4))
    for shape, height in (
        (Shape("box", (0.1, 0.12, 0.05)), 0.05),
        (Shape("sphere", (0.07,)), 0.07),
        (Shape("capsule", (0.03, 0.2), (0.0, 0.0, 0.0), lying), 0.03),
        (Shape("cylinder", (0.08, 0.1)), 0.05),
        (Shape("capsule", (0.03, 0.2)), 0.13),
    ):
        part = replace(ball().root, shapes=(shape,))
        log = run(MuJoCoEngine(1), replace(ball(height_m=height + 0.002), parts=(part,)), 60)
        assert log.channel("height")[-1] == pytest.approx(height, abs=4e-4), shape
        assert log.channel("touch")[-1] == 1


def test_a_passenger_on_a_fixed_joint_counts_with_its_mass_and_its_touch() -> None:
    carrier = ball(height_m=0.3, gravity_m_s2=9.81)
    foot = Part("foot", 1.0, (0.0, 0.0, 0.0), (0.001, 0.001, 0.001, 0, 0, 0), (Shape("sphere", (0.05,)),))
    bond = Joint("bond", "fixed", "ball", "foot", (0.0, 0.0, -0.2), (0.0, 0.0, 1.0), 0.0, 0.0)
    both = replace(carrier, parts=(carrier.root, foot), joints=(bond,))
    on_foot = replace(both, sensors=(carrier.sensors[0], replace(carrier.sensors[1], target="foot")))
    assert run(MuJoCoEngine(1), both, 30).channel("touch").max() == -1
    landed = run(MuJoCoEngine(1), on_foot, 30)
    assert landed.channel("touch").max() == 1
    assert landed.channel("height")[20] == pytest.approx(0.25, abs=1e-3)


def test_the_rotation_of_a_start_need_not_be_of_unit_length() -> None:
    unit = run(MuJoCoEngine(1), ball(height_m=1.0), 5, at([], [], [0.0, 0.0, 1.0, 0.6, 0.0, 0.0, 0.8]))
    twice = run(MuJoCoEngine(1), ball(height_m=1.0), 5, at([], [], [0.0, 0.0, 1.0, 1.2, 0.0, 0.0, 1.6]))
    assert unit.base_pose is not None
    assert twice.base_pose is not None
    assert unit.base_pose == pytest.approx(twice.base_pose, abs=1e-12)
    assert unit.base_pose[0, 3:] == pytest.approx([0.6, 0.0, 0.0, 0.8], abs=1e-12)


# -- contact ---------------------------------------------------------------------------------------------------------


def test_a_slow_slide_does_not_hop() -> None:
    start = at([], [], [0.0, 0.0, BOX_HALF_M[2], 0.0, 0.0, 0.0, 1.0], [0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
    log = run(MuJoCoEngine(1), sled(friction=0.5), 60, start)
    assert np.abs(log.channel("height") - BOX_HALF_M[2]).max() < 5e-4
    assert (log.channel("touch")[2:] == 1).mean() > 0.9


def test_a_landing_does_not_bounce() -> None:
    height = run(MuJoCoEngine(1), ball(height_m=RADIUS_M + 0.2), 100).channel("height")
    landed = int(np.argmax(height < RADIUS_M))
    assert landed > 10
    assert height[landed:].max() < RADIUS_M + 5e-4
    assert height[-1] == pytest.approx(RADIUS_M, abs=1e-4)


def test_a_standing_robot_does_not_creep() -> None:
    tilted = quadruped().with_world(tilt_y_rad=0.1)
    pose = run(MuJoCoEngine(1), tilted, 1000).base_pose
    assert pose is not None
    assert abs(pose[-1, 0] - pose[300, 0]) < 5e-3


def test_contact_numbers_are_those_of_a_spring_taken_at_the_end_of_the_step() -> None:
    step, compliance, inverse_mass = 0.01, 1e-3, 0.7
    found = contact(step, np.array([compliance]), np.array([[inverse_mass]]))
    d = found.impedance[0, 0, 0]
    k, b = -found.normal[0, 0, 0] / d**2 * d, -found.normal[0, 0, 1] / d
    regular = (1 - d) / d * inverse_mass
    # MuJoCo: force = (-b v - k r - a) / regular. Wanted: force = -K (r + h v') - 0.02 K v', with v' = v + h a.
    stiffness = 1 / compliance
    assert k / regular == pytest.approx(stiffness)
    assert b / regular == pytest.approx(stiffness * (step + 0.02))
    assert 1 / regular == pytest.approx(stiffness * (step + 0.02) * step)
    hard = contact(step, np.array([0.0]), np.array([[inverse_mass]]))
    assert hard.impedance[0, 0, 0] == IMPEDANCE
    assert hard.ratio[0] < found.ratio[0]


def test_a_tumbling_body_gains_no_energy() -> None:
    # Spun about its middle axis a body tumbles; explicit steps of this size would tear it apart.
    lump = replace(ball().root, inertia_kg_m2=(0.004, 0.009, 0.012, 0, 0, 0))
    robot = replace(ball(gravity_m_s2=0.0, has_floor=False), parts=(lump,))
    start = at([], [], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.02, 20.0, 0.0])
    log = run(MuJoCoEngine(1), robot, 1500, start)
    assert log.base_pose is not None
    turn = log.base_pose[:, 3:]
    turned = 2 * np.arccos(np.clip(np.abs((turn[1:] * turn[:-1]).sum(axis=1)), -1, 1))
    # Twice the energy is at least the least moment times the speed squared.
    assert (0.004 * (turned / 0.01) ** 2).max() < 1.01 * 0.009 * 20.0**2
    assert np.ptp(turn[:, 0]) > 0.5, "it does tumble"


def test_robots_of_other_structure_share_no_model() -> None:
    shifted, deaf = ball(height_m=0.5, com_m=(0.05, 0.0, 0.02)), replace(ball(), sensors=ball().sensors[:1])
    skewed = replace(ball(), parts=(replace(ball().root, inertia_kg_m2=(0.008, 0.009, 0.01, 0.001, 0, 0)),))
    slow, hanging = replace(ball(), time_step_s=0.004), ball(height_m=0.2, has_floor=False)
    spinning = at([], [], [0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0], [0.2, 0.0, 0.0, 1.0, 2.0, 3.0])
    robots = [ball(), shifted, deaf, skewed, slow, hanging, ball()]
    used = MuJoCoEngine(1)
    for robot in robots:
        again, fresh = run(used, robot, 60, spinning), run(MuJoCoEngine(1), robot, 60, spinning)
        assert again.sensors.tobytes() == fresh.sensors.tobytes()
        assert again.base_pose is not None
        assert fresh.base_pose is not None
        assert again.base_pose.tobytes() == fresh.base_pose.tobytes()
    assert len(used._models) == 6


def test_the_drives_of_a_rollout_do_not_reach_the_model() -> None:
    stiff = quadruped().map_drive("knee_front_left", lambda d: replace(d, kp=1.0, coulomb=0.3))
    limp = replace(quadruped(), drives=tuple(loose_drive(d.joint) for d in quadruped().drives))
    assert structure_key(stiff) == structure_key(quadruped())
    assert structure_key(limp) == structure_key(quadruped())


def test_a_robot_that_touches_nothing_takes_little_memory_and_far_more_than_it_works_with() -> None:
    """Of hundreds of models 14 MB each were gigabytes, once what had been in their places was used."""
    robot = replace(quadruped(), free_base=False, world=replace(quadruped().world, has_floor=False))
    m = Model(robot).compiled
    data = mujoco.MjData(m)
    for _ in range(20):
        mujoco.mj_step(m, data)
    assert 20 * data.maxuse_arena < m.narena < 2**20
    assert Model(quadruped()).compiled.narena > 2**23, "contacts take room"
