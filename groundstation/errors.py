"""Errors that cross package borders; an operator's mistake is always one of these, never a bare traceback."""

import errno
import re

# Errors of a path named on the command line that cannot be read or written.
_WRONG_PLACE = frozenset(
    (
        errno.EACCES,
        errno.EEXIST,
        errno.EISDIR,
        errno.ENAMETOOLONG,
        errno.ENOENT,
        errno.ENOTDIR,
        errno.EPERM,
        errno.EROFS,
    )
)
_WORD_WITH_AT = re.compile(r"""[^\s"'<>]*@[^\s"'<>]*""")
_PLACE = re.compile(r"(\[[^\]@]*\]|[^@:]*)(:\d{0,5})?")


def without_password(source: str) -> str:
    """Return a source's address without the user and password that it may carry.

    In a malformed address all text before an @ may be part of a password and is removed as well.
    """
    scheme, mark, rest = source.partition("://")
    if not mark:
        before, _, after = source.rpartition("@")
        return after if ":" in before and not before.startswith("/") else source
    place = re.split("[/?#]", rest, maxsplit=1)[0]
    if "@" in place:
        hidden = place.rpartition("@")[0] + "@"
    else:
        hidden = "" if _PLACE.fullmatch(place) else "".join(rest.rpartition("@")[:2])
    return f"{scheme}{mark}{rest[len(hidden) :]}"


def without_passwords(text: str) -> str:
    """Return a message or log line in which no address carries a user and password."""
    return _WORD_WITH_AT.sub(lambda word: without_password(word.group()), text)


class GroundStationError(Exception):
    """Base of every error with a message meant for the operator, which never holds a camera's password."""

    def __init__(self, text: str = "") -> None:
        super().__init__(without_passwords(text))


class OperatorMistake(GroundStationError):
    """A request that cannot be carried out: a wrong file, an existing output path, a missing extra."""


def is_wrong_place(error: OSError) -> bool:
    """Return whether a disk error is the named path's fault, not that of a full or broken disk."""
    return error.errno in _WRONG_PLACE


class SettingsError(GroundStationError):
    """One or more settings are wrong; `problems` holds a line for each, with file, line and remedy."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = [without_passwords(problem) for problem in problems]


class MessageError(GroundStationError):
    """A bus message cannot be decoded or contradicts its key; `reason` is a short countable word."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(f"{reason}: {detail}" if detail else reason)
        self.reason = reason


class DriverError(GroundStationError):
    """A vehicle or camera cannot be reached, or refuses a request that its driver needs."""


class EstimatorFault(GroundStationError):
    """The belief is no longer a distribution (not finite or not positive definite)."""
