"""Well-formed commands and setpoints whose sender or addressee is not the stated one."""

import pytest

from drivers.watchdog import Watchdog
from drivers.watchdog_types import Action, WatchdogLimits
from groundstation.bus.messages import AckStage, Command, Header, Lease, VelocitySetpoint, Verb

S = 1_000_000_000


def command(bench, verb, run="", source="tester", issuer="op", age_s=0.0, clock="clock"):
    header = Header(bench.now - round(age_s * S), clock, "drone_1", source, 0)
    expires_ns = 0 if verb in (Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS) else bench.now + 5 * S
    return Command(
        header=header, id=f"{verb}{run}{source}{issuer}{age_s}{clock}", verb=verb, scope=(), issuer=issuer,
        expires_ns=expires_ns, run=run,
    )  # fmt: skip


def setpoint(bench, source, epoch, seq=10**9):
    header = Header(bench.now, "clock", "drone_1", source, seq)
    return VelocitySetpoint(
        header=header, velocity_m_s=(2.0, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=epoch
    )


@pytest.mark.parametrize("verb", list(Verb))
@pytest.mark.parametrize("run", ["20260101T000000Z-lab", ""])
def test_an_order_for_another_run_is_refused(new_bench, verb, run):
    bench = new_bench().fly()
    bench.watchdog.lease.run = "20260102T000000Z-lab"
    before = bench.watchdog.mode
    answer = bench.watchdog.accept_command(bench.now, command(bench, verb, run))[-1]
    assert answer.stage is AckStage.REFUSED and answer.reason.startswith("given for ")
    assert bench.watchdog.mode is before
    own = command(bench, Verb.LAND, bench.watchdog.lease.run)
    assert bench.watchdog.accept_command(bench.now, own)[-1].stage is AckStage.ACCEPTED


@pytest.mark.parametrize("verb", [Verb.HOLD, Verb.LAND, Verb.CUT_MOTORS])
def test_a_stop_out_of_a_queue_that_stood_still_is_refused(new_bench, verb):
    bench = new_bench().fly()
    ghost = bench.watchdog.accept_command(bench.now, command(bench, verb, age_s=31))[-1]
    assert ghost.stage is AckStage.REFUSED and ghost.reason == "given 31 s ago"
    assert bench.step().action is Action.FLY
    late = bench.watchdog.accept_command(bench.now, command(bench, verb, age_s=25))[-1]
    assert late.stage is AckStage.ACCEPTED, "whoever repeats a stop may need that long"


def test_a_stop_of_another_clock_counts(new_bench):
    bench = new_bench().fly()
    foreign = bench.watchdog.accept_command(bench.now, command(bench, Verb.LAND, age_s=3600, clock="elsewhere"))[-1]
    assert foreign.stage is AckStage.ACCEPTED


def test_starts_need_the_sender_of_the_lease_and_not_only_its_name(new_bench):
    bench = new_bench()
    forged = bench.watchdog.accept_command(bench.now, command(bench, Verb.TAKEOFF, source="cli_1"))[-1]
    assert forged.stage is AckStage.REFUSED and "held by op" in forged.reason
    assert bench.step().action is Action.IDLE
    own = bench.watchdog.accept_command(bench.now, command(bench, Verb.TAKEOFF))[-1]
    assert own.stage is AckStage.ACCEPTED


def test_a_lease_is_not_renewed_in_the_holders_name(new_bench):
    bench = new_bench()
    header = Header(bench.now + 1, "clock", "team", "cli_1", 0)
    theft = Lease(header=header, holder="op", expires_ns=bench.now + 2 * S)
    assert bench.watchdog.accept_lease(bench.now, theft) == "held"


def test_resume_adopts_no_stranger(new_bench):
    bench = new_bench().fly()
    assert bench.watchdog.accept_setpoint(bench.now, setpoint(bench, "stranger", bench.epoch + 1)) == "other_source"
    bench.order(Verb.RESUME)
    decision = bench.step()
    assert decision.velocity_m_s != (2.0, 0.0, 0.0) and bench.watchdog.gate.epoch == bench.epoch


def test_one_packet_with_a_huge_epoch_grounds_nobody(new_bench):
    bench = new_bench().fly()
    assert bench.watchdog.accept_setpoint(bench.now, setpoint(bench, "tester", 10**15)) == "epoch_leap"
    assert bench.step().action is Action.FLY
    bench.epoch += 1000
    assert bench.setpoint() == "", "the next life of the tracker is heard"


def test_a_watchdog_without_a_run_asks_for_none(new_bench):
    assert Watchdog(WatchdogLimits(), "clock").lease.run == ""
    bench = new_bench().fly()
    answer = bench.watchdog.accept_command(bench.now, command(bench, Verb.LAND, "any"))[-1]
    assert answer.stage is AckStage.ACCEPTED


@pytest.mark.parametrize(("clock", "age_s"), [("clock", 1.0), ("clock", -9.0), ("another host's", 40.0)])
@pytest.mark.parametrize("start", [Verb.TRACK, Verb.RESUME])
def test_a_start_that_was_given_before_a_stop_is_refused_and_a_new_one_is_not(new_bench, start, clock, age_s):
    bench = new_bench().fly()
    given = bench.now
    held = command(bench, Verb.HOLD, issuer="anybody", age_s=age_s, clock=clock)
    assert bench.watchdog.accept_command(bench.now, held)[-1].stage is AckStage.ACCEPTED
    bench.run(0.2)
    overtaken = bench.watchdog.accept_command(bench.now, command(bench, start, age_s=(bench.now - given) / S + 1.5))[-1]
    assert (overtaken.stage, overtaken.reason) == (AckStage.REFUSED, "HOLD by anybody came after it")
    assert bench.watchdog.mode == "HOLD"
    new = bench.watchdog.accept_command(bench.now, command(bench, start))[-1]
    assert new.stage is AckStage.ACCEPTED
