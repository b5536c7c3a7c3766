"""Texts of both firmwares are told whole and once, with the time of their first piece."""

from collections import deque

import pytest

from drivers.mavlink.texts import Texts
from drivers.mavlink.wire.telemetry import Statustext
from groundstation.time_units import NS_PER_MS, NS_PER_S

S = NS_PER_S


def of_px4(text: str, number: int, severity: int = 4) -> list[Statustext]:
    """As streams/STATUSTEXT.hpp sends it: the text has its tab, the last piece may be full."""
    pieces = [text[at : at + 50] for at in range(0, len(text), 50)]
    return [Statustext(severity, piece, number, seq) for seq, piece in enumerate(pieces)]


def of_ardupilot(text: str, number: int, severity: int = 4) -> list[Statustext]:
    """As GCS::send_textv sends it: the last piece of a long text is never full."""
    if len(text) <= 50:
        return [Statustext(severity, text)]
    return [Statustext(severity, text[at : at + 50], number, at // 50) for at in range(0, len(text) + 1, 50)]


def told(texts: Texts, now_ns: int, pieces: list[Statustext]) -> list[str]:
    return [said.text for said in texts.whole(now_ns, deque((now_ns, piece) for piece in pieces))]


SIZES = (1, 49, 50, 51, 99, 100, 101, 150, 199, 249)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("number", [0, 1, 65535])
def test_a_text_of_any_length_is_told_within_half_a_second(size, number) -> None:
    for pieces in (of_px4("A" * size, number), of_ardupilot("A" * size, number or 1)):
        texts = Texts()
        assert told(texts, S, pieces) + told(texts, S + 500 * NS_PER_MS, []) == ["A" * size]
        assert told(texts, 2 * S, []) == [] and texts.reasons(S) == ["A" * size]


def test_texts_that_follow_at_once_stay_apart() -> None:
    px4 = [piece for n, size in enumerate(SIZES) for piece in of_px4(chr(65 + n) * size, n)]
    other = [piece for n, size in enumerate(SIZES, 1) for piece in of_ardupilot(chr(64 + n) * size, n)]
    for pieces in (px4, other):
        texts = Texts()
        assert told(texts, S, pieces) + told(texts, 2 * S, []) == [chr(65 + n) * size for n, size in enumerate(SIZES)]


def test_a_restarted_vehicle_that_uses_a_number_again_begins_a_new_text() -> None:
    texts = Texts()
    assert told(texts, S, of_px4("C" * 49 + "\t", 2)) == []
    assert told(texts, S + 1, of_px4("Failsafe activated\t", 2)) == ["C" * 49, "Failsafe activated"]


def test_a_lost_piece_is_left_out_and_no_text_gets_anothers_piece() -> None:
    texts, pieces = Texts(), of_px4("A" * 50 + "B" * 50 + "C" * 9, 3)
    assert told(texts, S, [pieces[0], pieces[2]]) == ["A" * 50 + "C" * 9]
    assert told(texts, S, [*pieces[1:], *of_px4("D\t", 4)]) == ["B" * 50 + "C" * 9, "D"]
    assert told(texts, S, [pieces[0], *of_px4("E\t", 4)]) == ["A" * 50, "E"]


def test_a_text_that_never_ends_is_cut() -> None:
    texts = Texts()
    endless = [Statustext(4, "A" * 50, 1, seq) for seq in range(16)]
    assert told(texts, S, endless) == ["A" * 400] * 2


def test_empty_texts_are_left_out_and_letters_of_two_bytes_fill_a_piece() -> None:
    texts = Texts()
    assert told(texts, S, [Statustext(4, ""), Statustext(4, " \t", 1, 0)]) == []
    assert told(texts, S, [Statustext(4, "\u00b0" * 25, 2, 0), Statustext(4, "end", 2, 1)]) == ["\u00b0" * 25 + "end"]


def test_a_text_keeps_the_severity_and_the_time_of_its_first_piece() -> None:
    texts = Texts()
    pieces = of_px4("A" * 60, 1, severity=2)
    assert texts.whole(S, deque([(S, pieces[0])])) == []
    assert texts.whole(S + 9, deque([(S + 9, pieces[1])])) == [(S, 2, "A" * 60)]


def test_a_reason_that_is_old_says_so() -> None:
    texts = Texts()
    told(texts, S, [Statustext(4, "Arm: gyros inconsistent")])
    told(texts, 18 * S, [Statustext(4, "Arm: not level")])
    assert texts.reasons(0, "arm", 20 * S) == ["Arm: gyros inconsistent (19 s ago)", "Arm: not level"]


def test_the_tab_at_the_end_of_a_px4s_text_is_not_told() -> None:
    assert told(Texts(), S, [Statustext(6, "Takeoff detected\t")]) == ["Takeoff detected"]
