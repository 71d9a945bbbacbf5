"""Contact with the floor: MuJoCo's parameters for what the two engines shall have in common.

Where a contact moves with speed v at depth r < 0, MuJoCo wants the acceleration -b v - k r there and grants the share d
(the impedance) of what that takes. The numbers are chosen for one time step h: b = 1/h takes away the approach without a
rebound, and k d h^2 = UNDONE undoes a fixed share of the depth.

Sliding has a b of its own, well below 1/h. MuJoCo's friction is convex, and so a sliding contact is also pushed off the
floor, by friction x b x (slip). With b = 1/h, which MuJoCo's defaults come to at a step of 10 ms, a block that slides at
1 m/s hops 9 mm high and its touch sensor is open for two thirds of the time.

A floor that gives is the spring K = 1 / compliance with damping C = SPRING_DAMPING_S * K, taken at the end of the step as
Bullet takes it: force = -K (r + h v') - C v'. With A, what one newton accelerates the contact by, this is b = 1/h,
k = 1 / (h (h + SPRING_DAMPING_S)) and d = A / (A + 1 / (h^2 K + h C)).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ee_dist.trials.log import Array

IMPEDANCE = 0.9
"""d on a hard floor. Nearer to 1, contacts chatter; at 0.9 the quadruped at rest sinks 0.25 mm into the margin."""
UNDONE = 0.4
"""Share of the depth that a step undoes. Bullet's is 0.2, with d = 1."""
SLIDING_PER_S = 40.0
"""b of sliding. Slip within the friction cone dies out at this rate."""
IMPEDANCE_RATIO = 10.0
"""How much stiffer friction is than the normal direction. It keeps a standing foot from creeping."""
SPRING_DAMPING_S = 0.02
"""Damping of a floor that gives over its stiffness, the same for every engine."""
MARGIN_M = 0.00025
"""How far above the floor a contact begins: a robot of a few kilograms then rests at the height of a hard floor, and one
that starts on the floor, as rounding has it a little above or below, touches it from the first step."""
LEAST_FRICTION = 1e-5
"""MuJoCo's own bound."""


class Contact(NamedTuple):
    """MuJoCo's fields of contact pairs, (..., 2), (..., 2) and (..., 5), and ``impratio`` (...)."""

    normal: Array
    sliding: Array
    impedance: Array
    ratio: Array


def contact(time_step_s: float, compliance_m_n: Array, accelerated: Array) -> Contact:
    """Parameters per robot and pair from compliance (R,) and A (R, P) in (m/s^2)/N."""
    h, give = time_step_s, compliance_m_n[:, None]
    hard_k = UNDONE / (IMPEDANCE * h**2)
    soft = 1.0 / (h * (h + SPRING_DAMPING_S))
    # 1 / (h^2 K + h C) = give / (h (h + SPRING_DAMPING_S))
    felt = accelerated + give * soft
    # A part that is bolted down is accelerated by nothing: whatever its shapes have is right.
    d = np.clip(np.divide(accelerated, felt, out=np.ones_like(felt), where=felt > 0), 1e-4, IMPEDANCE)
    k = np.where(give > 0, soft, hard_k) + np.zeros_like(d)
    impedance = np.empty((*d.shape, 5))
    impedance[..., 0] = impedance[..., 1] = d
    impedance[..., 2:] = 0.001, 0.5, 2.0
    # Direct form: of the first MuJoCo makes k by dividing by d^2 and multiplying by d, of the second b by dividing by d.
    normal = -np.stack([k * d, d / h], axis=-1)
    sliding = -np.stack([d, SLIDING_PER_S * d], axis=-1)
    # MuJoCo ties the stiffness of friction to the normal direction; a floor that gives shall grip like a hard one.
    softer = (1.0 - d) / d * (IMPEDANCE / (1.0 - IMPEDANCE))
    return Contact(normal, sliding, impedance, IMPEDANCE_RATIO * softer.max(axis=1, initial=1.0))
