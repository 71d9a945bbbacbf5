"""Bullet's C interface, for what is asked in every step.

PyBullet's functions hand over states and contacts as Python tuples: some hundred objects a robot and step, of which
twenty are wanted. The library that PyBullet is holds Bullet's C interface as well (``PhysicsClientC_API.h``), whose
answers are numbers in memory. Both speak to the same world by the same commands, so the numbers are the same bits.

Only the connection that PyBullet opened is needed. PyBullet keeps it in a table of its own that has a name in the
library's symbols but is not exported, so it is looked up in the file. Where that fails (another operating system, a
library without symbols), or where a small world does not give the same numbers both ways, ``interface`` is None and
PyBullet's functions do.
"""

from __future__ import annotations

import functools
import mmap
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pybullet as p
from cffi import FFI

from ee_dist.trials.log import Array

_TABLE = "sPhysicsClients1"
_EXPORTED = "b3CanSubmitCommand"
_DECLARATIONS = """
typedef struct {
    int flags, body_a, body_b, link_a, link_b;
    double on_a[3], on_b[3], normal[3], distance, force, friction_1, friction_2, direction_1[3], direction_2[3];
} Contact;
typedef struct { int count; Contact* first; } Contacts;
int b3CanSubmitCommand(void* client);
void* b3SubmitClientCommandAndWaitStatus(void* client, void* command);
void* b3RequestActualStateCommandInit(void* client, int body);
int b3GetStatusActualState(void* status, int*, int*, int*, const double** root, const double** q, const double** u,
                           const double** reaction);
void* b3InitRequestContactPointInformation(void* client);
void b3SetContactFilterBodyA(void* command, int body);
void b3GetContactPointInformation(void* client, Contacts* found);
"""


class Interface:
    """The C functions (``library``), and the clients that PyBullet opened."""

    def __init__(self, path: Path) -> None:
        self.ffi = FFI()
        self.ffi.cdef(_DECLARATIONS)
        self.library: Any = self.ffi.dlopen(str(path))
        places = _symbols(path, (_TABLE, _EXPORTED))
        loaded = int(self.ffi.cast("intptr_t", self.ffi.addressof(self.library, _EXPORTED)))
        self._clients = self.ffi.cast("void**", loaded - places[_EXPORTED] + places[_TABLE])
        self.contact = np.dtype(
            {
                "names": ["body", "link", "force"],
                "formats": ["i4", "i4", "f8"],
                "offsets": [self.ffi.offsetof("Contact", name) for name in ("body_b", "link_b", "force")],
                "itemsize": self.ffi.sizeof("Contact"),
            }
        )

    def client(self, number: int) -> Any:
        """The connection that PyBullet numbers so."""
        return self._clients[number]

    def state_of(self, client: Any, body: int) -> tuple[Any, Any]:
        """Where a client's answers about states lie: positions (base 7, then joints) and speeds (base 6, then joints)."""
        q, u, none = self.ffi.new("const double**"), self.ffi.new("const double**"), self.ffi.NULL
        library = self.library
        status = library.b3SubmitClientCommandAndWaitStatus(
            client, library.b3RequestActualStateCommandInit(client, body)
        )
        if not library.b3GetStatusActualState(status, none, none, none, none, q, u, none):
            raise RuntimeError("pybullet: a body's state was asked for and not given")
        return q[0], u[0]

    def contacts_of(self, client: Any, body: int, into: Any) -> int:
        """Number of contacts of a body; ``into`` (a Contacts*) says where they lie until the next call."""
        library = self.library
        command = library.b3InitRequestContactPointInformation(client)
        library.b3SetContactFilterBodyA(command, body)
        library.b3SubmitClientCommandAndWaitStatus(client, command)
        library.b3GetContactPointInformation(client, into)
        return int(into.count)

    def array(self, address: Any, count: int) -> Array:
        """A look at ``count`` numbers in Bullet's memory."""
        return np.frombuffer(self.ffi.buffer(address, count * 8), dtype=np.float64)


@functools.cache
def interface() -> Interface | None:
    """The C interface, if it is there and gives the same numbers as PyBullet's functions."""
    try:
        found = Interface(Path(p.__file__))
    except (OSError, ValueError, AttributeError, struct.error):
        return None
    return found if _agrees(found) else None


def _agrees(c: Interface) -> bool:
    """A ball that has just met the floor, seen both ways."""
    number = p.connect(p.DIRECT)
    try:
        floor = p.createMultiBody(
            0, p.createCollisionShape(p.GEOM_PLANE, physicsClientId=number), physicsClientId=number
        )
        ball = p.createCollisionShape(p.GEOM_SPHERE, radius=0.5, physicsClientId=number)
        body = p.createMultiBody(1.0, ball, -1, (0.1, 0.2, 0.49), physicsClientId=number)
        p.resetBaseVelocity(body, (0.3, 0.0, -1.0), (0.0, 0.1, 0.2), physicsClientId=number)
        p.stepSimulation(number)
        client = c.client(number)
        if client == c.ffi.NULL or not c.library.b3CanSubmitCommand(client):
            return False
        q, u = c.state_of(client, body)
        seen = np.concatenate([c.array(q, 7), c.array(u, 6)])
        known = (*p.getBasePositionAndOrientation(body, number), *p.getBaseVelocity(body, number))
        into = c.ffi.new("Contacts*")
        count = c.contacts_of(client, floor, into)
        touches = p.getContactPoints(floor, physicsClientId=number)
        if count != len(touches) or count == 0:
            return False
        rows = np.frombuffer(c.ffi.buffer(into.first, count * c.contact.itemsize), c.contact)
        same = [(int(r["body"]), int(r["link"]), float(r["force"])) for r in rows]
        return bool((seen == np.concatenate(known)).all()) and same == [(t[2], t[4], t[9]) for t in touches]
    finally:
        p.disconnect(number)


def _symbols(path: Path, names: tuple[str, ...]) -> dict[str, int]:
    """Where the named symbols of a 64-bit ELF library lie, relative to each other. ValueError for any other file."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        if data[:6] != b"\x7fELF\x02\x01":
            raise ValueError(f"{path} is not a little-endian 64-bit ELF file")
        (sections,) = struct.unpack_from("<Q", data, 40)
        size, count = struct.unpack_from("<HH", data, 58)
        # name, type, flags, address, offset, size, link, ...
        headers = [struct.unpack_from("<IIQQQQII", data, sections + k * size) for k in range(count)]
        (table,) = (h for h in headers if h[1] == 2)
        layout = np.dtype(
            [("name", "<u4"), ("kind", "u1"), ("other", "u1"), ("section", "<u2"), ("at", "<u8"), ("size", "<u8")]
        )
        symbols = np.frombuffer(data[table[4] : table[4] + table[5]], layout)
        strings = data[headers[table[6]][4] : headers[table[6]][4] + headers[table[6]][5]]
        found = {}
        for name in names:
            place = strings.find(b"\0" + name.encode() + b"\0") + 1
            at = symbols["at"][symbols["name"] == place]
            if place == 0 or len(at) != 1:
                raise ValueError(f"{path} names no single symbol {name}")
            found[name] = int(at[0])
        return found
