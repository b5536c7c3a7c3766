"""`hold`, `land`, `cut-motors`, and the operator's `takeoff`, `track`, `resume`, to a running ground station.

These must act within 0.3 s of their start: nothing but click, msgspec and zenoh may be imported here.
"""

import json
import os
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import click

from groundstation.bus.api import Received
from groundstation.bus.messages import OPERATOR, CommandAck, Verb
from groundstation.bus.roles import Role
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.cli.exits import ExitCode, UnreachableError
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.runtime.acknowledgements import NOT_CONFIRMED, AwaitedAnswers
from groundstation.runtime.asking import by_clock_of, command_of, patience_s
from groundstation.supervisor import runtime_file
from groundstation.supervisor.joining import admissions, join
from groundstation.supervisor.runtime_file import RuntimeRecord

# A router that died is back by then; drones hover without one. A living one may be busy, and a signal is the last
# resort: drivers that get it land and exit, for every verb.
_CONNECT_S = 2.0


def choose_run(name: str | None, stops: bool = False) -> RuntimeRecord:
    """Return the running ground station, or the named one of several; raises UnreachableError.

    stops: without a name, or by that of a site, the run with real drones is meant, even if simulated ones run nearer to
    this shell.
    """
    records = _found(name, stops)
    if not records:
        which = f" called {name}" if name else ""
        searched = ", ".join(map(str, (runtime_file.wanted_folder(), *runtime_file.folders_beside())))
        nobody = f"no ground station{which} is running (start one with: groundstation fly FIELD); searched: {searched}"
        raise UnreachableError("\n".join(_why_not_found()) or nobody)
    if len(records) > 1:
        lines = "\n".join(f"  --run {r.name}  {r.field}, {', '.join(r.drones)}" for r in records)
        raise UnreachableError(f"several ground stations are running, choose one:\n{lines}")
    return records[0]


def _found(name: str | None, stops: bool) -> list[RuntimeRecord]:
    """Return the runs, or those of that name, from the nearest place that has any; for a stop any with real drones."""
    simulated: list[RuntimeRecord] = []
    for look in (runtime_file.live_records, runtime_file.records_beside, _elsewhere):
        records = look()
        if name is not None:
            records = [record for record in records if name in (record.name, record.site, str(record.supervisor.pid))]
        real = [record for record in records if not record.simulated]
        if stops and real:
            return real  # in an emergency nobody reads a list of runs
        if records and not (stops and all(name in (None, record.site) for record in records)):
            return records
        simulated = simulated or records
    return simulated


def _elsewhere() -> list[RuntimeRecord]:
    """Return the runs on other hosts whose sites this host has joined."""
    if not admissions():  # then nobody waits for the libraries of certificates
        return []
    from groundstation.supervisor import site

    return list(site.runs())


def _why_not_found() -> list[str]:
    """Return what keeps this host from runs that may be flying on others."""
    if not admissions():
        return []
    from groundstation.supervisor import site

    return list(site.why_not_found())


def deliver(bus: ZenohBus, book: AwaitedAnswers, patience_s: float, on_news: Callable[[str], None]) -> None:
    """Send the book's command, repeated where no answer comes, until all answers are final or patience_s is over."""
    answers = bus.subscribe([COMMAND_ACK])
    bus.publish(COMMAND, book.command)
    began = repeated = time.monotonic()
    while not book.settled and time.monotonic() - began < patience_s:
        answers.wait(0.05)
        for received in answers.drain():
            if isinstance(received.message, CommandAck) and book.note(received.message):
                entity = received.message.header.entity
                on_news(f"{entity:<12} {book.progress[entity].text()}")
        if time.monotonic() - repeated > book.repeat_after_s:
            repeated = time.monotonic()
            bus.publish(COMMAND, book.command)


def signal_drivers(record: RuntimeRecord) -> list[str]:
    """Ask the drivers of a run whose router is silent to land and exit, by SIGTERM; returns their names."""
    told = []
    for process in record.processes:
        if process.role == "driver" and process.alive:
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(process.pid, signal.SIGTERM)
                told.append(process.name)
    return told


def order(verb: Verb, drones: tuple[str, ...], run: str | None, as_json: bool, anyway: bool = False) -> int:
    """Carry out one verb; returns the exit code.

    A stop goes to the drones that exist even if others are named as well; that is told, and never OK.
    """
    record = choose_run(run, stops=verb.stops)
    known = tuple(name for name in drones if name in record.drones)
    strangers = [name for name in drones if name not in known]
    if strangers:
        mistake = f"there is no drone {', '.join(strangers)}, there are: {', '.join(record.drones)}"
        if not (verb.stops and known):
            raise OperatorMistake(mistake)
        with suppress(OSError):  # the terminal is gone; the others are stopped all the same
            click.echo(f"{mistake}; the others are ordered to {verb}", err=True)
    code = _order(verb, known, record, as_json, anyway)
    if verb.stops and record.simulated and run != record.name:  # real ones were looked for
        with suppress(OSError):
            click.echo("".join(f"{why}\n" for why in _why_not_found()), err=True, nl=False)
    return ExitCode.FAULT if strangers else code


def _order(verb: Verb, drones: tuple[str, ...], record: RuntimeRecord, as_json: bool, anyway: bool) -> int:
    try:
        bus = join(record, "cli", Role.CLI, timeout_s=_CONNECT_S)
    except GroundStationError as error:
        return _without_router(verb, record, as_json, error)
    try:
        asked = (drones or record.drones) if verb.stops else (OPERATOR,)
        command = command_of(bus, verb, drones, 1, anyway)
        if record.host and not verb.stops:
            command = by_clock_of(_lease(bus), command)
        book = AwaitedAnswers(command, asked)
        say: Callable[[str], None] = (lambda _: None) if as_json else click.echo
        deliver(bus, book, patience_s(verb), say)
    finally:
        bus.close()
    return _report(book, as_json)


def _lease(bus: ZenohBus) -> Received:
    """Return the operator's next lease; raises UnreachableError if none comes."""
    leases = bus.subscribe([LEASE], newest=True)
    leases.wait(_CONNECT_S)
    for received in leases.drain():
        return received
    raise UnreachableError("the ground station's router answers, but not its operator: look at its own terminal")


def _report(book: AwaitedAnswers, as_json: bool) -> int:
    if as_json:
        answers = {
            name: {"stage": progress.stage or NOT_CONFIRMED, "reason": progress.reason}
            for name, progress in book.progress.items()
        }
        document = {"command": book.command.verb, "confirmed": book.confirmed, "drones": answers}
        click.echo(json.dumps(document))
    elif not book.confirmed:
        for name, progress in book.progress.items():
            if not progress.settled:  # a refusal was told when it came
                click.echo(f"{name:<12} {progress.text(final=True)}")
    return ExitCode.OK if book.confirmed else ExitCode.FAULT


def _without_router(verb: Verb, record: RuntimeRecord, as_json: bool, error: GroundStationError) -> int:
    told = signal_drivers(record) if verb.stops else []
    if not told:
        raise UnreachableError(str(error)) from error
    if as_json:
        answers = {name: {"stage": NOT_CONFIRMED, "reason": "signalled to land"} for name in told}
        click.echo(json.dumps({"command": verb, "confirmed": False, "router": False, "drones": answers}))
    else:
        click.echo(f"no router answers at {record.endpoint}: ordered {', '.join(told)} to land and exit (SIGTERM)")
        click.echo(f"{NOT_CONFIRMED}: watch the drones")
    return ExitCode.FAULT


def _verb(verb: Verb, text: str) -> click.Command:
    @click.argument("drones", nargs=-1)
    @click.option(
        "--run",
        metavar="NAME",
        help="The run to address, if there are several; without it, a stop goes to the run with real drones.",
    )
    @click.option("--json", "as_json", is_flag=True, help="Print one JSON document.")
    def callback(drones: tuple[str, ...], run: str | None, as_json: bool, **more: Any) -> int:
        if verb is Verb.CUT_MOTORS and not more["yes"]:
            click.confirm("Cut the motors? The drones fall from where they are.", abort=True)
        return order(verb, drones, run, as_json, anyway=more.get("anyway", False))

    name = verb.lower().replace("_", "-")
    if verb is Verb.CUT_MOTORS:
        callback = click.option("--yes", is_flag=True, help="Do not ask for confirmation.")(callback)
    if verb is Verb.TAKEOFF:
        insist = click.option("--anyway", is_flag=True, help="Take off even if a check forbids it; this is recorded.")
        callback = insist(callback)
    example = f"\n\n\b\nExamples:\n  groundstation {name}\n  groundstation {name} drone_1 --json"
    wrong, part = (
        ("no name is a drone's", ", or one name is no drone's") if verb.stops else ("a name is no drone's", "")
    )
    codes = f"\n\nExit codes: 0 confirmed, 2 {wrong}, 3 no run was reached, 4 not confirmed{part}."
    return click.command(name=name, help=text + example + codes)(callback)


hold = _verb(Verb.HOLD, "Hover where they are: all drones, or the named ones.")
land = _verb(Verb.LAND, "Land all drones, or the named ones. Without a router, the drivers are signalled to land.")
cut_motors = _verb(Verb.CUT_MOTORS, "Stop the motors at once: the drones fall.")
takeoff = _verb(Verb.TAKEOFF, "Take off, one drone after the other, each localised before the next.")
track = _verb(Verb.TRACK, "Let the tracker move the drones that are up.")
resume = _verb(Verb.RESUME, "Go on after a hold or a restarted tracker.")
