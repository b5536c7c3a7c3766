"""Acknowledgements of one command by its addressed drones."""

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import AckStage, Command, CommandAck, Verb
from groundstation.runtime.acknowledgements import AwaitedAnswers


def test_ack_book_takes_only_news_from_who_was_asked() -> None:
    bus = MemoryBus(MemoryExchange(), "lab", "x")
    command = Command(header=bus.header("team"), id="1", verb=Verb.LAND, scope=(), issuer="x")
    book = AwaitedAnswers(command, ("drone_1",))

    def ack(entity: str, stage: AckStage, command_id: str = "1") -> CommandAck:
        return CommandAck(header=bus.header(entity), command_id=command_id, verb=Verb.LAND, stage=stage)

    assert not book.note(ack("stranger", AckStage.RECEIVED))
    assert not book.note(ack("drone_1", AckStage.RECEIVED, "2"))
    assert book.note(ack("drone_1", AckStage.ACCEPTED))
    assert not book.note(ack("drone_1", AckStage.RECEIVED)), "out of order"
    assert book.progress["drone_1"].text(final=True) == "sent / received / accepted / NOT CONFIRMED"
    assert book.note(ack("drone_1", AckStage.EFFECTIVE)) and book.confirmed and book.settled
    assert not book.note(ack("drone_1", AckStage.REFUSED)), "nothing after the end"


def test_a_stop_that_nobody_heard_is_repeated_sooner_than_a_start() -> None:
    bus = MemoryBus(MemoryExchange(), "lab", "x")

    def book(verb: Verb) -> AwaitedAnswers:
        return AwaitedAnswers(Command(header=bus.header("team"), id="1", verb=verb, scope=(), issuer="x"), ("drone_1",))

    stop = book(Verb.HOLD)
    assert stop.repeat_after_s == 0.1 < book(Verb.TRACK).repeat_after_s
    stop.note(CommandAck(header=bus.header("drone_1"), command_id="1", verb=Verb.HOLD, stage=AckStage.RECEIVED))
    assert stop.repeat_after_s == 1.0, "its effect takes time"


def test_a_drone_that_is_left_out_is_addressed_no_more_and_keeps_its_last_answer() -> None:
    bus = MemoryBus(MemoryExchange(), "lab", "x")
    command = Command(header=bus.header("team"), id="1", verb=Verb.TRACK, scope=(), issuer="x")
    book = AwaitedAnswers(command, ("drone_1", "drone_2", "drone_3"))
    done = CommandAck(header=bus.header("drone_1"), command_id="1", verb=Verb.TRACK, stage=AckStage.EFFECTIVE)
    assert book.note(done)
    assert book.leave_out(("drone_1",), "stopped") == ("drone_2", "drone_3")
    assert book.leave_out(("drone_2",), "stopped") == ("drone_3",)
    assert (book.command.id, book.command.scope, book.unheard) == ("1", ("drone_3",), ("drone_3",))
    assert [p.stage for p in book.progress.values()] == [AckStage.EFFECTIVE, AckStage.REFUSED, None]
    assert book.progress["drone_2"].reason == "stopped"
    assert book.leave_out(("drone_3",), "stopped") == () and book.settled
    assert book.command.scope == ("drone_3",), "an empty scope would address all"
