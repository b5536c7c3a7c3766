"""Plain text log on standard error, which the supervisor points at a file in the run folder."""

import faulthandler
import logging
import sys


def configure(name: str, level: int = logging.INFO) -> None:
    """Send every logger of this process to standard error, one line each, and crashes of native code too."""
    logging.basicConfig(
        stream=sys.stderr,
        level=level,
        format=f"%(asctime)s.%(msecs)03d {name} %(levelname)s %(name)s: %(message)s",
        datefmt="%Y-%m-%d %H:%M:%S",
        force=True,
    )
    if sys.stderr is not None and not faulthandler.is_enabled():
        faulthandler.enable(sys.stderr)
