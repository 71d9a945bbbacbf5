"""The contract of every reader: the same motion back, bit for bit where the format allows, and one line for what is broken."""

from __future__ import annotations

import json
import os
import resource
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import measurement_files as written
import numpy as np
import pytest
from scipy import io

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers import matlab_apart, options, read


@pytest.fixture(params=list(written.FORMATS))
def format_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_every_format_gives_the_same_columns_by_name(tmp_path: Path, format_name: str) -> None:
    write, where = written.FORMATS[format_name]
    (recorded,) = read(write(tmp_path))
    m = written.motion()
    for column, (table, address) in where.items():
        found = recorded.table(table, "test")
        values = found.numbers(address)
        wanted = m[column[0]][:, int(column[1])] if len(column) > 1 else m[column]
        if format_name == "lerobot" and column != "t":
            wanted = wanted.astype(np.float32)
        assert np.array_equal(values, wanted), column
        assert address in list(found.addresses())
        assert address in found
    assert all(len(t) and all(a in t for a in t.addresses()) for t in recorded.tables)


def test_settings_beside_the_series_are_the_header(tmp_path: Path, format_name: str) -> None:
    (recorded,) = read(written.FORMATS[format_name][0](tmp_path))
    if format_name in ("json rows", "json columns", "npz", "mat", "hdf5"):
        assert recorded.tables[0].header["kp"] == 3
    if format_name == "lerobot":
        assert recorded.tables[0].header["robot_type"] == "so101_follower"
        assert recorded.tables[0].clock == "seconds"


@pytest.mark.parametrize("wrapped", [lambda n: [n], lambda n: {"motors": n}, lambda n: {"motors": [n]}])
def test_names_may_stand_in_a_list_or_a_mapping_of_one(tmp_path: Path, wrapped: Callable[[list[str]], object]) -> None:
    names = [f"k{j.title()}" for j in written.JOINTS]
    (recorded,) = read(written.lerobot(tmp_path, names=wrapped(names)))
    assert {f"observation.state[{n}]" for n in names} <= set(recorded.tables[0].addresses())


def test_topics_of_a_bag_are_tables_on_one_clock(tmp_path: Path) -> None:
    (recorded,) = read(written.rosbag2_mcap(tmp_path))
    names = [t.name for t in recorded.tables]
    assert names[0] in ("/arm/joint_states", "/arm/controller/state")
    assert {"/arm/joint_states #2", "/arm/trajectory", "/ft", "/imu"} < set(names)
    assert recorded.table("/ft", "").numbers("wrench.force.x")[7] == 7.0
    assert recorded.table("/imu", "").numbers("angular_velocity.y")[7] == 14.0
    assert "covariance" not in " ".join(recorded.table("/imu", "").addresses())
    trajectory = recorded.table("/arm/trajectory", "")
    assert trajectory.numbers("time") == pytest.approx(np.arange(0, 4, 0.1))
    assert np.array_equal(trajectory.numbers("positions[elbow]"), written.motion()["g"][::10, 1])
    assert recorded.table("/arm/joint_states #2", "").numbers("position[jaw]").tolist() == [0.3] * written.ROWS


def test_episodes_groups_and_structs_are_trials(tmp_path: Path) -> None:
    assert [r.name for r in read(written.lerobot(tmp_path, episodes=3))] == ["episode 0", "episode 1", "episode 2"]
    m = written.motion()
    with h5py.File(tmp_path / "a.h5", "w") as f:
        for k in (0, 1, 10, 2):
            for n, v in m.items():
                f[f"data/demo_{k}/obs/{n}"] = v + k
    found = read(tmp_path / "a.h5")
    assert [r.name for r in found] == ["demo_0", "demo_1", "demo_2", "demo_10"]
    assert np.array_equal(found[3].tables[0].numbers("obs.q[1]"), m["q"][:, 1] + 10)
    runs = np.array([{"t": m["t"], "q": m["q"] + k} for k in range(2)], dtype=object)
    io.savemat(tmp_path / "a.mat", {"runs": runs})
    found = read(tmp_path / "a.mat")
    assert [r.name for r in found] == ["runs 1", "runs 2"]
    assert np.array_equal(found[1].tables[0].numbers("q[0]"), m["q"][:, 0] + 1)


@pytest.mark.parametrize("form", ["cell", "characters", "npz", "7.3"])
def test_an_array_whose_columns_the_file_names_is_read_by_these(tmp_path: Path, form: str) -> None:
    data, names = np.random.default_rng(0).random((50, 4)), ["time", "shoulder_position", "elbow_position", "current"]
    path = tmp_path / {"npz": "a.npz", "7.3": "a.h5"}.get(form, "a.mat")
    if form == "npz":
        np.savez(path, data=data, labels=names)
    elif form == "7.3":
        with h5py.File(path, "w") as f:
            f["data"] = data.T
            cell = f.create_dataset("column_name", (4, 1), dtype=h5py.ref_dtype)
            cell.attrs["MATLAB_class"] = np.bytes_("cell")
            for k, n in enumerate(names):
                text = f.create_dataset(f"#refs#/{k}", data=np.array([[ord(c)] for c in n], dtype=np.uint16))
                text.attrs["MATLAB_class"] = np.bytes_("char")
                cell[k, 0] = text.ref
    else:
        cell = np.array(names, dtype=object if form == "cell" else np.str_)
        io.savemat(path, {"data": data, "column_name": cell, "units": np.array(["s", "deg", "deg", "A"], dtype=object)})
    (table,) = read(path)[0].tables
    assert list(table.addresses()) == names
    for k, name in enumerate(names):
        assert np.array_equal(table.numbers(name), data[:, k])
        assert np.array_equal(table.numbers(f"data[{k}]"), data[:, k])  # as mappings have it that were written before
    assert table.units == ({} if form in ("npz", "7.3") else dict(zip(names, ("s", "deg", "deg", "A"), strict=True)))


def test_names_of_joints_are_those_of_the_places_in_all_arrays(tmp_path: Path) -> None:
    q = np.random.default_rng(0).random((50, 2))
    names = np.array(["shoulder", "elbow"], dtype=object)
    io.savemat(tmp_path / "a.mat", {"t": np.arange(50.0), "q": q, "tau": 2 * q, "joint_names": names})
    (table,) = read(tmp_path / "a.mat")[0].tables
    assert np.array_equal(table.numbers("q[elbow]"), q[:, 1]) and np.array_equal(table.numbers("tau[1]"), 2 * q[:, 1])
    io.savemat(tmp_path / "b.mat", {"t": np.arange(50.0), "q": q, "tau": 2 * q, "operators": names})
    (table,) = read(tmp_path / "b.mat")[0].tables
    assert list(table.addresses()) == ["t", "q[0]", "q[1]", "tau[0]", "tau[1]"]


def test_arrays_of_two_lengths_are_two_tables(tmp_path: Path) -> None:
    np.savez(
        tmp_path / "a.npz",
        t=np.arange(100.0),
        q=np.zeros((2, 100)),
        t_sent=np.arange(40.0),
        g=np.zeros((40, 2)),
        gains=[1.0, 2.0],
    )
    (recorded,) = read(tmp_path / "a.npz")
    assert [(t.name, len(t), list(t.columns)) for t in recorded.tables] == [
        ("t", 100, ["t", "q"]),
        ("t_sent", 40, ["t_sent", "g"]),
    ]
    assert recorded.tables[0].header["gains"] == [1.0, 2.0]


# -- what is broken, or meant to harm -----------------------------------------------------------------------------------


def files_of(path: Path) -> list[Path]:
    return sorted(f for f in path.rglob("*") if f.is_file()) if path.is_dir() else [path]


def complaint_of(action: Callable[[], Any]) -> str | None:
    """What is said of a bad file, in one short line; None where it could be read. Any other exception is a failure."""
    try:
        action()
    except MeasurementError as error:
        said = str(error)
    else:
        return None
    assert "\n" not in said
    assert len(said) < 600
    return said


@pytest.mark.parametrize("share", [0.05, 0.5, 0.97])
def test_files_cut_short_are_one_line(tmp_path: Path, format_name: str, share: float) -> None:
    """A cut file is refused, or (text) what is left of it is read; it never ends in a traceback."""
    path = written.FORMATS[format_name][0](tmp_path)
    largest = max(files_of(path), key=lambda f: f.stat().st_size)
    os.truncate(largest, int(share * largest.stat().st_size))
    complaint = complaint_of(lambda: read(path))
    if complaint is None:
        assert format_name in ("csv", "csv with lists", "rosbag2 db3")
    else:
        assert path.name in complaint or largest.name in complaint


@pytest.mark.parametrize("seed", range(3))
def test_damaged_bytes_are_one_line(tmp_path: Path, format_name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = written.FORMATS[format_name][0](tmp_path)
    for file in files_of(path):
        raw = bytearray(file.read_bytes())
        for at in rng.integers(0, len(raw), max(4, len(raw) // 500)):
            raw[at] = int(rng.integers(256))
        file.write_bytes(raw)
    complaint_of(lambda: [t.numbers(a, gaps=True) for r in read(path) for t in r.tables for a in t.addresses()])


class Bomb:
    """Runs a command when it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return os.system, (f"touch {self.mark}",)


@pytest.mark.parametrize("name", ["a.npz", "a.npy"])
def test_pickles_are_never_loaded(tmp_path: Path, name: str) -> None:
    mark = tmp_path / "was_here"
    bomb = np.array([Bomb(mark)], dtype=object)
    if name == "a.npz":
        np.savez(tmp_path / name, bomb=bomb)
    else:
        np.save(tmp_path / name, bomb, allow_pickle=True)
    with pytest.raises(MeasurementError, match=r"Python objects.*could run code"):
        read(tmp_path / name)
    assert not mark.exists()
    np.savez(tmp_path / "b.npz", bomb=bomb, **written.motion())
    (recorded,) = read(tmp_path / "b.npz")
    assert any("bomb: left out" in n for n in recorded.tables[0].notes)
    assert not mark.exists()


def test_hdf5_of_another_shape(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["pictures"] = np.zeros((20, 4, 4, 3))
    with pytest.raises(MeasurementError, match=r"no array of numbers .* a series; there are: pictures \(20, 4, 4, 3\)"):
        read(tmp_path / "a.h5")
    with h5py.File(tmp_path / "b.h5", "w") as f:
        f["t"], f["q"], f["cube"] = np.arange(50.0), np.zeros((50, 2)), np.zeros((50, 2, 2))
        f["loop"] = f["/"]
        f["outside"] = h5py.ExternalLink("/etc/hostname", "/x")
        f["nowhere"] = h5py.SoftLink("/absent")
    (recorded,) = read(tmp_path / "b.h5")
    assert set(recorded.tables[0].columns) == {"t", "q"}
    assert any("cube: left out, its shape is (50, 2, 2)" in n for n in recorded.tables[0].notes)


def test_hdf5_reads_nothing_from_other_files(tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(bytes(800))
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.create_dataset("stolen", (100,), "f8", external=[(str(tmp_path / "secret"), 0, 800)])
    with pytest.raises(MeasurementError, match=r"stolen: left out, its numbers stand in other files"):
        read(tmp_path / "a.h5")


def test_json_that_is_nested_to_harm(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("[" * 200_000)
    with pytest.raises(MeasurementError, match=r"nested too deeply"):
        read(tmp_path / "a.json")
    deep = '{"a":' * 500 + "1" + "}" * 500
    (tmp_path / "b.json").write_text(f'{{"entries": [{{"t": 0, "x": {deep}}}]}}')
    assert set(read(tmp_path / "b.json")[0].tables[0].columns) == {"t"}
    (tmp_path / "c.json").write_text(f'{{"entries": [{{"t": {"9" * 400}}}]}}')
    with pytest.raises(MeasurementError, match=r"column 't': '999.* is not a number"):
        read(tmp_path / "c.json")[0].tables[0].numbers("t")


@pytest.mark.skipif(sys.platform != "linux", reason="counts resident memory as Linux does")
@pytest.mark.parametrize("kind", ["npz", "h5", "parquet"])
def test_memory_is_bounded(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small files that would unpack to far more than is allowed are refused before it is taken."""
    most = 10**8
    monkeypatch.setattr(options, "MOST_BYTES", most)
    rows = most // 4
    if kind == "h5":
        with h5py.File(tmp_path / "a.h5", "w") as f:
            f.create_dataset("x", (rows,), "f8", chunks=(2**16,), compression="gzip", fillvalue=1.0)
    elif kind == "npz":
        import io as streams
        import zipfile

        with (
            zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as z,
            z.open("x.npy", "w", force_zip64=True) as f,
        ):
            head = streams.BytesIO()
            np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (rows,)})
            f.write(head.getvalue())
            for _ in range(int(most * 1.2) // 2**24):
                f.write(bytes(2**24))
    else:
        import pyarrow as pa
        import pyarrow.parquet as pq

        part = pa.table({"x": pa.array(np.zeros(2**20)).dictionary_encode()})
        with pq.ParquetWriter(tmp_path / "a.parquet", part.schema) as w:
            for _ in range(most // (8 * 2**20) + 2):
                w.write_table(part)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(MeasurementError, match=r"would take .* GB; at most 0.1 GB"):
        read(tmp_path / f"a.{kind}")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000


def test_a_format_whose_library_is_absent_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag, table = written.rosbag1(tmp_path), written.hdf5(tmp_path)
    for name in ("rosbags.highlevel", "h5py"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(MeasurementError, match=r"needs rosbags: pip install 'ee_dist\[ros\]'"):
        read(bag)
    with pytest.raises(MeasurementError, match=r"needs h5py: pip install 'ee_dist\[hdf5\]'"):
        read(table)


def test_our_own_recording_needs_no_import(tmp_path: Path) -> None:
    from ee_dist.recording.writer import RunWriter
    from ee_dist.robots.servo_pendulum import servo_pendulum

    with RunWriter(tmp_path / "own.mcap", servo_pendulum(), {"task": "trial"}):
        pass
    with pytest.raises(MeasurementError, match=r"is a recording of ours already; use it as it is: measured="):
        read(tmp_path / "own.mcap")


def test_arrays_beside_an_object_of_matlab_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SciPy lists no shapes of a file that holds a timeseries, and reads the arrays beside it."""
    path = tmp_path / "run.mat"
    io.savemat(path, {"t": np.arange(5.0), "q": np.ones(5)})

    def without_shape(_: str) -> list[tuple[str, tuple[int, ...], str]]:
        raise TypeError("'NoneType' object is not iterable")

    monkeypatch.setattr(matlab_apart, "whosmat", without_shape)
    with np.load(BytesIO(matlab_apart.answer(str(path), 10**6))) as found:
        said = json.loads(found["said"].tobytes())
        ((_, columns),) = said["trials"]
        assert found[str(columns["t"][0])].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
