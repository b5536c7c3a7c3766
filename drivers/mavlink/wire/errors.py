"""The one error of this package."""


class WireError(ValueError):
    """Bytes or values that do not fit the protocol; `reason` is a short word to count by."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(f"{reason}: {detail}" if detail else reason)
        self.reason = reason
