"""Ways to damage bytes and JSON documents."""

import random
import re
import struct

Random = random.Random

_NUMBERS = (
    *(b"0", b"1", b"-1", b"0.5", b"-0.0", b"1e999", b"-1e300", b"1e-400", b"1" + b"0" * 400),
    *(b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808"),
)
_VALUES = (
    *(b"null", b"true", b"[]", b"{}", b'""', b'"' + b"x" * 60 + b'"', b"NaN", b"Infinity", b"[[[["),
    *(b"[1,2,3]", b'{"a":1}', b'"\\ud800"', *_NUMBERS),
)
_TOKEN = re.compile(rb'"(?:[^"\\]|\\.)*"|-?\d[\d.eE+-]*|true|false|null|[\[\]{}:,]')


def damaged_json(rng: Random, good: bytes) -> bytes:
    """Replace, drop or repeat one or two words of a document; or damage its bytes."""
    words = _TOKEN.findall(good)
    if not words or rng.random() < 0.4:
        return bytes(damaged_bytes(rng, good, b'"{}[],:0-e\\'))
    for _ in range(rng.randint(1, 2)):
        place = rng.randrange(len(words))
        match rng.randrange(6):
            case 0:
                del words[place]
                words = words or [b"{}"]
            case 1:
                words.insert(place, rng.choice(words))
            case 2:
                words[place] = rng.choice(words)
            case 3:
                words[place] = rng.choice(_VALUES)
            case _:
                numbers = [at for at, word in enumerate(words) if word[:1].isdigit()]
                words[rng.choice(numbers or [place])] = rng.choice(_NUMBERS)
    return b"".join(words)


def damaged_bytes(rng: Random, good: bytes, favourites: bytes = b"") -> bytearray:
    """Change, cut, lengthen, repeat or swap some bytes; favourites: values with a meaning for the decoder."""
    data = bytearray(good)
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(data) or 1)
        match rng.randrange(8):
            case 0 | 1 | 2:
                data[place : place + 1] = bytes([rng.randrange(256)])
            case 3:
                data[place : place + 1] = rng.choice(
                    (b"\0", b"\xff", b"\x7f", b"\x80", *(bytes([b]) for b in favourites))
                )
            case 4:
                del data[place:]
            case 5:
                data += rng.randbytes(rng.randrange(1, 20))
            case 6:
                data[place:place] = data[place : place + rng.randrange(1, 12)]
            case 7:
                data[place : place + 4] = struct.pack(
                    "<I", rng.choice((0, 1, 0xFFFF, 0x7FC00000, 0x7F800000, 2**31, 2**32 - 1))
                )
    return data
