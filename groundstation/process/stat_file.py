"""Reads the kernel's record of a running process."""

from pathlib import Path


def stat_of(pid: int) -> list[str] | None:
    """Return the fields of /proc/PID/stat from the state of the process on, or None if there is none."""
    try:
        content = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    return content.rpartition(")")[2].split()  # the name in parentheses may hold spaces
