"""A camera reads what the terminal shows."""

import cv2
import numpy as np
import pytest

from groundstation.console.qr import qr_matrix, qr_text


@pytest.mark.parametrize("length", [1, 17, 18, 32, 33, 53, 54, 78, 79, 106])
def test_a_reader_of_somebody_elses_reads_every_version(length: int) -> None:
    text = "".join(chr(33 + n * 7 % 90) for n in range(length))
    modules = np.array(qr_matrix(text))
    picture = np.kron(np.pad(~modules, 4, constant_values=True).astype(np.uint8) * 255, np.ones((6, 6), np.uint8))
    read, _, _ = cv2.QRCodeDetector().detectAndDecode(picture)
    assert read == text


def test_too_long_a_text_is_refused() -> None:
    with pytest.raises(ValueError, match="107 bytes"):
        qr_matrix("x" * 107)


def test_the_terminal_shows_the_code_with_its_quiet_zone() -> None:
    lines = [line.removeprefix("\x1b[97;40m").removesuffix("\x1b[0m") for line in qr_text("x").splitlines()]
    assert {len(line) for line in lines} == {21 + 8} and len(lines) == 15
    assert set(lines[0]) == {"\u2588"}
    shown = [[glyph in " \u2584" for glyph in line] for line in lines]
    assert [row[4:-4] for row in shown[2:-2]] == qr_matrix("x")[::2]
