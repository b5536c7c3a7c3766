"""The program `groundstation`: before it imports anything, it raises its priority for a stop, and takes one thread."""

import os
import signal
import sys

from groundstation.process.one_thread import stay_on_one_thread
from groundstation.process.priority import go_first

# A process at ordinary priority gets a thirtieth of a busy machine (docs/decisions/0137). A dead man's switch keeps
# that priority: it runs for long, and if it is late, drones hold.
STOPS = ("hold", "land", "cut-motors")


_INTERRUPTED = 130


def main() -> None:
    """Entry point of the `groundstation` script."""
    at_once = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if at_once:  # Ctrl-C during the imports: nothing has begun
        signal.signal(signal.SIGINT, lambda *_: os._exit(_INTERRUPTED))
    if sys.argv[1:] and sys.argv[1] in STOPS:
        go_first(heirs=True)
    stay_on_one_thread()
    from groundstation.cli.main import main as carry_out

    if at_once:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    carry_out()


if __name__ == "__main__":
    main()
