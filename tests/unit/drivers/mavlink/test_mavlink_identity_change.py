"""A vehicle whose system id was changed in flight is named by its new one; another vehicle that was there is not."""

from drivers.mavlink.identity import Misfit
from drivers.mavlink.wire.names import Flavour

S = 1_000_000_000


def test_a_new_system_id_after_the_last_heartbeat_is_named():
    misfit = Misfit(Flavour.ARDUPILOT, 5)
    for second in range(10):
        misfit.take(second * S, Flavour.ARDUPILOT)
    assert misfit.words(9 * S) == ""
    misfit.take_stranger(10 * S, 6)
    assert misfit.words(10 * S) == "", "its next heartbeat is not late yet"
    assert misfit.words(11 * S) == "system 6 answers since it fell silent: was its system id changed?"
    misfit.take(12 * S, Flavour.ARDUPILOT)
    assert misfit.words(12 * S) == "", "it was another vehicle"


def test_a_vehicle_that_was_there_before_is_not_blamed():
    misfit = Misfit(Flavour.ARDUPILOT, 5)
    for second in range(10):
        misfit.take(second * S, Flavour.ARDUPILOT)
        misfit.take_stranger(second * S + S // 2, 7)
    misfit.take_stranger(12 * S, 7)
    assert misfit.words(12 * S) == ""
    misfit.take_stranger(12 * S, 6)
    misfit.take_stranger(13 * S, 7)
    assert "system 6" in misfit.words(13 * S)


def test_a_vehicle_that_was_never_heard_has_another_id():
    misfit = Misfit(Flavour.PX4, 5)
    misfit.take_stranger(S, 1)
    assert misfit.words(S) == "system 1 answers here, the field says 5: set mavlink.system_id"
