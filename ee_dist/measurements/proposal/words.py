"""What the name of a column says: the quantity, whether it is a command, its number, its unit. A name can be mute."""

from __future__ import annotations

import re
from dataclasses import dataclass

POSITION, SPEED, TORQUE, CURRENT, OTHER, TIME = "position", "speed", "torque", "current", "other", "time"

_QUANTITY = {
    POSITION: "q pos position positions angle angles ang theta th phi qpos jpos enc encoder winkel pose lage stroke angular "
    "rotation configuration",
    SPEED: "dq qvel vel velocity velocities speed speeds omega qdot dtheta thetadot jvel spd rate geschwindigkeit drehzahl "
    "qp thetap dphi dotq",
    TORQUE: "tau tor torq torqs torque torques effort efforts trq moment drehmoment force kraft jtau frc",
    CURRENT: "cur curr current currents amps ampere strom iq amperage",
    OTHER: "acc accel acceleration qdd ddq qddot ddotq volt voltage volts temp temperature pwm err error fric friction duty "
    "status flag mode supply battery load enable enabled counter seq id ticks cycle wrench imu tcp cartesian eef "
    "ft fts ftsensor loadcell",
    TIME: "t time times timestamp timestamps stamp stamps zeit clock sec secs seconds elapsed uptime tstamp date datetime",
}
DUTIES = frozenset(["pwm", "duty"])
VOLTAGES = DUTIES | {"volt", "volts", "voltage"}
"""Of what is asked of a motor without a controller of its torque."""
_KIND = {w: k for k, words in _QUANTITY.items() for w in words.split()}
_COMMAND = frozenset(
    [
        "cmd",
        "command",
        "commands",
        "commanded",
        "cmds",
        "goal",
        "goals",
        "target",
        "targets",
        "tgt",
        "des",
        "desired",
        "ref",
        "reference",
        "setpoint",
        "setpoints",
        "sp",
        "soll",
        "action",
        "actions",
        "con",
        "ctrl",
        "control",
        "set",
        "demand",
        "dem",
        "req",
        "requested",
        "sollwert",
    ]
)
_MEASURED = frozenset(
    [
        "meas",
        "measured",
        "actual",
        "act",
        "present",
        "state",
        "states",
        "fb",
        "feedback",
        "ist",
        "obs",
        "observation",
        "observations",
        "real",
        "istwert",
        "msr",
        "sensed",
        "read",
        "reading",
        "readings",
    ]
)
_ROLES = _COMMAND | _MEASURED
_STATES = frozenset(["state", "states"])
_PRESENT = frozenset(["current", "curr", "cur"])
"""Before a position or a speed these say that it was measured, and name no motor's current."""
_OF_NOW = frozenset(
    ["pos", "position", "positions", "angle", "angles", "vel", "velocity", "velocities", "speed", "speeds"]
)
_SECOND = frozenset(
    [
        "filt",
        "filtered",
        "smooth",
        "smoothed",
        "est",
        "estimated",
        "kalman",
        "fric",
        "friction",
        "raw",
        "prev",
        "last",
        "next",
    ]
)
_UNIT = {
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "grad": "deg", "°": "deg", "rad": "rad", "rads": "rad",
    "radian": "rad", "radians": "rad", "mrad": "mrad", "nm": "N.m", "n.m": "N.m", "mnm": "mN.m", "rpm": "rpm", "dps": "deg/s",
    "radps": "rad/s", "degps": "deg/s", "ms": "ms", "msec": "ms", "millis": "ms", "us": "us", "usec": "us", "µs": "us",
    "μs": "us", "micros": "us", "ns": "ns", "nsec": "ns", "nanos": "ns", "mm": "mm", "cm": "cm", "ma": "mA", "rev": "turn",
    "turns": "turn", "rad/s": "rad/s", "deg/s": "deg/s", "°/s": "deg/s", "m/s": "m/s", "mm/s": "mm/s", "amp": "A", "amps": "A",
    "1/min": "rpm", "u/min": "rpm", "n": "N", "mn": "mN", "nmm": "mN.m",
}  # fmt: skip
_LETTERS = {"s": "s", "m": "m", "a": "A", "v": "V", "n": "N"}
"""Units of one letter count only behind a word that says the quantity."""
_SHORT = {"v": SPEED, "w": SPEED, "qd": SPEED, "i": CURRENT, "p": POSITION, "u": OTHER, "f": TORQUE, "x": POSITION}
"""Letters that stand for a quantity where nothing else does; what the signals say goes before them (qd is a speed, or what was
desired)."""
_PER_SECOND = re.compile(
    r"(rad|deg|(?<![^\W_])mm?|turn|rev)[_ ]?(?:/|per|p)[_ ]?s(?:ec)?$|(rad|deg|(?<![^\W_])mm?)_s$", re.I
)


@dataclass(frozen=True)
class Reading:
    """What a name says. ``kind`` and ``unit`` may be None, ``command`` too; ``number`` is what counts the joint; ``family``
    is the name without the joint, shared by the columns of one quantity; ``weak``: the kind is a guess from a letter."""

    kind: str | None
    command: bool | None
    unit: str | None
    number: int | None
    family: str
    second: bool
    weak: bool


def tokens(name: str) -> list[str]:
    """Words and numbers of a name, in lower case: ``jointPos2_deg`` is joint, pos, 2, deg."""
    spaced = re.sub(r"(?<=[a-zäöü])(?=[A-Z][a-zäöü])", " ", name)
    return [w.lower() for w in re.findall(r"[^\W\d_]+|\d+", spaced.replace("°", " deg "))]


def read_name(name: str, joint_words: frozenset[str] = frozenset()) -> Reading:
    """What a column's name says; ``joint_words`` are the words that name its joint, which say nothing else."""
    bare, unit = split_unit(name)
    words = [w for w in tokens(bare) if w not in joint_words]
    numbers = [int(w) for w in words if w.isdigit()]
    texts = [part for w in words if not w.isdigit() for part in _unglued(w)]
    texts = ["present" if w in _PRESENT and _OF_NOW & set(texts[k + 1 : k + 2]) else w for k, w in enumerate(texts)]
    texts = _derived(texts)
    kinds = [_KIND[w] for w in texts if w in _KIND]
    if unit is None and len(texts) > 1 and texts[-1] in _UNIT:
        unit = _UNIT[texts[-1]]
        texts = texts[:-1]
    elif unit is None and len(texts) > 1 and texts[-1] in _LETTERS and (kinds or _amperes(bare, texts)):
        unit = _LETTERS[texts[-1]]
        texts = texts[:-1]
    # A lone d behind a quantity is "desired": q_d, qd_d.
    asked = any(w in _COMMAND for w in texts) or (len(texts) > 1 and texts[-1] == "d")
    command = True if asked else False if any(w in _MEASURED for w in texts) else None
    kind, weak = _kind(kinds, texts, unit)
    return Reading(
        kind, command, unit, numbers[-1] if numbers else None, " ".join(texts), any(w in _SECOND for w in texts), weak
    )


def quantity_of(word: str) -> str | None:
    """The quantity of a joint that a word says; None for any other word."""
    kind = _KIND.get(word)
    return kind if kind in (POSITION, SPEED, TORQUE, CURRENT) else None


_OF = ("joint", "jnt", "motor", "axis")
"""What a name may say that a quantity is of, in one word with it."""


def _unglued(word: str) -> tuple[str, ...]:
    """qdes is q and des; cmdpos is cmd and pos; jointacttorque is joint, act and torque; other words are one."""
    if word in _KIND or word in _ROLES:
        return (word,)
    for owner in _OF:
        rest = word.removeprefix(owner)
        if rest not in ("", word) and (quantity_of(rest) or len(_unglued(rest)) > 1):
            return owner, *_unglued(rest)
    for k in range(1, len(word)):
        first, second = word[:k], word[k:]
        if any(quantity_of(a) and b in _ROLES for a, b in ((first, second), (second, first))):
            return first, second
    return (word,)


def _derived(texts: list[str]) -> list[str]:
    """With a position and its dots as one word: q dot is a speed, and theta ddot, or dot dot, an acceleration."""
    found: list[str] = []
    for w in texts:
        before = quantity_of(found[-1]) if found else None
        if w in ("dot", "ddot") and before in (POSITION, SPEED):
            found[-1] = "qdot" if (w, before) == ("dot", POSITION) else "qdd"
        else:
            found.append(w)
    return found


def _amperes(name: str, texts: list[str]) -> bool:
    """Whether a name is that of a current by an i and a capital A alone: ``i1_A``; i_a is that of a phase."""
    return name.endswith("A") and texts[-1] == "a" and "i" in texts[:-1]


def role_of(name: str) -> bool | None:
    """Whether a file or topic is called commands (True) or measurements (False); None where it is called neither, or both.
    joint_states_cmd are commands; what /control/joint_states is nobody knows."""
    words = tokens(name)
    told = [w for w in words if w in _ROLES]
    asked = any(w in _COMMAND for w in told)
    of_states = bool(told) and told[-1] in _COMMAND
    seen = any(w in _MEASURED and not (of_states and w in _STATES) for w in told)
    return asked if asked != seen else None


AMPERES = ("A", "mA")


def _kind(kinds: list[str], texts: list[str], unit: str | None) -> tuple[str | None, bool]:
    if OTHER in kinds:
        return OTHER, False
    for kind in (SPEED, CURRENT, TORQUE, POSITION):
        if kind in kinds:
            # An effort in mA is one that its servo measures by its current.
            return CURRENT if kind == TORQUE and unit in AMPERES else kind, False
    if unit is not None:
        by_unit = {
            "rad/s": SPEED,
            "deg/s": SPEED,
            "m/s": SPEED,
            "mm/s": SPEED,
            "rpm": SPEED,
            "N.m": TORQUE,
            "mN.m": TORQUE,
        }
        by_unit |= {"A": CURRENT, "mA": CURRENT, "rad": POSITION, "deg": POSITION, "mrad": POSITION, "turn": POSITION}
        by_unit |= {"V": OTHER, "ms": TIME, "us": TIME, "ns": TIME, "N": TORQUE, "mm": POSITION, "cm": POSITION}
        if unit in by_unit:
            return by_unit[unit], False
    if TIME in kinds:
        return TIME, False
    letters = [w for w in texts if w in _SHORT]
    return (_SHORT[letters[0]], True) if letters else (None, False)


def split_unit(name: str) -> tuple[str, str | None]:
    """A unit in brackets or a speed's at the end, and the name without it."""
    found = re.search(r"[(\[]\s*([^\d()\[\]]+?)\s*[)\]]\s*$", name)
    if found:
        text = found[1].lower().replace("·", ".").replace("*", ".").replace(" ", "").replace("_", "/")
        unit = _UNIT.get(text) or _LETTERS.get(text)
        if unit:
            return name[: found.start()], unit
    found = _PER_SECOND.search(name)
    if found:
        size = (found[1] or found[2]).lower()
        return name[: found.start()], {"rev": "turn/s", "turn": "turn/s"}.get(size, f"{size}/s")
    return name, None


def unit_word(text: str) -> str | None:
    """A unit as a file states it, as one of ours."""
    bare = text.strip().lower().replace("·", ".").replace("*", ".").replace(" ", "")
    return _UNIT.get(bare) or _LETTERS.get(bare)
