"""Errors that cross package borders; an operator's mistake is always one of these, never a bare traceback."""


class GroundStationError(Exception):
    """Base of every error with a message meant for the operator."""


class OperatorMistake(GroundStationError):
    """Asked for what cannot be done as asked: a wrong file, a place that is taken, an extra that is missing."""


class SettingsError(GroundStationError):
    """One or more settings are wrong; `problems` holds a line for each, with file, line and remedy."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


class MessageError(GroundStationError):
    """A bus message cannot be decoded or contradicts its key; `reason` is a short countable word."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(f"{reason}: {detail}" if detail else reason)
        self.reason = reason


class DriverError(GroundStationError):
    """A vehicle or camera cannot be reached, or refuses what its driver needs."""


class EstimatorFault(GroundStationError):
    """The belief is no longer a distribution (not finite or not positive definite)."""
