"""Allowed parameter values: by value, range and other parameters; and differing values of the field file."""

import pytest

from drivers.mavlink.parameters import Needed, difference, fault, is_checked, needed, overridden, version_of
from drivers.mavlink.wire.names import Flavour


def of(name, flavour=Flavour.PX4, **overrides):
    return next(n for n in needed(flavour, 255, overrides) if name in n.names)


@pytest.mark.parametrize(("value", "alive"), [(0, True), (1, False), (2, False), (3, False), (4, False)])
def test_a_transmitters_kill_switch_stays_alive(value, alive):
    text = difference(of("COM_RC_IN_MODE"), {"COM_RC_IN_MODE": value})
    assert (text == "") is alive
    assert alive or "kill and mode switches" in text


@pytest.mark.parametrize(("value", "good"), [(0.29, False), (0.3, True), (1.0, True), (1.01, False)])
def test_a_range_is_accepted_as_a_whole(value, good):
    assert (difference(of("COM_OF_LOSS_T"), {"COM_OF_LOSS_T": value}) == "") is good


@pytest.mark.parametrize(
    ("name", "factory", "wish"), [("EKF2_RNG_CTRL", 1, "0"), ("EKF2_NOAID_TOUT", 5_000_000, "500000 to 900000")]
)
def test_neither_a_distance_sensor_nor_dead_reckoning_may_stand_for_our_positions(name, factory, wish):
    assert difference(of(name), {name: factory}).startswith(f"{name} is {factory}, needs {wish} (")


def test_large_values_are_told_in_full():
    text = difference(of("ARMING_CHECK", Flavour.ARDUPILOT), {"ARMING_CHECK": 1})
    assert text.startswith("ARMING_CHECK is 1, needs 1048574 (")


def test_a_missing_parameter_is_named_with_its_needed_value():
    assert difference(of("EKF2_HGT_REF"), {}) == "EKF2_HGT_REF is missing, needs 3 (height comes from outside)"


def test_an_alias_is_named_as_it_was_read():
    text = difference(of("GPS1_TYPE", Flavour.ARDUPILOT), {"GPS_TYPE": 1})
    assert text == "GPS_TYPE is 1, needs 0 (no GPS indoors)"


@pytest.mark.parametrize(
    ("name", "good", "warned", "refused"),
    [("LAND_SPEED", 70, 50, 20), ("LAND_SPD_MS", 0.7, 0.5, 0.2), ("ARMING_SKIPCHK", 0, None, 4)],
)
def test_a_parameter_of_a_later_release_is_judged_by_its_own_unit(name, good, warned, refused):
    """ArduCopter 4.7 renamed both: m/s instead of cm/s, checks to skip instead of checks to perform."""
    wanted = of(name, Flavour.ARDUPILOT)
    assert difference(wanted, {name: good}) == ""
    assert fault(wanted, {name: refused}).startswith(f"{name} is {refused}, needs ")
    if warned is not None:
        assert difference(wanted, {name: warned}) and not fault(wanted, {name: warned})


def test_the_field_file_may_name_a_parameter_of_a_later_release():
    wanted = of("LAND_SPD_MS", Flavour.ARDUPILOT, LAND_SPD_MS=0.5)
    assert difference(wanted, {"LAND_SPD_MS": 0.5}) == "" and difference(wanted, {"LAND_SPD_MS": 0.7})
    assert "LAND_SPD_MS 0.5 instead of 0.6 to 1" in overridden(Flavour.ARDUPILOT, {"LAND_SPD_MS": 0.5})


def test_the_field_file_has_the_last_word_and_a_warning():
    wanted = of("EKF2_MAG_TYPE", EKF2_MAG_TYPE=0)
    assert difference(wanted, {"EKF2_MAG_TYPE": 0}) == ""
    assert difference(wanted, {"EKF2_MAG_TYPE": 5}) == "EKF2_MAG_TYPE is 5, needs 0 (as the field file says)"
    assert "EKF2_MAG_TYPE 0 instead of 5" in overridden(Flavour.PX4, {"EKF2_MAG_TYPE": 0})


def test_additional_parameters_are_checked_without_a_warning():
    assert difference(of("MPC_XY_VEL_MAX", MPC_XY_VEL_MAX=1.5), {"MPC_XY_VEL_MAX": 12}).startswith(
        "MPC_XY_VEL_MAX is 12"
    )
    assert overridden(Flavour.PX4, {"MPC_XY_VEL_MAX": 1.5, "COM_OF_LOSS_T": 0.5}) == ""


def test_only_releases_that_were_compared_count_as_checked():
    assert is_checked(Flavour.PX4, version_of(0x011001FF))
    assert not is_checked(Flavour.PX4, version_of(0x01110000))
    assert not is_checked(Flavour.ARDUPILOT, None)


@pytest.mark.parametrize(
    ("value", "differs", "forbids"), [(2, False, False), (3, False, False), (5, True, False), (1, True, True)]
)
def test_a_value_may_do_for_a_take_off_that_setup_changes_all_the_same(value, differs, forbids):
    wanted = Needed("FS_GCS_TIMEOUT", 2, "time", accepted=(2, 3), flown=(2, 10))
    assert bool(difference(wanted, {"FS_GCS_TIMEOUT": value})) is differs
    assert bool(fault(wanted, {"FS_GCS_TIMEOUT": value})) is forbids


@pytest.mark.parametrize(
    ("name", "value", "good"),
    [
        ("FS_EKF_THRESH", 0.0, False),
        ("FS_EKF_THRESH", 0.6, True),
        ("FS_EKF_THRESH", 0.8, True),
        ("FS_EKF_THRESH", 1.2, False),
        ("VISO_SCALE", 1.0, True),
        ("VISO_SCALE", 1.1, False),
        ("VISO_DELAY_MS", 10, True),
        ("VISO_DELAY_MS", 100, False),
        ("VISO_POS_X", 0.0, True),
        ("VISO_POS_Y", -0.1, False),
        ("VISO_POS_Z", 0.1, False),
        ("EKF2_EV_POS_X", 0.1, False),
        ("EKF2_EV_POS_Y", 0.0, True),
        ("EKF2_EV_POS_Z", -0.1, False),
    ],
)
def test_our_positions_are_used_as_they_are_and_their_loss_is_acted_upon(name, value, good):
    flavour = Flavour.PX4 if name.startswith("EKF2") else Flavour.ARDUPILOT
    assert (fault(of(name, flavour), {name: value}) == "") is good


@pytest.mark.parametrize(
    ("name", "good", "returns"),
    [
        ("FS_THR_ENABLE", (0, 3), (1, 2, 4, 5, 6)),
        ("BATT_FS_LOW_ACT", (0, 1, 7), (2, 3, 4, 6)),
        ("BATT_FS_CRT_ACT", (0, 1, 7), (2, 3, 4, 6)),
        ("COM_LOW_BAT_ACT", (0, 2), (3,)),
        ("NAV_DLL_ACT", (0, 1, 3), (2,)),
        ("COM_ACT_FAIL_ACT", (0, 1, 2), (3,)),
        ("COM_IMB_PROP_ACT", (-1, 0, 2), (1,)),
    ],
)
def test_no_failsafe_of_the_autopilot_flies_home(name, good, returns):
    flavour = Flavour.PX4 if name.startswith(("COM", "NAV")) else Flavour.ARDUPILOT
    assert not any(fault(of(name, flavour), {name: value}) for value in good)
    assert all("climb" in fault(of(name, flavour), {name: value}) for value in returns)


@pytest.mark.parametrize(("name", "best"), [("NAV_RCL_ACT", 3), ("COM_FLTT_LOW_ACT", 1)])
def test_returns_that_end_no_offboard_flight_or_come_from_the_factory_fly_with_a_warning(name, best):
    factory = {"NAV_RCL_ACT": 2, "COM_FLTT_LOW_ACT": 3}[name]
    assert not fault(of(name), {name: factory}) and "climb" in difference(of(name), {name: factory})
    assert not difference(of(name), {name: best})


@pytest.mark.parametrize(("value", "written"), [(0, 2), (32, 34), (33, 35), (544, 546)])
def test_sticks_of_other_ground_stations_are_ignored_and_other_bits_are_kept(value, written):
    wanted = of("RC_OPTIONS", Flavour.ARDUPILOT)
    text = fault(wanted, {"RC_OPTIONS": value})
    assert text.startswith(f"RC_OPTIONS is {value}, needs 2 in its sum (") and "another ground station" in text
    assert wanted.mending(value).value == written and not fault(wanted, {"RC_OPTIONS": written})
    assert wanted.takes(wanted.value) and wanted.mending(None).value == wanted.value


def test_the_field_file_may_allow_the_sticks_of_ground_stations():
    assert not fault(of("RC_OPTIONS", Flavour.ARDUPILOT, RC_OPTIONS=32), {"RC_OPTIONS": 32})
    assert "RC_OPTIONS 32 instead of 2 in its sum" in overridden(Flavour.ARDUPILOT, {"RC_OPTIONS": 32})


def test_a_vehicle_that_receives_a_transmitter_has_to_land_when_it_is_lost():
    (wanted,) = (n for n in needed(Flavour.ARDUPILOT, 255, receives=True) if n.name == "FS_THR_ENABLE")
    assert wanted.value == 3 and difference(wanted, {"FS_THR_ENABLE": 3}) == ""
    assert "lost transmitter" in difference(wanted, {"FS_THR_ENABLE": 0})
    assert not fault(wanted, {"FS_THR_ENABLE": 0}), "it flies, with a warning"
    assert all("climb" in fault(wanted, {"FS_THR_ENABLE": value}) for value in (1, 2, 4, 5, 6))
    (said,) = (n for n in needed(Flavour.ARDUPILOT, 255, {"FS_THR_ENABLE": 0}, receives=True) if n.name == wanted.name)
    assert difference(said, {"FS_THR_ENABLE": 0}) == ""
