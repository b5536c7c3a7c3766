"""Plain text log on standard error, which the supervisor points at a file in the run folder."""

import faulthandler
import logging
import sys

from groundstation.errors import without_passwords


class DiscreetFormatter(logging.Formatter):
    """Leaves the passwords of addresses out of lines and tracebacks."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the text of a record."""
        return without_passwords(super().format(record))


def configure(name: str, level: int = logging.INFO) -> None:
    """Send every logger of this process to standard error, one line each, and crashes of native code too."""
    logging.basicConfig(
        stream=sys.stderr,
        level=level,
        force=True,
    )
    form = f"%(asctime)s.%(msecs)03d {name} %(levelname)s %(name)s: %(message)s"
    for handler in logging.getLogger().handlers:
        handler.setFormatter(DiscreetFormatter(form, "%Y-%m-%d %H:%M:%S"))
    if sys.stderr is not None and not faulthandler.is_enabled():
        faulthandler.enable(sys.stderr)
