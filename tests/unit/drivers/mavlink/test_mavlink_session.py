"""Reading parameters: one that a firmware does not know is named, and hides none of the others."""

from drivers.mavlink.parameters import needed
from drivers.mavlink.requests import Requests
from drivers.mavlink.session import MavlinkSession
from drivers.mavlink.settings import GlobalOrigin
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import REAL32
from drivers.mavlink.wire.service import ParamRequestRead, ParamValue

MS = 1_000_000


def read_all(strange: set[str], seconds: float) -> MavlinkSession:
    """A vehicle that answers for every parameter but the strange ones."""
    session, requests = MavlinkSession(1, Flavour.ARDUPILOT, {}, 255, GlobalOrigin()), Requests(1)
    values = {n.name: n.value for n in needed(Flavour.ARDUPILOT, 255)}
    for turn in range(round(seconds * 100)):
        for message in session.step(10_000 * MS + turn * 10 * MS, 0, requests):
            if isinstance(message, ParamRequestRead) and message.param_id not in strange:
                session.hear_parameter(ParamValue(message.param_id, values[message.param_id], REAL32, 1, 0))
    return session


def test_unknown_parameters_do_not_hide_the_others() -> None:
    first = [n.name for n in needed(Flavour.ARDUPILOT, 255)][:5]
    assert read_all(set(first), 15.0).unread == first
    assert read_all(set(), 5.0).unread == []


def test_a_parameter_that_is_never_answered_is_named_with_the_firmware() -> None:
    session = read_all({"GPS1_TYPE"}, 3.0)
    assert session.detail(Requests(1)) == "reading parameter GPS1_TYPE"
    session = read_all({"GPS1_TYPE"}, 15.0)
    assert "does not know parameter GPS1_TYPE" in session.detail(Requests(1))
