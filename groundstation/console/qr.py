"""QR codes for the terminal: bytes, error correction L, versions 1 to 5 (106 bytes), which are of one block each.

After ISO/IEC 18004; numbers of clauses are those of its edition of 2015.
"""

from collections.abc import Iterator
from itertools import pairwise

# Data and error correction codewords by version, level L (table 9), and the centre of the one alignment pattern.
_CODEWORDS = {1: (19, 7), 2: (34, 10), 3: (55, 15), 4: (80, 20), 5: (108, 26)}
_PRIMITIVE = 0x11D
_FORMAT_GENERATOR, _FORMAT_MASK = 0x537, 0x5412
_LEVEL_L = 0b01
_QUIET = 4
Matrix = list[list[bool]]


def qr_matrix(text: str) -> Matrix:
    """Return the modules of the smallest code that holds a text, True for dark; ValueError if there is none."""
    data = text.encode()
    version = next((v for v, (size, _) in _CODEWORDS.items() if len(data) <= size - 2), None)
    if version is None:
        raise ValueError(f"{len(data)} bytes are too many for this QR code")
    bits = list(_bits(_codewords(data, *_CODEWORDS[version])))
    candidates = [_masked(version, bits, mask) for mask in range(8)]
    return min(candidates, key=_penalty)


def qr_text(text: str) -> str:
    """Return a code for a dark or light terminal: two modules per character, drawn light on dark by escape codes."""
    matrix = qr_matrix(text)
    side = len(matrix) + 2 * _QUIET
    rows = [[False] * side for _ in range(side + side % 2)]
    for y, row in enumerate(matrix):
        rows[y + _QUIET][_QUIET : _QUIET + len(row)] = row
    glyphs = {(False, False): "\u2588", (False, True): "\u2580", (True, False): "\u2584", (True, True): " "}
    lines = ("".join(map(glyphs.__getitem__, zip(*rows[y : y + 2], strict=True))) for y in range(0, len(rows), 2))
    return "\n".join(f"\x1b[97;40m{line}\x1b[0m" for line in lines)


def _codewords(data: bytes, size: int, corrections: int) -> list[int]:
    """Return mode, length, data, padding (7.4) and the error correction (7.5)."""
    stream = f"0100{len(data):08b}{''.join(f'{byte:08b}' for byte in data)}"
    stream += "0" * min(4, 8 * size - len(stream))
    stream += "0" * (-len(stream) % 8)
    words = [int(stream[at : at + 8], 2) for at in range(0, len(stream), 8)]
    words += [(0xEC, 0x11)[n % 2] for n in range(size - len(words))]
    return words + _remainder(words, corrections)


def _times(a: int, b: int) -> int:
    product = 0
    while b:
        if b & 1:
            product ^= a
        a, b = a << 1 ^ (_PRIMITIVE if a & 0x80 else 0), b >> 1
    return product


def _remainder(words: list[int], count: int) -> list[int]:
    generator, root = [1], 1
    for _ in range(count):
        generator = [a ^ _times(b, root) for a, b in zip([*generator, 0], [0, *generator], strict=True)]
        root = _times(root, 2)
    rest = words + [0] * count
    for at in range(len(words)):
        factor = rest[at]
        for n, coefficient in enumerate(generator):
            rest[at + n] ^= _times(coefficient, factor)
    return rest[len(words) :]


def _bits(words: list[int]) -> Iterator[bool]:
    for word in words:
        for place in range(7, -1, -1):
            yield bool(word >> place & 1)


def _masked(version: int, bits: list[bool], mask: int) -> Matrix:
    side = 17 + 4 * version
    matrix: list[list[bool | None]] = [[None] * side for _ in range(side)]
    _draw_functions(matrix, version)
    _draw_format(matrix, mask)
    left = iter(bits)
    for x, y in _way(side):
        if matrix[y][x] is None:
            matrix[y][x] = next(left, False) ^ _inverts(mask, x, y)
    return [[bool(module) for module in row] for row in matrix]


def _way(side: int) -> Iterator[tuple[int, int]]:
    """Yield the places in their order (7.7.3): columns in pairs from the right, up and down by turns."""
    up = True
    for right in [*range(side - 1, 6, -2), *range(5, 0, -2)]:
        for y in range(side - 1, -1, -1) if up else range(side):
            yield right, y
            yield right - 1, y
        up = not up


def _inverts(mask: int, x: int, y: int) -> bool:
    """Return whether a mask (7.8.2) inverts a place."""
    return (
        (x + y) % 2,
        y % 2,
        x % 3,
        (x + y) % 3,
        (x // 3 + y // 2) % 2,
        x * y % 2 + x * y % 3,
        (x * y % 2 + x * y % 3) % 2,
        ((x + y) % 2 + x * y % 3) % 2,
    )[mask] == 0


def _draw_functions(matrix: list[list[bool | None]], version: int) -> None:
    side = len(matrix)
    for left, top in ((0, 0), (side - 7, 0), (0, side - 7)):
        for y in range(max(0, top - 1), min(side, top + 8)):
            for x in range(max(0, left - 1), min(side, left + 8)):
                ring = max(abs(x - left - 3), abs(y - top - 3))
                matrix[y][x] = ring not in (2, 4)
    if version > 1:
        centre = side - 7
        for y in range(centre - 2, centre + 3):
            for x in range(centre - 2, centre + 3):
                matrix[y][x] = max(abs(x - centre), abs(y - centre)) != 1
    for place in range(8, side - 8):
        matrix[6][place] = matrix[place][6] = place % 2 == 0


def _draw_format(matrix: list[list[bool | None]], mask: int) -> None:
    """Draw level and mask twice, with their own error correction (7.9), and the module that is always dark."""
    side, data = len(matrix), _LEVEL_L << 3 | mask
    rest = data << 10
    for place in range(14, 9, -1):
        if rest >> place & 1:
            rest ^= _FORMAT_GENERATOR << (place - 10)
    word = (data << 10 | rest) ^ _FORMAT_MASK
    around = [(8, y) for y in (0, 1, 2, 3, 4, 5, 7, 8)] + [(x, 8) for x in (7, 5, 4, 3, 2, 1, 0)]
    apart = [(side - 1 - n, 8) for n in range(8)] + [(8, side - 7 + n) for n in range(7)]
    for number in range(15):
        for x, y in (around[number], apart[number]):
            matrix[y][x] = bool(word >> number & 1)
    matrix[side - 8][8] = True


def _penalty(matrix: Matrix) -> int:
    """Return how hard a code is to read (7.8.3): long runs, blocks, finder-like patterns, unequal shares."""
    lines = [*matrix, *map(list, zip(*matrix, strict=True))]
    total = 0
    for line in lines:
        text = "".join("#" if module else "." for module in line)
        runs = [len(run) for run in text.replace("#.", "# .").replace(".#", ". #").split()]
        total += sum(run - 2 for run in runs if run >= 5)
        total += 40 * (text.count("#.###.#....") + text.count("....#.###.#"))
    for upper, lower in pairwise(matrix):
        total += 3 * sum(len({*upper[x : x + 2], *lower[x : x + 2]}) == 1 for x in range(len(upper) - 1))
    dark = sum(map(sum, matrix)) / len(matrix) ** 2
    return total + 10 * int(abs(dark - 0.5) * 20)
