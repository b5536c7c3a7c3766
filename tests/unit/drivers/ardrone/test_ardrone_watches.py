"""The driver's measures against foreign ultrasound and host scans; versions and dumps. No I/O."""

import pytest

from drivers.ardrone.dump import category, differences, parse_dump
from drivers.ardrone.height import HeightWatch
from drivers.ardrone.identity import Identity, Model, identity_from_dump, identity_from_version, model_from_navdata
from drivers.ardrone.rate_watch import RateWatch
from drivers.ardrone.uplink_watch import UplinkWatch
from drivers.ardrone.wire.navdata import Navdata

MS = 1_000_000


def heights(values, period_ms=15):
    watch = HeightWatch()
    return watch, [watch.accept(i * period_ms * MS, value) for i, value in enumerate(values)]


def test_a_take_off_is_let_through():
    """The recorded take-off: 0.27 m first, 0.62 m 0.41 s later, 0.82 m at its peak."""
    rise = [0.274 + 0.342 * i / 27 for i in range(28)] + [0.62 + 0.2 * i / 30 for i in range(30)]
    watch, let = heights(rise)
    assert all(let) and watch.refused == 0


@pytest.mark.parametrize("jump", [0.4, 1.5, -0.5])
@pytest.mark.parametrize("length", [1, 5, 20])
def test_echoes_of_another_drone_are_held_back(jump, length):
    watch, let = heights([0.8] * 50 + [0.8 + jump] * length + [0.8] * 10)
    assert let == [True] * 50 + [False] * length + [True] * 10 and watch.refused == length


def test_scattered_echoes_never_become_the_truth():
    watch, let = heights([0.8] * 10 + [0.8, 2.0, 0.8, 1.5] * 100)
    assert watch.refused == 200 and watch.steps == 0 and let[-4:] == [True, False, True, False]


def test_a_new_level_that_stays_is_believed_after_a_while():
    watch, let = heights([1.5] * 20 + [0.7] * 60)
    assert watch.steps == 1 and let[20:45] == [False] * 25 and all(let[50:])


def rates(watch, values):
    return [watch.step(i * 200 * MS, value) for i, value in enumerate(values)]


def test_a_scan_is_told_once_with_its_remedy_and_its_end():
    told = rates(RateWatch(), [198.0] * 10 + [60, 8, 5, 5, 5, 5, 9] + [198.0] * 10)
    first, second = [notice for notice in told if notice is not None]
    assert "fell from 198 to 5 Hz" in first.text and "scan" in first.remedy and first.severity == "WARNING"
    assert "back at 198 Hz" in second.text


def told_by(watch, numbers, flies=True, sent=1000):
    """Feed a number each 20 ms."""
    told = []
    for i, number in enumerate(numbers):
        watch.hear(i * 20 * MS, number, sent)
        told.append(watch.step(i * 20 * MS, flies))
    return [notice for notice in told if notice is not None]


def test_a_cut_of_the_uplink_is_told_with_its_end():
    first, second = told_by(UplinkWatch(), [*range(1, 50), *[49] * 40, *range(90, 100)])
    assert "obeyed no command for 0.5 s" in first.text and first.severity == "WARNING" and first.remedy
    assert "again after 0.8 s" in second.text


def test_drones_that_stand_and_those_that_never_count_lose_no_commands():
    assert not told_by(UplinkWatch(), [*range(1, 50), *[49] * 100], flies=False)
    assert not told_by(UplinkWatch(), [0] * 200)
    assert not told_by(UplinkWatch(), [*range(1, 50), *[49] * 20, *range(60, 90)])


def test_commands_of_another_program_are_none_of_ours():
    watch = UplinkWatch()
    first, second = told_by(watch, [*range(1, 50), *range(5000, 5100)])
    assert "it obeys commands that are not ours" in first.text and first.remedy
    assert "obeyed no command for 0.5 s" in second.text and watch.foreign and watch.cut


def test_another_program_is_found_between_our_commands_and_told_when_it_is_gone():
    watch, turns = UplinkWatch(), [n for i in range(1, 50) for n in (i, 5000 + i)]
    first, second = told_by(watch, [*turns, *range(50, 400)])
    assert "not ours" in first.text and "no other program" in second.text and not watch.foreign


def test_numbers_from_before_us_and_those_of_a_firmware_that_counts_otherwise_are_nobodys():
    assert not told_by(UplinkWatch(), [500_000] * 50 + [3, 4, 500_001, *range(5, 50)])
    assert not told_by(UplinkWatch(), range(100_000, 100_400))


def test_one_late_second_and_slow_streams_are_no_scan():
    assert not any(rates(RateWatch(), [200, 200, 70, 200, 120, 200] * 5))
    assert not any(rates(RateWatch(), [15.0] * 10 + [4.0] * 10)), "demo navdata never was fast"


@pytest.mark.parametrize(
    ("text", "model", "ids"),
    [
        ("2.3.3\n", Model.AR2, True),
        ("2.4.8", Model.AR2, True),
        ("1.7.4", Model.AR1, True),
        ("1.5.1", Model.AR1, False),
        ("1.10.10", Model.AR1, True),
        ("", Model.UNKNOWN, True),
        ("<html>", Model.UNKNOWN, True),
        ("9.1", Model.UNKNOWN, True),
    ],
)
def test_versions(text, model, ids):
    identity = identity_from_version(text)
    assert identity.model is model and identity.has_ids is ids


def test_the_board_tells_the_generation_when_the_firmware_does_not():
    assert identity_from_dump({"general:num_version_mb": "17"}).model is Model.AR1
    assert identity_from_dump({"general:num_version_mb": "34"}).model is Model.AR2
    assert identity_from_dump({"general:num_version_mb": "33", "general:drone_serial": "PS7"}).text.endswith(
        "serial PS7"
    )
    assert identity_from_dump({}) == Identity()


def test_navdata_tells_the_generation_by_its_options():
    assert model_from_navdata(Navdata(0, 1, 1, ((0, b"\0" * 144), (16, b"\0" * 324)))) is Model.AR2
    assert model_from_navdata(Navdata(0, 1, 1, ((0, b"\0" * 144), (16, b"\0" * 116)))) is Model.AR1
    assert model_from_navdata(Navdata(0, 1)) is Model.UNKNOWN


def test_dumps_are_read_with_wrapped_values_and_compared_by_meaning():
    text = (
        b"control:euler_angle_max = 2.0943999e-01\ncontrol:outdoor = FALSE\n"
        b"control:gyros_gains = { 1.0\n2.0 }\ngeneral:ardrone_name = My = Drone: one\ncustom:session_id = 12e45678\n\0"
    )
    stored = parse_dump(text)
    assert stored["control:gyros_gains"] == "{ 1.0 2.0 }" and stored["general:ardrone_name"] == "My = Drone: one"
    bare = parse_dump(b"network:secure = FALSE\nnetwork:passkey =\nnetwork:at_port = 5556\n")
    assert bare == {"network:secure": "FALSE", "network:passkey": "", "network:at_port": "5556"}
    same = (("control:euler_angle_max", "0.20944"), ("control:outdoor", "false"), ("general:unheard_of", "1"))
    assert differences(same, stored) == ()
    other = (("control:euler_angle_max", "0.2"), ("custom:session_id", "99e99999"))
    assert [key for (key, _), _ in differences(other, stored)] == [key for key, _ in other]
    assert category("control:euler_angle_max") == "profiles" and category("no:such") == ""
