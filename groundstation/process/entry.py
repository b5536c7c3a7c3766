"""First code of a child: `python -m groundstation.process.entry NAME MODULE:FUNCTION`, its ChildSpec on stdin.

The specification comes through a memory file, not the disk: a restart in flight must work with a full disk.
"""

import logging
import sys
import time
from collections.abc import Callable
from pkgutil import resolve_name

import msgspec

from groundstation.errors import GroundStationError
from groundstation.process.child import Child, ChildSpec
from groundstation.process.standard_streams import show_all_signs

EXIT_FAILED = 1
_log = logging.getLogger(__name__)


def main(arguments: list[str]) -> int:
    """Run one child to its end and return its exit code."""
    show_all_signs()
    spec = msgspec.json.decode(sys.stdin.buffer.read(), type=ChildSpec)
    try:
        with Child(spec) as child:
            began = time.monotonic()
            run: Callable[[Child], int] = resolve_name(arguments[1])
            _log.info("imported %s in %.2f s", arguments[1], time.monotonic() - began)
            return run(child)
    except GroundStationError as error:
        _log.error("%s", error)
    except Exception:  # noqa: BLE001 - the outermost loop of the process: log, then let the supervisor decide
        _log.exception("crashed")
    return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
