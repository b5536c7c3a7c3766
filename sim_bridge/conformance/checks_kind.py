"""Checks of the kind's object, which settings, supervisor, estimator and simulator read."""

import importlib
import inspect
import json
import math
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import replace
from pkgutil import resolve_name

from msgspec.structs import replace as change

from groundstation.vehicles import KindSection, VehicleOrder
from groundstation.vehicles.answers import MOST_BYTES, stop_of
from sim_bridge.conformance.check import Case, NotApplicable, check
from sim_bridge.conformance.subject import LIMITS, NAME, PAD_M, TOP_M
from sim_bridge.world.emulation import emulation_of
from sim_bridge.world.noise import generator_of
from sim_bridge.world.world import TICK_S, World

_HEAVY = ("numba", "cv2", "av", "scipy", "zenoh", "matplotlib", "numpy")
_SAME: Mapping[str, float] = {}


@check()
def kind_has_a_name_and_a_summary(case: Case) -> None:
    """Name and summary are a word and a line."""
    kind = case.subject.kind
    assert kind.name.isidentifier() and kind.name == kind.name.lower(), f"name: {kind.name!r}"
    assert kind.summary.strip() and "\n" not in kind.summary, f"summary: {kind.summary!r}"


@check()
def driver_can_be_loaded(case: Case) -> None:
    """The driver's entry is a function of one argument."""
    entry = resolve_name(case.subject.kind.driver)
    assert len(inspect.signature(entry).parameters) == 1, f"{case.subject.kind.driver} takes other arguments"


@check()
def kind_is_light(case: Case) -> None:
    """Importing the kind's object loads no heavy library: every command imports it."""
    code = (
        "import sys; from groundstation.vehicles import kind_named; before = set(sys.modules); "
        f"kind_named({case.subject.kind.name!r}); print(' '.join(sys.modules))"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    heavy = [name for name in (*_HEAVY, *_protocol_libraries(case)) if name in loaded]
    assert not heavy, f"imports {', '.join(heavy)}: name driver and emulator as text, and import there"


def _protocol_libraries(case: Case) -> set[str]:
    driver = importlib.import_module(case.subject.kind.driver.partition(":")[0])
    modules = {value.__name__.partition(".")[0] for value in vars(driver).values() if inspect.ismodule(value)}
    own = case.subject.kind.driver.partition(".")[0]
    return modules - set(sys.stdlib_module_names) - {own, "groundstation", "drivers", "pydantic", "msgspec"}


@check()
def habits_are_figures(case: Case) -> None:
    """The error habits are finite; times are positive."""
    habits = case.subject.kind.habits
    times = (habits.velocity_s, habits.attitude_s, habits.climb_s)
    assert all(math.isfinite(one) and one > 0.0 for one in times), f"times: {times}"
    assert math.isfinite(habits.climb_m_s) and habits.climb_m_s >= 0.0, f"climb_m_s: {habits.climb_m_s}"
    assert 0.0 <= habits.climb_share <= 1.0, f"climb_share: {habits.climb_share}"


@check()
def standing_height_is_a_height(case: Case) -> None:
    """A standing vehicle's base is 0 to 0.5 m above the floor, with a deviation."""
    height, deviation = case.subject.kind.standing_m
    assert 0.0 <= height <= 0.5 and 0.0 < deviation <= 0.3, f"standing_m: {case.subject.kind.standing_m}"


@check()
def sections_are_described(case: Case) -> None:
    """Every key of its sections has a description for the reference."""
    bare = [
        f"{name}.{key}"
        for name, model in case.subject.kind.sections.items()
        for key, field in model.model_fields.items()
        if not field.description
    ]
    assert not bare, f"without a text below the key: {', '.join(bare)}"


@check()
def sections_are_strict(case: Case) -> None:
    """Its sections refuse unknown keys."""
    for name, model in case.subject.kind.sections.items():
        assert issubclass(model, KindSection), f"{name} is no KindSection"
        assert model.model_config.get("extra") == "forbid", f"{name} takes any key"


@check()
def required_sections_exist(case: Case) -> None:
    """Required sections are sections of this kind, and its example has them."""
    kind = case.subject.kind
    assert kind.required <= set(kind.sections), f"required: {sorted(kind.required - set(kind.sections))}"
    assert kind.required <= set(kind.example), f"example lacks {sorted(kind.required - set(kind.example))}"


@check()
def everybody_has_one_process(case: Case) -> None:
    """Each vehicle of a team is in exactly one driver process."""
    orders = [case.subject.order(f"drone_{index}", index) for index in range(3)]
    flown = sorted(name for process in case.subject.kind.processes(orders) for name in process.vehicles)
    assert flown == ["drone_0", "drone_1", "drone_2"], f"flown are {flown}"


@check()
def section_is_json(case: Case) -> None:
    """The driver's section is a JSON object, the same each time."""
    first, second = (case.subject.kind.processes([case.subject.order()])[0].section for _ in range(2))
    assert isinstance(json.loads(first), dict), f"it is {first[:60]}"
    assert first == second, "it differs from call to call"


@check()
def limits_reach_the_driver(case: Case) -> None:
    """Speed limit, silence and least charge of the field file reach the driver."""
    order = case.subject.order()
    section = case.subject.kind.processes([order])[0].section
    others = {
        "limits.max_speed_m_s": _replaced(order, limits={"max_speed_m_s": LIMITS.max_speed_m_s / 2}),
        "limits.battery_min": _replaced(order, limits={"battery_min": 0.33}),
        "safety.land_after_s": _replaced(order, safety={"land_after_s": 4.5}),
    }
    deaf = [key for key, other in others.items() if case.subject.kind.processes([other])[0].section == section]
    assert not deaf, f"the driver is handed the same whatever the field says of {', '.join(deaf)}"


def _replaced(
    order: VehicleOrder, limits: Mapping[str, float] = _SAME, safety: Mapping[str, float] = _SAME
) -> VehicleOrder:
    """Return an order with other limits or times of silence."""
    drone = change(order.drone, limits=change(order.drone.limits, **limits))
    return replace(order, drone=drone, safety=change(order.safety, **safety))


@check()
def address_reaches_the_driver(case: Case) -> None:
    """The driver's section has the vehicle's name and, unless the vehicle calls, its address."""
    section = case.subject.kind.processes([case.subject.order()])[0].section
    assert NAME in section, "its name is not in the section"
    stop = case.subject.kind.stop([case.subject.order()])
    assert stop.called or case.subject.address in section, "its address is not in the section"


@check()
def interface_reaches_driver_and_guardian(case: Case) -> None:
    """A kind that says so hands the network adapter to its driver, and to a transport of its own."""
    kind = case.subject.kind
    if not kind.has_interface:
        raise NotApplicable("it does not choose its adapter (has_interface)")
    order = case.subject.order()
    behind = replace(order, drone=change(order.drone, interface="wlan97"))
    assert "wlan97" in kind.processes([behind])[0].section, "the adapter is not in the driver's section"
    stop = kind.stop([behind])
    assert not stop.transport or "wlan97" in stop.way, f"{stop.transport} is not told the adapter"


@check()
def stop_datagrams_fit(case: Case) -> None:
    """Hover and land are different bytes for a real port, each small enough for one packet."""
    stop = stop_of(case.subject.kind, [case.subject.order()])
    assert stop.hover != stop.land, "hover and land must be different"
    assert max(len(stop.hover), len(stop.land)) <= MOST_BYTES, "longer than a packet"


@check()
def stop_needs_no_vehicle(case: Case) -> None:
    """The stop datagrams are the same each time: they are prepared before anything flies."""
    first, second = (case.subject.kind.stop([case.subject.order()]) for _ in range(2))
    if first.transport:
        raise NotApplicable(f"{first.transport} makes them as it speaks")
    assert first == second, "they differ from call to call"


@check()
def healthy_team_has_no_findings(case: Case) -> None:
    """Its own check finds nothing wrong with its own example."""
    found = list(case.subject.kind.check([case.subject.order()]))
    assert not found, f"it finds {found}"


@check()
def moved_sections_are_its_own(case: Case) -> None:
    """A simulated network changes only keys of the kind's own sections, to permitted values."""
    kind = case.subject.kind
    for name, changes in kind.moved("127.0.0.1", case.subject.sections).items():
        assert name in kind.sections, f"{name} is no section of it"
        strange = set(changes) - set(kind.sections[name].model_fields)
        assert not strange, f"{name} has no {', '.join(sorted(strange))}"


@check()
def emulated_body_stands_on_its_pad(case: Case) -> None:
    """The emulated body stands where the field says, motors off, and stays there."""
    launch = case.subject.launch()
    body = World(launch.site, launch.scenario, 1).drones[NAME]
    for _ in range(200):
        body.step((0.0, 0.0, 0.0))
    at = (body.airframe.x, body.airframe.y)
    assert math.dist(at, PAD_M) < 0.01, f"it stands at {at}"
    assert not body.airborne and not body.autopilot.motors_on, "it flies"
    assert 0.0 <= body.airframe.z < TOP_M / 5, f"its base is at {body.airframe.z:.2f} m"
    assert 0.0 < body.battery <= 1.0, f"its charge is {body.battery}"


@check()
def emulation_is_repeatable(case: Case) -> None:
    """Two bodies of one seed are the same."""
    launch, emulation = case.subject.launch(), emulation_of(case.subject.kind.name)
    site = launch.site.drones[NAME]
    one, two = (emulation.body(site, launch.scenario, TICK_S, generator_of(5, NAME)) for _ in range(2))
    assert one.battery == two.battery and one.airframe.row() == two.airframe.row(), "chance beside its generator"
