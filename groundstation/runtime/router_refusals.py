"""The router's refusals, which Zenoh reports on standard output only."""

import fcntl
import logging
import os
import re
from collections.abc import Iterator
from contextlib import suppress

from groundstation.bus import keys
from groundstation.bus.zenoh_bus import REFUSED_BY
from groundstation.errors import MessageError
from groundstation.time_units import NS_PER_S

_PERIOD_NS = 10 * NS_PER_S
_STDOUT = 1
_KEPT_LINES = 20
_PIPE_BYTES, _BLOCK_BYTES = 1 << 20, 8192
_STRANGERS = ""
# WIRE: lines of Zenoh's access list, docs/reference/zenoh.md 10.3. Matched literally: there may be a megabyte a second.
_DENIED = b" is unauthorized to Put (ingress) on "
_WHO = re.compile(rb"([0-9a-f]{1,32})( on \S+)?$")
_NAME = re.compile(rb"CertCommonName\(([\w.-]+)\)")
_log = logging.getLogger(__name__)


class RouterRefusals:
    """Redirects standard output and reports the refused connections and messages that Zenoh writes there.

    The router never waits for this reader: lines that do not fit into the pipe are lost.
    """

    def __init__(self) -> None:
        os.environ["NO_COLOR"] = "1"
        self._stdout = os.dup(_STDOUT)
        self._source, sink = os.pipe()
        with suppress(OSError):  # beyond the user's limit: the pipe stays as it is
            fcntl.fcntl(sink, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        os.set_blocking(self._source, False)
        os.set_blocking(sink, False)
        os.dup2(sink, _STDOUT)
        os.close(sink)
        self._before, self._rest = b"", b""
        self._kept = self._strangers = 0
        self._members: dict[bytes, str] = {}
        self._denied: dict[str, str] = {}
        self._next_ns: dict[str, int] = {}

    def take(self, now_ns: int) -> list[str]:
        """Return texts about refusals: one in 10 s at most for all strangers, and one for each member."""
        self._read()
        waiting = [*self._denied, *([_STRANGERS] if self._strangers else [])]
        due = [who for who in waiting if now_ns >= self._next_ns.get(who, 0)]
        self._next_ns |= dict.fromkeys(due, now_ns + _PERIOD_NS)
        return [self._text(who) for who in due]

    def close(self) -> None:
        """Restore standard output."""
        os.dup2(self._stdout, _STDOUT)
        os.close(self._stdout)
        os.close(self._source)

    def _text(self, who: str) -> str:
        if who == _STRANGERS:
            count, self._strangers = self._strangers, 0
            return f"the bus refused {count} connections of programs that are not of this run"
        return f"the bus refused messages of {who}: it may not publish {self._denied.pop(who)}"

    def _read(self) -> None:
        try:
            fresh = os.read(self._source, _PIPE_BYTES)
        except BlockingIOError:
            return
        text, _, self._rest = (self._rest + fresh).rpartition(b"\n")
        self._strangers += text.count(REFUSED_BY.encode())
        for word in (b" WARN ", b" ERROR ") if self._kept < _KEPT_LINES else ():
            for _, line in _lines_with(text, word):
                self._log(line)
        for begin, line in _lines_with(text, _DENIED):
            self._deny(line, (self._before + text[:begin])[-_BLOCK_BYTES:])
        self._before = (self._before + text)[-_BLOCK_BYTES:]

    def _deny(self, line: bytes, before: bytes) -> None:
        subject, _, key = line.partition(_DENIED)
        who = _WHO.search(subject)
        if who is None:  # the rest of a line in a full pipe
            return
        if name := _NAME.search(who[0]):
            self._members[who[1]] = name[1].decode()
            # When a member declares a key, if only to subscribe, all its missing rights are logged in one block:
            # nothing was put.
            if who[0] + _DENIED.replace(b"Put", b"Reply") + key in before:
                return
        self._denied[self._members.get(who[1], "a member")] = _described(key.decode(errors="replace"))

    def _log(self, line: bytes) -> None:
        if self._kept < _KEPT_LINES:
            self._kept += 1
            _log.warning("%s", line.decode(errors="replace"))


def _lines_with(text: bytes, word: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield position and content of each line that contains a word."""
    at = text.find(word)
    while at >= 0:
        begin, end = text.rfind(b"\n", 0, at) + 1, text.find(b"\n", at)
        end = len(text) if end < 0 else end
        yield begin, text[begin:end]
        at = text.find(word, end)


def _described(text: str) -> str:
    """Return a key in the operator's words; a key that is not ours is not repeated on the terminal."""
    try:
        key = keys.parse(text)
    except MessageError:
        return "under a key that is not in the table of topics"
    return f"{key.topic.name} of {key.entity} as {key.source}"
