"""One motion of two joints, written in every format that is read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Bag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy import io

JOINTS = ("shoulder", "elbow")
ROWS = 400
STEP_S = 0.01
START_NS = 1_700_000_000 * 10**9


LINK = """<link name="{0}"><inertial><origin xyz="0 0 -0.1"/><mass value="0.3"/>
<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 -0.2"/><axis xyz="0 1 0"/>
<limit lower="-1.7" upper="1.7" effort="5" velocity="9"/></joint>"""


def robot_file(folder: Path, joints: tuple[str, ...] = JOINTS) -> Path:
    """The description of a hanging chain of joints, with sensors by default: positions and speeds."""
    links = ["base", *(f"link_{j}" for j in joints)]
    parts = ['<link name="base"/>', *(LINK.format(n) for n in links[1:])]
    parts += [JOINT.format(j, links[k], links[k + 1]) for k, j in enumerate(joints)]
    (folder / "chain.urdf").write_text(f'<robot name="chain">{"".join(parts)}</robot>')
    drives = "".join(f"  {j}: {{kp: 20, speed_limit: 8}}\n" for j in joints)
    (folder / "chain.yaml").write_text(f"urdf: chain.urdf\ntime_step_s: {STEP_S}\ndrives:\n{drives}")
    return folder / "chain.yaml"


def motion() -> dict[str, np.ndarray]:
    """t (T,) on exact hundredths; q, w, g (T, 2): positions, speeds, commands that lead by 40 ms."""
    t = np.arange(ROWS) * 10 / 1000
    wave = lambda s: np.stack([0.5 * np.sin(1.7 * s) + 0.2 * np.sin(4.1 * s), 0.4 * np.cos(2.3 * s)], axis=1)  # noqa: E731
    return {"t": t, "q": wave(t), "w": np.gradient(wave(t), t, axis=0), "g": wave(t + 0.04)}


def csv(folder: Path) -> Path:
    m = motion()
    frame = pd.DataFrame({"t": m["t"]} | {f"{k}{j}": m[k][:, j] for k in "qwg" for j in (0, 1)})
    frame.to_csv(folder / "run.csv", index=False)
    return folder / "run.csv"


def csv_lists(folder: Path) -> Path:
    m = motion()
    frame = pd.DataFrame({"t": m["t"]} | {k: [json.dumps(v.tolist()) for v in m[k]] for k in "qwg"})
    frame.to_csv(folder / "run.csv", index=False)
    return folder / "run.csv"


def parquet(folder: Path) -> Path:
    m = motion()
    pd.DataFrame({"t": m["t"]} | {k: list(m[k]) for k in "qwg"}).to_parquet(folder / "run.parquet")
    return folder / "run.parquet"


def json_rows(folder: Path) -> Path:
    m = motion()
    rows = [{"t": m["t"][i]} | {k: m[k][i].tolist() for k in "qwg"} for i in range(ROWS)]
    (folder / "run.json").write_text(json.dumps({"kp": 3, "entries": rows}))
    return folder / "run.json"


def json_columns(folder: Path) -> Path:
    (folder / "run.json").write_text(json.dumps({"kp": 3} | {k: v.tolist() for k, v in motion().items()}))
    return folder / "run.json"


def json_lines(folder: Path) -> Path:
    m = motion()
    rows = [{"t": m["t"][i], "log": {k: m[k][i].tolist() for k in "qwg"}} for i in range(ROWS)]
    (folder / "run.jsonl").write_text("\n".join(json.dumps(r) for r in rows))
    return folder / "run.jsonl"


def npz(folder: Path) -> Path:
    np.savez(folder / "run.npz", kp=3.0, **motion())
    return folder / "run.npz"


def mat(folder: Path) -> Path:
    m = motion()
    io.savemat(folder / "run.mat", {"run": {"t": m["t"], "q": m["q"].T, "w": m["w"], "g": m["g"]}, "kp": 3.0})
    return folder / "run.mat"


def hdf5(folder: Path) -> Path:
    with h5py.File(folder / "run.h5", "w") as f:
        for k, v in motion().items():
            f.create_dataset(f"log/{k}", data=v, compression="gzip")
        f["log_again"] = f["log"]
        f["kp"] = 3.0
    return folder / "run.h5"


def mat73(folder: Path) -> Path:
    """As MATLAB's -v7.3 writes: HDF5 behind 512 bytes, arrays transposed."""
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as f:
        for k, v in motion().items():
            f[k] = np.atleast_2d(v.T)
            f[k].attrs["MATLAB_class"] = np.bytes_("double")
        f.create_dataset("name", data=np.array([[72], [105]], dtype=np.uint16)).attrs["MATLAB_class"] = np.bytes_(
            "char"
        )
    with (folder / "run.mat").open("r+b") as f:
        f.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    return folder / "run.mat"


def lerobot(
    folder: Path, episodes: int = 1, names: Any = None, robot: str = "so101_follower", scale: float = 1.0
) -> Path:
    """A v3.0 data set at 100 rows a second; the second file begins in the middle."""
    m, out = motion(), folder / "set"
    (out / "meta").mkdir(parents=True)
    (out / "data" / "chunk-000").mkdir(parents=True)
    width = m["q"].shape[1]
    feature = {"dtype": "float32", "shape": [width], "names": names or [f"{j}.pos" for j in JOINTS]}
    one = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "codebase_version": "v3.0", "robot_type": robot, "fps": 100,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "features": {
            "observation.state": feature, "action": feature, "observation.images.top": {"dtype": "video", "shape": [4, 4, 3]},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None}, "frame_index": one, "episode_index": one,
        },
    }  # fmt: skip
    (out / "meta" / "info.json").write_text(json.dumps(info))
    for e in range(episodes):
        lists = pa.list_(pa.float32(), width)
        flat = {k: pa.FixedSizeListArray.from_arrays((scale * m[k]).astype(np.float32).ravel(), width) for k in "qg"}
        table = pa.table(
            {
                "observation.state": flat["q"].cast(lists), "action": flat["g"].cast(lists),
                "timestamp": m["t"].astype(np.float32), "frame_index": np.arange(ROWS), "episode_index": np.full(ROWS, e),
            }
        )  # fmt: skip
        pq.write_table(table, out / "data" / "chunk-000" / f"file-{e:03d}.parquet")
    return out


CONTROLLER_STATE = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint reference
trajectory_msgs/JointTrajectoryPoint feedback
"""


def _store(ros1: bool = False) -> Any:
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(CONTROLLER_STATE, "control_msgs/msg/JointTrajectoryControllerState"))
    return store


def _messages(store: Any, ros1: bool) -> Any:
    """(topic, type, log time, message) of joint states, of commands by controller state, of a trajectory, a wrench, an Imu
    and an image that nobody asked for."""
    types, m = store.types, motion()
    stamp_of = lambda ns: types["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)  # noqa: E731
    header_of = lambda ns: (  # noqa: E731
        types["std_msgs/msg/Header"](seq=0, stamp=stamp_of(ns), frame_id="")
        if ros1
        else types["std_msgs/msg/Header"](stamp=stamp_of(ns), frame_id="")
    )
    state, point = types["sensor_msgs/msg/JointState"], types["trajectory_msgs/msg/JointTrajectoryPoint"]
    zero = types["builtin_interfaces/msg/Duration"](sec=0, nanosec=0)
    none = np.zeros(0)
    for i in range(ROWS):
        ns = START_NS + 10 * 10**6 * i
        yield (
            "/arm/joint_states", "sensor_msgs/msg/JointState", ns + 500,
            state(header=header_of(ns), name=list(JOINTS), position=m["q"][i], velocity=m["w"][i], effort=none),
        )  # fmt: skip
        yield (
            "/arm/joint_states", "sensor_msgs/msg/JointState", ns + 600,
            state(header=header_of(ns), name=["jaw"], position=np.array([0.3]), velocity=none, effort=none),
        )  # fmt: skip
        at = point(positions=m["g"][i], velocities=none, accelerations=none, effort=none, time_from_start=zero)
        got = point(positions=m["q"][i], velocities=none, accelerations=none, effort=none, time_from_start=zero)
        yield (
            "/arm/controller/state", "control_msgs/msg/JointTrajectoryControllerState", ns + 700,
            types["control_msgs/msg/JointTrajectoryControllerState"](
                header=header_of(ns), joint_names=list(JOINTS), reference=at, feedback=got
            ),
        )  # fmt: skip
        three = types["geometry_msgs/msg/Vector3"]
        wrench = types["geometry_msgs/msg/Wrench"](
            force=three(x=1.0 * i, y=0.0, z=0.0), torque=three(x=0.0, y=0.0, z=0.0)
        )
        stamped = types["geometry_msgs/msg/WrenchStamped"](header=header_of(ns), wrench=wrench)
        yield "/ft", "geometry_msgs/msg/WrenchStamped", ns + 800, stamped
        imu = types["sensor_msgs/msg/Imu"](
            header=header_of(ns), orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=np.zeros(9), angular_velocity=three(x=0.0, y=2.0 * i, z=0.0),
            angular_velocity_covariance=np.zeros(9), linear_acceleration=three(x=0.0, y=0.0, z=9.81),
            linear_acceleration_covariance=np.zeros(9),
        )  # fmt: skip
        yield "/imu", "sensor_msgs/msg/Imu", ns + 900, imu
    points = [
        point(
            positions=m["g"][i], velocities=none, accelerations=none, effort=none,
            time_from_start=types["builtin_interfaces/msg/Duration"](sec=i // 100, nanosec=(i % 100) * 10**7),
        )
        for i in range(0, ROWS, 10)
    ]  # fmt: skip
    trajectory = types["trajectory_msgs/msg/JointTrajectory"](
        header=header_of(0), joint_names=list(JOINTS), points=points
    )
    yield "/arm/trajectory", "trajectory_msgs/msg/JointTrajectory", START_NS, trajectory


def _bag2(folder: Path, plugin: StoragePlugin) -> Path:
    store, out = _store(), folder / "bag"
    with Bag2Writer(out, version=8, storage_plugin=plugin) as writer:
        opened: dict[str, Any] = {}
        for topic, kind, ns, message in _messages(store, False):
            if topic not in opened:
                opened[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(opened[topic], ns, store.serialize_cdr(message, kind))
    return out


def rosbag2_mcap(folder: Path) -> Path:
    return _bag2(folder, StoragePlugin.MCAP)


def rosbag2_db3(folder: Path) -> Path:
    return _bag2(folder, StoragePlugin.SQLITE3)


def rosbag2_file(folder: Path) -> Path:
    """The .mcap alone, without the folder's metadata.yaml."""
    (file,) = rosbag2_mcap(folder).glob("*.mcap")
    return file


def rosbag1(folder: Path) -> Path:
    store, out = _store(ros1=True), folder / "run.bag"
    with Bag1Writer(out) as writer:
        opened: dict[str, Any] = {}
        for topic, kind, ns, message in _messages(store, True):
            if topic not in opened:
                opened[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(opened[topic], ns, store.serialize_ros1(message, kind))
    return out


def mcap_json(folder: Path) -> Path:
    m = motion()
    with (folder / "run.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("arm.State", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/arm", "json", schema)
        for i in range(ROWS):
            ns = START_NS + 10 * 10**6 * i
            joints = [
                {"name": n, "position": m["q"][i, j], "velocity": m["w"][i, j], "goal": m["g"][i, j]}
                for j, n in enumerate(JOINTS)
            ]
            stamp = {"sec": ns // 10**9, "nsec": ns % 10**9}
            writer.add_message(channel, ns, json.dumps({"timestamp": stamp, "joints": joints}).encode(), ns)
        writer.finish()
    return folder / "run.mcap"


def mcap_protobuf(folder: Path) -> Path:
    """A message of nested joints, with foxglove's way of stamping."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
    from mcap_protobuf.writer import Writer

    made = descriptor_pb2.FileDescriptorProto(name="arm.proto", package="arm", syntax="proto3")
    made.dependency.append("google/protobuf/timestamp.proto")
    joint = made.message_type.add(name="Joint")
    number, text, several = 1, 9, 3
    for k, (name, kind) in enumerate((("name", text), ("position", number), ("velocity", number), ("goal", number))):
        joint.field.add(name=name, number=k + 1, type=kind, label=1)
    state = made.message_type.add(name="State")
    state.field.add(name="timestamp", number=1, type=11, type_name=".google.protobuf.Timestamp", label=1)
    state.field.add(name="joints", number=2, type=11, type_name=".arm.Joint", label=several)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.Add(made)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("arm.State"))
    m = motion()
    with (folder / "run.mcap").open("wb") as file, Writer(file) as writer:
        for i in range(ROWS):
            ns = START_NS + 10 * 10**6 * i
            message = kind()
            message.timestamp.seconds, message.timestamp.nanos = ns // 10**9, ns % 10**9
            for j, n in enumerate(JOINTS):
                message.joints.add(name=n, position=m["q"][i, j], velocity=m["w"][i, j], goal=m["g"][i, j])
            writer.write_message("/arm", message, ns, ns)
    return folder / "run.mcap"


Where = dict[str, tuple[str, str]]
"""Column (t, q0, w0, g0, ... of the motion) to (table, address)."""


def _flat(at: str, bracket: bool = True, before: str = "", table: str = "") -> Where:
    return {at: (table, f"{before}t")} | {
        f"{k}{j}": (table, f"{before}{k}[{j}]" if bracket else f"{k}{j}") for k in "qwg" for j in (0, 1)
    }


def _bag(state: str = "/arm/controller/state") -> Where:
    found = {f"q{j}": ("/arm/joint_states", f"position[{n}]") for j, n in enumerate(JOINTS)}
    found |= {f"w{j}": ("/arm/joint_states", f"velocity[{n}]") for j, n in enumerate(JOINTS)}
    found |= {f"g{j}": (state, f"reference.positions[{n}]") for j, n in enumerate(JOINTS)}
    return {"t": ("/arm/joint_states", "time")} | found


def _named(table: str) -> Where:
    fields = {"q": "position", "w": "velocity", "g": "goal"}
    return {"t": (table, "time")} | {
        f"{k}{j}": (table, f"joints.{f}[{n}]") for k, f in fields.items() for j, n in enumerate(JOINTS)
    }


LEROBOT = {"t": ("", "seconds")} | {
    f"{k}{j}": ("", f"{c}[{n}.pos]")
    for k, c in (("q", "observation.state"), ("g", "action"))
    for j, n in enumerate(JOINTS)
}
FORMATS: dict[str, tuple[Callable[[Path], Path], Where]] = {
    "csv": (csv, _flat("t", bracket=False)),
    "csv with lists": (csv_lists, _flat("t")),
    "parquet": (parquet, _flat("t")),
    "json rows": (json_rows, _flat("t")),
    "json columns": (json_columns, _flat("t")),
    "json lines": (
        json_lines,
        {"t": ("", "t")} | {k: (t, f"log.{c}") for k, (t, c) in _flat("t").items() if k != "t"},
    ),
    "npz": (npz, _flat("t")),
    "mat": (mat, _flat("t", before="run.")),
    "mat 7.3": (mat73, _flat("t")),
    "hdf5": (hdf5, _flat("t", before="log.")),
    "lerobot": (lerobot, LEROBOT),
    "rosbag2 mcap": (rosbag2_mcap, _bag()),
    "rosbag2 db3": (rosbag2_db3, _bag()),
    "mcap alone": (rosbag2_file, _bag()),
    "rosbag1": (rosbag1, _bag()),
    "mcap json": (mcap_json, _named("/arm")),
    "mcap protobuf": (mcap_protobuf, _named("/arm")),
}
