"""Messages of strangers, on a vehicle's link or in the tracker's name, move nothing and are reported."""

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.wire.flight import CommandAckMessage
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.names import MavCmd
from groundstation.bus.memory_bus import MemoryBus
from groundstation.bus.messages import Lease, VelocitySetpoint
from groundstation.bus.topics import LEASE, SETPOINT


def test_frames_that_nothing_vouches_for_are_told(rig_of):
    rig = rig_of("ardupilot")
    rig.connect()
    rig.link.rejected.update(unsigned=20, signature=3, truncated=5)
    rig.run(1.0)
    assert "v refused 20 unsigned frames, 3 frames signed with another key" in rig.process.texts
    rig.link.rejected.update(unsigned=500)
    rig.run(5.0)
    assert sum("refused" in text for text in rig.process.texts) == 1, "a flood is told once in 10 s"


def test_a_second_address_may_be_that_of_a_vehicle_that_was_restarted(rig_of):
    """After a restart, a real ArduCopter called from another port and was reported as a second vehicle for 3 s."""
    rig = rig_of("ardupilot")
    rig.connect()
    rig.link.rejected.update(duplicate_system=60)
    rig.run(1.0)
    word = "v refused 60 frames with its number from a second address (another vehicle, or it was restarted there)"
    assert word in rig.process.texts


def test_setpoints_and_leases_in_anothers_place_move_nothing_and_are_told(rig_of):
    rig = rig_of("px4")
    rig.track_on()
    stranger = MemoryBus(rig.other._exchange, "lab", "stranger")
    begin = (rig.body.x, rig.body.y)
    for _ in range(50):
        for bus, epoch in ((stranger, 10**15), (stranger, 1)):
            forged = VelocitySetpoint(
                header=bus.header("v"), velocity_m_s=(1.0, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=epoch
            )
            bus.publish(SETPOINT, forged)
        stranger.publish(
            LEASE, Lease(header=stranger.header("team"), holder="stranger", expires_ns=rig.hand.now + 10**9)
        )
        rig.run(0.025)  # not in step with the rig's own lease: one of the same instant is "old", not "held"
    assert rig.mode == "TRACK"
    assert abs(rig.body.x - begin[0]) < 0.3 and abs(rig.body.y - begin[1]) < 0.3
    (told,) = (text for text in rig.process.texts if "refused" in text)
    assert "setpoints of another sender" in told and "operator leases of another sender" in told


def test_an_answer_to_a_second_ground_station_answers_no_request_of_ours(rig_of):
    rig = rig_of("px4")
    rig.connect()
    requests = rig.vehicle._requests
    requests.ask(rig.hand.now, "arm", MavCmd.COMPONENT_ARM_DISARM, 1.0)
    assert requests.due(rig.hand.now)
    for target, accepted in ((254, set()), (255, {"arm"})):  # 255: us
        ack = CommandAckMessage(MavCmd.COMPONENT_ARM_DISARM, 0, 0, 0, target, 190)
        rig.vehicle.take(Heard(rig.hand.now, ReceivedFrame(11, 1, 0, ack)))
        while rig.vehicle._acks:
            requests.answer(rig.hand.now, rig.vehicle._acks.popleft())
        assert requests.accepted & {"arm"} == accepted
