"""State words of real drones, and every bit and phase against docs/reference/ardrone.md 4.1."""

import re
from pathlib import Path

import pytest

from drivers.ardrone.wire import state
from drivers.ardrone.wire.state import ControlState, StateBit, bit_names, join_control_state, split_control_state

SHEET = (Path(__file__).parents[4] / "docs" / "reference" / "ardrone.md").read_text(encoding="utf-8")
TABLE = SHEET.partition("### 4.1 State word")[2].partition("### 4.2")[0]
ROWS = [(int(bit), name) for bit, name in re.findall(r"^\|(\d+)\|([A-Z_]+)", TABLE, re.MULTILINE)]
PHASES = (
    "DEFAULT", "INIT", "LANDED", "FLYING", "HOVERING", "TEST", "TRANS_TAKEOFF", "TRANS_GOTOFIX", "TRANS_LANDING",
    "TRANS_LOOPING",
)  # fmt: skip
BRINGS_DOWN = {12: "MOTORS", 14: "SOFTWARE_FAULT", 15: "VBAT_LOW", 19: "ANGLES_OUT_OF_RANGE", 22: "CUTOUT",
               31: "EMERGENCY"}  # fmt: skip


def test_every_bit_stands_where_the_sheet_has_it():
    assert [bit for bit, _ in ROWS] == list(range(32))
    assert [(int(bit).bit_length() - 1, bit.name) for bit in StateBit] == ROWS
    assert all(bit == 2 ** (int(bit).bit_length() - 1) for bit in StateBit)


@pytest.mark.parametrize(("bit", "name"), BRINGS_DOWN.items())
def test_each_emergency_bit_has_its_name(bit, name):
    assert bit_names(2**bit) == (name,)


@pytest.mark.parametrize(
    ("word", "bits"),
    [
        (0x4F8000D0, (4, 6, 7, 23, 24, 25, 26, 27, 30)),
        (0x0F8004F5, (0, 2, 4, 5, 6, 7, 10, 23, 24, 25, 26, 27)),
        (0xCFCA0854, (2, 4, 6, 11, 17, 19, 22, 23, 24, 25, 26, 27, 30, 31)),
        (0x0F800000, (23, 24, 25, 26, 27)),
        (0, ()),
    ],
)
def test_words_of_real_drones(word, bits):
    assert bit_names(word) == tuple(dict(ROWS)[bit] for bit in bits)
    assert state.HEALTHY == 0x0F800000


def test_phases_and_minor_states_are_numbered_as_on_the_sheet():
    assert [phase.name for phase in ControlState] == list(PHASES)
    for number, name in enumerate(PHASES):
        phase, minor = split_control_state(number * 0x10000 + 0xFFFF)
        assert (phase.name, minor) == (name, 0xFFFF)
        assert join_control_state(phase, 0xFFFF) == number * 0x10000 + 0xFFFF
        assert join_control_state(phase) == number * 0x10000
    assert split_control_state(10 * 0x10000 + 3) == (ControlState.DEFAULT, 3)
    minors = (state.TAKE_OFF_AUTO, state.FLYING_COMBINED_YAW, state.HOVERING_LOST_COM, state.HOVERING_MAGNETO_CALIB)
    assert minors == (1, 4, 8, 12)
    assert join_control_state(ControlState.INIT, 0x12345) == 0x12345
