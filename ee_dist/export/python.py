"""The controller shim as one file: its code as it stands here, and the numbers of one robot."""

from __future__ import annotations

import math
import pprint
from pathlib import Path
from typing import Any

from ee_dist.export import shim
from ee_dist.export.plan import parameters
from ee_dist.robots.model import Robot

LOOP = '''

def make():
    """The drives and sensors of this robot, at the start of a run."""
    return Shim(PARAMETERS)


if __name__ == "__main__":
    # With MuJoCo: holds the first pose for a second. Put your controller where ``command`` is.
    import mujoco

    model = mujoco.MjModel.from_xml_path("robot.xml")
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    controller = make()
    here = [k for k, name in enumerate(controller.joints) if controller.present[k]]
    at = [model.joint(controller.joints[k]).qposadr[0] for k in here]
    turning = [model.joint(controller.joints[k]).dofadr[0] for k in here]
    motors = [model.actuator(controller.joints[k]).id for k in here]
    command = np.zeros(len(controller.joints))
    command[here] = data.qpos[at] * (controller.kinds[here] == "position")
    for step in range(round(1.0 / model.opt.timestep)):
        position, speed = np.zeros((2, len(command)))
        position[here], speed[here] = data.qpos[at], data.qvel[turning]
        data.ctrl[motors] = controller.torque(data.time, command, position, speed)[here]
        mujoco.mj_step(model, data)
    print(dict(zip(controller.joints, np.round(position, 4))))
'''


def controller_text(robot: Robot, head: str) -> str:
    """A Python file that needs NumPy alone. ``head`` says what it was made of."""
    code = Path(shim.__file__).read_text(encoding="utf-8")
    numbers = pprint.pformat(_plain(parameters(robot)), width=120, compact=True, sort_dicts=False)
    comment = "".join(f"# {line}\n" for line in head.splitlines())
    return f"{comment}{code}\n\nPARAMETERS = {numbers}\n{LOOP}"


def _plain(value: Any) -> Any:
    """Lists and numbers that Python reads back; infinity is a text that ``float`` knows."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v) for v in value]
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value
