"""CSV as loggers write it: any separator, encoding and decimal sign, no header, blank lines, units in a second line, lists."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.readers import read
from ee_dist.measurements.readers.options import Options
from ee_dist.measurements.table import Table
from ee_dist.robots.linear_stage import linear_stage

T = np.arange(50) * 0.001
X = 0.1 * np.sin(20 * T)
ROWS = [(f"{t:.3f}", f"{x:.6f}") for t, x in zip(T, X, strict=True)]


def table(folder: Path, content: str | bytes, options: Options = Options()) -> Table:  # noqa: B008
    file = folder / "a.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    (recorded,) = read(file, options)
    return recorded.tables[0]


def lines(separator: str = ",", header: str | None = "t,x", decimal: str = ".") -> str:
    body = [separator.join(v.replace(".", decimal) for v in row) for row in ROWS]
    return "\n".join(([header.replace(",", separator)] if header else []) + body) + "\n"


@pytest.mark.parametrize("separator", [",", ";", "\t", "|", " "])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("header", ["t,x", None])
def test_separators_and_decimal_signs_are_seen(
    tmp_path: Path, separator: str, decimal: str, header: str | None
) -> None:
    if (separator, decimal) == (",", ","):
        pytest.skip("cannot be told apart")
    found = table(tmp_path, lines(separator, header, decimal))
    time, x = ("t", "x") if header else ("1", "2")
    assert np.array_equal(found.numbers(time), np.round(T, 3))
    assert np.array_equal(found.numbers(x), [float(r[1]) for r in ROWS])
    assert any("decimal commas" in n for n in found.notes) == (decimal == ",")


def test_decimal_commas_between_commas_get_a_hint(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=r"row 2: 4 cells; the rows above have 2; decimal commas need another"):
        table(tmp_path, lines(",", "t,x", ","))
    found = table(tmp_path, 't,x\n"0,001","1,5"\n"0,002","oops"\n', Options(decimal="."))
    with pytest.raises(MeasurementError, match=r"row 2, column 't': '0,001' is not a number; a decimal comma"):
        found.numbers("t")


def test_blank_lines_and_remarks_keep_the_numbers_of_lines(tmp_path: Path) -> None:
    found = table(tmp_path, "# made by a logger\nt,x\n\n0.0,1\n\n\n0.1,oops\n\n,,\n".replace(",,\n", ",\n"))
    assert len(found) == 2
    with pytest.raises(MeasurementError, match=r"row 7, column 'x': 'oops'"):
        found.numbers("x")


def test_what_stands_above_a_table_is_left_out_and_said(tmp_path: Path) -> None:
    above = "Robot log v1.2\nDate: 2025-03-17, operator: me\nserial;1234\n"
    found = table(tmp_path, above + "t,x,y,z\n0.0,1,2,3\n0.1,4,oops,6\n0.2,7,8,9\n")
    assert len(found) == 3
    assert any("above the table: 'Robot log v1.2' and more" in n for n in found.notes)
    with pytest.raises(MeasurementError, match=r"row 6, column 'y': 'oops'"):
        found.numbers("y")


@pytest.mark.parametrize("content", ["t,x\n0.0,1,2\n0.1,4,5\n0.2,7,8\n", "t\n0.0,1,2\n0.1\n0.2,7,8\n"])
def test_a_table_of_rows_that_differ_is_no_table_with_something_above(tmp_path: Path, content: str) -> None:
    with pytest.raises(MeasurementError, match=r"row 2: 3 cells; the rows above have"):
        table(tmp_path, content)


def test_a_header_in_a_remark_as_savetxt_writes_it(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "b.csv", np.stack([T, X], axis=1), header="t x")
    found = read(tmp_path / "b.csv")[0].tables[0]
    assert np.array_equal(found.numbers("x"), X)


def test_latin_1_and_utf_16(tmp_path: Path) -> None:
    text = lines(",", "Zeit_µs,Drehmoment_größe")
    assert np.array_equal(table(tmp_path, text.encode("latin-1")).numbers("Zeit_µs"), np.round(T, 3))
    assert np.array_equal(table(tmp_path, text.encode("utf-16")).numbers("Zeit_µs"), np.round(T, 3))
    with pytest.raises(MeasurementError, match=r"not a text file"):
        table(tmp_path, b"\x7fELF\x00\x01\x02")


def test_units_in_the_second_line(tmp_path: Path) -> None:
    found = table(tmp_path, lines(";", "t;x").replace("t;x\n", "t;x\n[s];[mm]\n"))
    assert found.units == {"t": "s", "x": "mm"}
    assert len(found) == 50


@pytest.mark.parametrize("cells", ['"[{}, {}, 3]"', "[{}, {}, 3]", "[{} {} 3]", '"({}; {}; 3)"'])
def test_lists_in_cells(tmp_path: Path, cells: str) -> None:
    found = table(tmp_path, "t,positions\n" + "".join(f"{a},{cells.format(a, b)}\n" for a, b in ROWS))
    assert np.array_equal(found.numbers("positions[1]"), [float(r[1]) for r in ROWS])
    assert list(found.addresses()) == ["t", "positions[0]", "positions[1]", "positions[2]"]
    with pytest.raises(MeasurementError, match=r"'positions' holds 3 numbers in each row; say which"):
        found.numbers("positions")
    with pytest.raises(MeasurementError, match=r"'positions' has no \[3\]"):
        found.numbers("positions[3]")
    with pytest.raises(MeasurementError, match=r"holds one number in each row"):
        found.numbers("t[0]")


def test_a_list_that_is_shorter_in_one_row(tmp_path: Path) -> None:
    found = table(tmp_path, 't,q\n0,"[1, 2]"\n1,"[1]"\n')
    with pytest.raises(MeasurementError, match=r"row 3, column 'q' holds 1 numbers, so there is no \[1\]"):
        found.numbers("q[1]")


def test_two_columns_of_one_name(tmp_path: Path) -> None:
    found = table(tmp_path, "t,q,q\n0,1,2\n1,3,4\n")
    with pytest.raises(MeasurementError, match=r"2 columns are named 'q'; say which: '#2' or '#3'"):
        found.numbers("q")
    assert found.numbers("#3").tolist() == [2, 4]


def test_rows_of_another_length_are_named(tmp_path: Path) -> None:
    with pytest.raises(MeasurementError, match=r"row 3: 3 cells; the rows above have 2"):
        table(tmp_path, "t,x\n0,1\n0,1,2\n")
    assert len(table(tmp_path, "t,x\n0,1,\n1,2,\n")) == 2


def test_columns_by_number_through_a_mapping(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "\n".join(f"{1e6 * t:.0f} {float(x)!r} {float(x)!r}" for t, x in zip(T, X, strict=True))
    )
    mapping = {
        "time": {"column": 1, "unit": "µs"},
        "sensors": {"position": {"column": 2, "unit": "m"}},
        "commands": {"carriage": {"column": 3, "unit": "m"}},
    }
    record, report = import_file(tmp_path / "a.csv", mapping_of(mapping, Path("map.yaml")), linear_stage())
    assert np.array_equal(record.log.sensors[:, 0], X)
    assert any("no header" in d for d in report.done)
