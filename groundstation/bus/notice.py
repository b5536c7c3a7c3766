"""Something an operator should know: the content of an `Event` before it has a header."""

from dataclasses import dataclass

from groundstation.bus.messages import Severity


@dataclass(frozen=True, slots=True)
class Notice:
    """entity: whom it is about ("" for the process that says it); remedy: what a person can do, if anything."""

    severity: Severity
    text: str
    remedy: str = ""
    entity: str = ""
