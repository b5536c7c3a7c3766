"""Tables of a run as CSV or Parquet files, with the units of their columns in `columns.csv`."""

import csv
import json
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any, Protocol

from groundstation.errors import MessageError
from groundstation.recording.chunks import RawRecord
from groundstation.recording.outputs import new_folder
from groundstation.recording.reader import decode, payload
from groundstation.recording.run import RecordedRun
from groundstation.recording.tables import COMMON, Cell, Row, Table, column, tables_of
from groundstation.time_units import NS_PER_S

_BATCH_ROWS = 20_000
_COLUMNS_FILE = "columns.csv"


class TableFile(Protocol):
    """A file of rows."""

    def add(self, row: Row) -> None:
        """Add a row, with the common columns first."""

    def close(self) -> None:
        """Write the remaining rows; raises OSError when the disk is full."""


class CsvFile:
    """Comma-separated, a header line, empty cells for unknown values, lists of numbers as JSON."""

    SUFFIX = ".csv"

    def __init__(self, path: Path, table: Table) -> None:
        self._stream: IO[str] = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._stream)
        columns = (*COMMON, *table.columns)
        self._lists = [number for number, column in enumerate(columns) if column.cell is Cell.REALS]
        self._flags = [number for number, column in enumerate(columns) if column.cell is Cell.FLAG]
        self._writer.writerow([column.name for column in columns])

    def add(self, row: Row) -> None:
        """Add a row."""
        for number in self._lists:
            row[number] = None if row[number] is None else json.dumps(row[number])
        for number in self._flags:
            row[number] = None if row[number] is None else int(row[number])
        self._writer.writerow(row)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


class ParquetFile:
    """Parquet with typed columns; each column's unit is in its metadata."""

    SUFFIX = ".parquet"

    def __init__(self, path: Path, table: Table) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        kinds = {
            Cell.REAL: pa.float64(),
            Cell.WHOLE: pa.int64(),
            Cell.FLAG: pa.bool_(),
            Cell.TEXT: pa.string(),
            Cell.REALS: pa.list_(pa.float64()),
        }
        columns = (*COMMON, *table.columns)
        self._schema = pa.schema(
            [pa.field(one.name, kinds[one.cell], metadata={"unit": one.unit} if one.unit else None) for one in columns]
        )
        self._batch_of: Any = pa.RecordBatch.from_arrays
        self._array: Any = pa.array
        self._stream = path.open("wb")  # the library takes no name that is not UTF-8
        self._writer = pq.ParquetWriter(self._stream, self._schema, compression="zstd")
        self._rows: list[Row] = []

    def add(self, row: Row) -> None:
        """Add a row."""
        self._rows.append(row)
        if len(self._rows) >= _BATCH_ROWS:
            self._flush()

    def _flush(self) -> None:
        if self._rows:
            cells = zip(*self._rows, strict=True)
            arrays = [self._array(list(one), field.type) for one, field in zip(cells, self._schema, strict=True)]
            self._writer.write_batch(self._batch_of(arrays, schema=self._schema))
            self._rows.clear()

    def close(self) -> None:
        """Write the remaining rows and the footer."""
        try:
            self._flush()
            self._writer.close()
        finally:
            self._stream.close()


# The columns of raw topics: time and size.
_SIZES = (column("payload_bytes", Cell.WHOLE),)


class _Writer:
    """Opens a file for each table when its first row comes."""

    def __init__(self, folder: Path, kind: type[CsvFile] | type[ParquetFile], start_ns: int, stack: ExitStack) -> None:
        self._folder, self._kind, self._start_ns, self._stack = folder, kind, start_ns, stack
        self._files: dict[str, TableFile] = {}
        self.counts: dict[str, int] = {}
        self.units: list[tuple[str, str, str]] = []

    def add(self, raw: RawRecord) -> None:
        """Add a message to its tables; raises MessageError when it does not decode."""
        key = raw.key
        common = [(raw.log_time_ns - self._start_ns) / NS_PER_S, raw.log_time_ns, key.entity, key.source]
        if key.topic.type is None:
            header, data = payload(raw)
            self._put(Table(key.topic.name, _SIZES, list), [*common, header.seq, len(data)])
            return
        message = decode(raw).message
        for table in tables_of(key.topic):
            for row in table.rows(message):
                self._put(table, [*common, message.header.seq, *row])

    def _put(self, table: Table, row: Row) -> None:
        file = self._files.get(table.name)
        if file is None:
            name = f"{table.name}{self._kind.SUFFIX}"
            file = self._files[table.name] = self._kind(self._folder / name, table)
            self._stack.callback(file.close)
            self.units += [(name, one.name, one.unit) for one in (*COMMON, *table.columns)]
        file.add(row)
        self.counts[table.name] = self.counts.get(table.name, 0) + 1


def write_tables(
    run: RecordedRun, folder: Path, kind: type[CsvFile] | type[ParquetFile]
) -> tuple[dict[str, int], list[str]]:
    """Write all topics of a run into a new folder; returns rows by table, and decoding errors.

    Raises OperatorMistake when the folder exists or cannot be there, OutputError when the disk is full.
    Nothing is left behind then.
    """
    unread: dict[str, None] = {}
    with new_folder(folder), ExitStack() as stack:
        writer = _Writer(folder, kind, run.start_ns, stack)
        for raw in run.records_from(run.start_ns):
            try:
                writer.add(raw)
            except MessageError as error:
                unread[str(error)] = None
        with (folder / _COLUMNS_FILE).open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([("file", "column", "unit"), *writer.units])
    return writer.counts, list(unread)
