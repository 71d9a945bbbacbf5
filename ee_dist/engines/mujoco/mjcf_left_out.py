"""What an MJCF says that a robot here has no place for, as notes for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

from ee_dist.basics.names import counted, listed

_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_OFF = mujoco.mjtDisableBit
_SWITCHES = {
    "constraint": _OFF.mjDSBL_CONSTRAINT,
    "frictionloss": _OFF.mjDSBL_FRICTIONLOSS,
    "limit": _OFF.mjDSBL_LIMIT,
    "contact": _OFF.mjDSBL_CONTACT,
    "spring": _OFF.mjDSBL_SPRING,
    "damper": _OFF.mjDSBL_DAMPER,
    "clampctrl": _OFF.mjDSBL_CLAMPCTRL,
    "actuation": _OFF.mjDSBL_ACTUATION,
}
"""Flags that change a motion; that of gravity is taken."""
HARDLY = 1e-3
"""Share of the mass that moves whose weight nothing compensates, of links that stand for none, at which all is."""


def carries_all(m: Any) -> bool:
    """Whether the file compensates all weight of all bodies that move: they go as if gravity was none. Of some alone, or in part,
    a robot here has no place for it."""
    moving = m.body_weldid != 0
    mass, left = m.body_mass[moving], np.abs(1.0 - m.body_gravcomp[moving])
    return bool(mass.sum() > 0 and mass @ left <= HARDLY * mass.sum())


def left_out(m: Any) -> Iterator[str]:
    """One line for each kind of thing."""
    for count, what in (
        (int(m.neq), ("equality constraint",)),
        (int(m.ntendon), ("tendon",)),
        (int(m.nflex), ("flexible body", "flexible bodies")),
        (
            0 if carries_all(m) else int((m.jnt_actgravcomp != 0).sum() + (m.body_gravcomp != 0).sum()),
            ("gravity compensation",),
        ),
    ):
        if count:
            yield f"{counted(count, *what)} left out"
    switched = [name for name, bit in _SWITCHES.items() if int(m.opt.disableflags) & int(bit)]
    if switched:
        yield f"switched off in the file, but not here: {', '.join(switched)}"
    fluid = [name for name in ("density", "viscosity") if getattr(m.opt, name)]
    if fluid:
        yield f"the fluid around the robot is left out: its {' and '.join(fluid)}"
    curved = [_joint(m, j) for j in range(m.njnt) if m.jnt_stiffnesspoly[j].any() or _damped(m, j)]
    if curved:
        yield f"springs and dampings that are not linear are taken as if they were: {listed(curved)}"
    for j in range(m.njnt):
        dof = int(m.jnt_dofadr[j])
        named = {"damping": m.dof_damping, "armature": m.dof_armature, "frictionloss": m.dof_frictionloss}
        held = [name for name, values in named.items() if values[dof]]
        if m.jnt_type[j] == _FREE and held:
            yield f"the free joint's {' and '.join(held)} left out"


def _damped(m: Any, j: int) -> bool:
    """Whether a damping of the joint, its own or by an actuator, is more than proportional to its speed."""
    acting = [a for a in range(m.nu) if m.actuator_trnid[a, 0] == j and m.actuator_dampingpoly[a].any()]
    return bool(acting) or bool(m.dof_dampingpoly[int(m.jnt_dofadr[j])].any())


def _joint(m: Any, j: int) -> str:
    return mujoco.mj_id2name(m, mujoco.mjtObj.mjOBJ_JOINT, j) or f"joint_{j}"
