"""Valid addresses for a second ground station: existing address and port, and not on the vehicle's own link."""

from dataclasses import replace

import pytest
from pydantic import ValidationError

from drivers.mavlink.kind import KIND, Mavlink
from drivers.mavlink.settings import VehicleSettings
from sim_bridge.conformance.subject import subject_of


@pytest.mark.parametrize("wrong", ["udp:127.0.0.1:99999", "udp:127.0.0.1:0", "udp:300.1.1.1:14550", "tcp:127.0.0.1:1"])
def test_invalid_forward_addresses_are_refused(wrong: str) -> None:
    with pytest.raises(ValidationError, match=r"port|address|must be udp:ADDRESS:PORT"):
        Mavlink(flavour="px4", system_id=1, forward=wrong)
    with pytest.raises(ValidationError, match=r"port|address|must be udp:ADDRESS:PORT"):
        VehicleSettings(name="v", system_id=1, flavour="px4", forward=wrong)
    assert Mavlink(flavour="px4", system_id=1, forward="udp:127.0.0.1:14550").forward


@pytest.mark.parametrize("listen", [False, True])
def test_a_link_that_would_hear_itself_is_refused(listen: bool) -> None:
    subject = subject_of("mavlink", ["mavlink.flavour=px4", "mavlink.port=14777", f"mavlink.listen={listen}".lower()])
    own = "127.0.0.1" if listen else subject.address
    for port, texts in ((14777, ["is the vehicle's own link"]), (14778, [])):
        section = subject.sections["mavlink"].model_copy(update={"forward": f"udp:{own}:{port}"})
        found = list(KIND.check([replace(subject.order(), sections={"mavlink": section})]))
        assert [text[:25] for _, (_, text) in found] == texts
