"""Messages to JSON bytes and back; refuses a message that does not fit its key."""

from functools import cache

import msgspec

from groundstation.bus.keys import Key
from groundstation.bus.messages import Header, Message
from groundstation.errors import MessageError

_encoder = msgspec.json.Encoder()
_header_decoder = msgspec.json.Decoder(Header)


@cache
def _decoder(message_type: type[Message]) -> msgspec.json.Decoder[Message]:
    return msgspec.json.Decoder(message_type)


def encode(message: Message | Header) -> bytes:
    """Return the JSON form of a message, or of the header that accompanies raw bytes."""
    return _encoder.encode(message)


def decode(key: Key, payload: bytes) -> Message:
    """Return the message under a key of a typed topic.

    Raises MessageError (malformed, header_mismatch) when the bytes or the header contradict the key.
    """
    if key.topic.type is None:
        raise MessageError("untyped_topic", str(key))
    try:
        message = _decoder(key.topic.type).decode(payload)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise MessageError("malformed", f"{key}: {error}") from error
    _check_header(key, message.header)
    return message


def decode_header(key: Key, attachment: bytes) -> Header:
    """Return the header that accompanies raw bytes; raises MessageError as `decode` does."""
    try:
        header = _header_decoder.decode(attachment)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        raise MessageError("malformed", f"{key}: {error}") from error
    _check_header(key, header)
    return header


def _check_header(key: Key, header: Header) -> None:
    if header.entity != key.entity or header.source != key.source:
        raise MessageError("header_mismatch", f"{key} carries {header.entity}/{header.source}")
