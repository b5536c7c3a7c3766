"""Something an operator should know: the content of an `Event` before it has a header."""

from dataclasses import dataclass

from groundstation.bus.messages import Severity


@dataclass(frozen=True, slots=True)
class Notice:
    """entity: its subject ("" for the sending process); remedy: the operator's next step, if any."""

    severity: Severity
    text: str
    remedy: str = ""
    entity: str = ""
