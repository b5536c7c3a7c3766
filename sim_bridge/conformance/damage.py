"""Damages datagrams at random."""

import random


def damaged(datagram: bytes, draw: random.Random) -> bytes:
    """Return a datagram with bits turned, bytes cut out, doubled or replaced."""
    data = bytearray(datagram)
    for _ in range(draw.randint(1, 6)):
        place = draw.randrange(len(data) + 1)
        match draw.randrange(5):
            case 0 if place < len(data):
                data[place] ^= 1 << draw.randrange(8)
            case 1 if place < len(data):
                data[place] = draw.choice((0, 0x7F, 0x80, 0xFF, draw.randrange(256)))
            case 2:
                del data[place : place + draw.randint(1, 16)]
            case 3:
                data[place:place] = draw.randbytes(draw.randint(1, 16))
            case _:
                del data[place:]
    return bytes(data)
