"""The part of the protobuf wire format that viewer types need: writing messages and descriptors, and reading them.

WIRE (protobuf.dev, encoding; descriptor.proto): a field is a varint tag (number << 3 | wire type) and its value.
A library for this would be a dependency of every flight for some forty lines.
"""

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

_DOUBLE = struct.Struct("<d")
_VARINT, _FIXED64, _LENGTH, _FIXED32 = 0, 1, 2, 5
_OPTIONAL, _REPEATED = 1, 3


class Kind(IntEnum):
    """Types of fields, numbered as descriptor.proto does."""

    DOUBLE = 1
    INT64 = 3
    INT32 = 5
    FIXED32 = 7
    STRING = 9
    MESSAGE = 11
    BYTES = 12
    ENUM = 14


@dataclass(frozen=True, slots=True)
class ProtobufField:
    """One field of a type; `type_name` of messages and enumerations is absolute (`.foxglove.Vector3`)."""

    name: str
    number: int
    kind: Kind
    type_name: str = ""
    repeated: bool = False


@dataclass(frozen=True, slots=True)
class Type:
    """A message type, with at most one enumeration (name, value names counted from 0) inside."""

    package: str
    name: str
    fields: tuple[ProtobufField, ...]
    enum: tuple[str, tuple[str, ...]] | None = None


def varint(value: int) -> bytes:
    """Return a non-negative number below 2^64 as varint."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def integer(number: int, value: int) -> bytes:
    """Return a varint field."""
    return varint(number << 3 | _VARINT) + varint(value)


def double(number: int, value: float) -> bytes:
    """Return a field of a 64-bit float."""
    return varint(number << 3 | _FIXED64) + _DOUBLE.pack(value)


def fixed32(number: int, value: int) -> bytes:
    """Return a field of a 32-bit number of fixed size."""
    return varint(number << 3 | _FIXED32) + value.to_bytes(4, "little")


def blob(number: int, value: bytes) -> bytes:
    """Return a field of bytes, text in UTF-8, or an inner message."""
    return varint(number << 3 | _LENGTH) + varint(len(value)) + value


def fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield (number, value) of a message: numbers as int, everything else as bytes; ValueError when it is cut."""
    at = 0
    while at < len(data):
        tag, at = _read_varint(data, at)
        match tag & 7:
            case 0:
                value, at = _read_varint(data, at)
                yield tag >> 3, value
                continue
            case 1:
                size = 8
            case 2:
                size, at = _read_varint(data, at)
            case 5:
                size = 4
            case other:
                raise ValueError(f"wire type {other}")
        if at + size > len(data):
            raise ValueError("field is cut short")
        yield tag >> 3, data[at : at + size]
        at += size


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise ValueError("number is cut short")
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("number is too long")


def descriptor_set(types: Sequence[Type]) -> bytes:
    """Return the FileDescriptorSet of types: a file per package, the first importing all others before it."""
    packages = list(dict.fromkeys(kind.package for kind in types))
    out = b""
    for index, package in enumerate(packages):
        body = blob(1, _file(package)) + blob(2, package.encode())
        body += b"".join(blob(3, _file(earlier)) for earlier in packages[:index])
        body += b"".join(blob(4, _descriptor(kind)) for kind in types if kind.package == package)
        out += blob(1, body + blob(12, b"proto3"))
    return out


def _file(package: str) -> bytes:
    return f"{package.replace('.', '/')}/types.proto".encode()


def _descriptor(kind: Type) -> bytes:
    body = blob(1, kind.name.encode())
    for field in kind.fields:
        label = _REPEATED if field.repeated else _OPTIONAL
        inner = blob(1, field.name.encode()) + integer(3, field.number) + integer(4, label) + integer(5, field.kind)
        body += blob(2, inner + (blob(6, field.type_name.encode()) if field.type_name else b""))
    if kind.enum is not None:
        name, values = kind.enum
        listed = (blob(2, blob(1, text.encode()) + integer(2, number)) for number, text in enumerate(values))
        body += blob(4, blob(1, name.encode()) + b"".join(listed))
    return body
