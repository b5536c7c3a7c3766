"""The option `--real`: valid combinations, and the address of each device in a mixed run."""

import json
from pathlib import Path

import pytest

from groundstation.errors import OperatorMistake
from groundstation.flight.composition import Simulation, process_table, simulated
from groundstation.flight.flight_plan import plan_of
from groundstation.flight.real_parts import RealBody, notes, parse_real
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field
from groundstation.supervisor.network import Network
from groundstation.supervisor.process_spec import ProcessSpec

CONFIG = Path(__file__).parents[3] / "config"
NETWORK = Network("127.64.9", -1, 7447, 8080)


@pytest.fixture(scope="module")
def team() -> Field:
    return load_field(CONFIG / "mixed-team.yaml", ())


def table(team: Field, *options: str) -> dict[str, ProcessSpec]:
    real = parse_real(team, options)
    simulation = Simulation(NETWORK, {}, 1, real)
    there = simulated(team, NETWORK, real)
    return {p.name: p for p in process_table(there, "tcp/x:1", Path("/x"), simulation=simulation, monitor=False)}


def test_only_what_is_emulated_is_rerouted(team: Field) -> None:
    processes = table(team, "drone_2=autopilot:19410", "ceiling_west")
    sections = {name: json.loads(process.section) for name, process in processes.items() if process.section}
    assert sections["drone_2"]["link"]["target"] == "udpout:192.168.1.12:14550"
    assert sections["drone_3"]["link"]["target"] == "udpout:127.64.9.13:14550"
    assert sections["ceiling_west"]["source"] == "http://192.168.1.50:8080/video.mjpg"
    assert sections["ceiling_east"]["source"] == "http://127.64.9.51:8080/video.mjpg"
    assert sections["drone_2_camera"]["source"] == "http://127.64.9.53:8080/video.mjpg"
    order = sections["sim_bridge"]
    assert sorted(order["addresses"]) == ["drone_1", "drone_3"]
    assert sorted(order["streams"]) == ["ceiling_east", "drone_1", "drone_2", "drone_3"]
    assert order["real"] == {"drone_2": {"source": "autopilot", "address": ["127.0.0.1", 19410], "system": ""}}


def test_stops_reach_real_and_emulated_drones(team: Field) -> None:
    processes = table(team, "drone_2=autopilot:19410")
    sent = {name: p.failsafe_datagrams for name, p in processes.items() if p.failsafe_datagrams is not None}
    assert {name: s.address for name, s in sent.items()} == {
        "drone_1": "127.64.9.11", "drone_2": "192.168.1.12", "drone_3": "127.64.9.13",
    }  # fmt: skip


def test_a_real_ardrone_has_an_emulated_camera_of_its_own(team: Field) -> None:
    processes = table(team, "drone_1", "ceiling_west")
    drone, camera = (json.loads(processes[name].section) for name in ("drone_1", "drone_1_camera"))
    assert drone["address"] == "192.168.1.11"
    assert camera["source"] == "http://127.64.9.52:8080/video.mjpg"
    real = table(team, "drone_1", "drone_1_camera", "ceiling_west")
    assert json.loads(real["drone_1_camera"].section)["source"] == "ardrone://192.168.1.11"
    assert "drone_1" not in json.loads(real["sim_bridge"].section)["streams"]


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["drone_9"], "no such part, only drone_1"),
        (["ceiling_west=estimate"], "only a drone has a source"),
        (["drone_2"], "nothing real says where it is"),
        (["drone_2=mocap"], "or the name of a motion capture system of the field"),
        (["drone_2=autopilot:lots"], "is no PORT"),
        (["drone_2=autopilot"], "is no PORT"),
        (["drone_1=autopilot:19410"], "only simulators of firmware tell a true pose"),
        (["drone_2=autopilot:5000", "drone_3=autopilot:5000"], "the same port"),
        (["drone_2_camera"], "drone_2, which carries it"),
        (["turtlebot"], "nothing can see it"),
        (
            [*(f"drone_{n}{part}" for n in (1, 2, 3) for part in ("", "_camera")), "ceiling_west", "ceiling_east"],
            "nothing is left",
        ),
    ],
)  # fmt: skip
def test_invalid_real_options_are_refused_with_a_remedy(team: Field, options: list[str], problem: str) -> None:
    with pytest.raises(OperatorMistake, match=problem):
        parse_real(team, [*options, "turtlebot"] if "nothing is left" in problem else options)


def test_the_operator_is_told_what_emulated_cameras_cannot_do(team: Field) -> None:
    real = parse_real(team, ["drone_2", "ceiling_west"])
    assert real.drones == {"drone_2": RealBody("estimate")} and real.cameras == {"ceiling_west"}
    said = " ".join(notes(team, real))
    assert "cannot correct" in said and "does not see what is emulated: drone_1, drone_3" in said
    both = parse_real(team, ["ceiling_west", "ceiling_east"])
    assert "nothing that is fixed in the world is emulated" in " ".join(notes(team, both))


@pytest.fixture(scope="module")
def hall() -> Field:
    """The lab with its ceiling camera, and with motion capture as the truth."""
    return load_field(CONFIG / "mocap-truth.yaml", ())


def test_a_drone_may_be_where_motion_capture_follows_it_and_that_system_is_not_emulated(hall: Field) -> None:
    processes = table(hall, "drone_2=mocap")
    order = json.loads(processes["sim_bridge"].section)
    assert order["real"] == {"drone_2": {"source": "capture", "address": None, "system": "mocap"}}
    assert order["captures"] == {} and "ceiling" in order["streams"]
    assert json.loads(processes["mocap"].section)["source"] == hall.motion_capture["mocap"].source
    real = parse_real(hall, ["drone_2=mocap"])
    assert real.drones == {"drone_2": RealBody("capture", system="mocap")} and real.names == ("drone_2", "mocap")
    said = " ".join(notes(hall, real))
    assert "the room has it where mocap sees its body" in said
    assert "mocap is real and does not see what is emulated: drone_1" in said


def test_a_real_system_holds_a_drone_inside_of_the_fence_unless_it_is_the_truth(hall: Field) -> None:
    rooted = load_field(CONFIG / "mocap-lab.yaml", ())
    assert parse_real(rooted, ["drone_2", "mocap"]).systems == {"mocap"}
    assert "nothing that is fixed in the world is emulated" in " ".join(notes(rooted, parse_real(rooted, ["mocap"])))
    with pytest.raises(OperatorMistake, match="nothing real says where it is"):
        parse_real(hall, ["drone_2", "mocap"])
    with pytest.raises(OperatorMistake, match="--real mocap"):
        parse_real(rooted, ["drone_2"])


def test_a_run_with_a_real_drone_asks_before_it_takes_off(team: Field) -> None:
    for options, asks in ((["drone_2=autopilot:1"], True), (["ceiling_west"], False)):
        assert plan_of(team, None, asks=bool(parse_real(team, options).drones)).asks is asks
