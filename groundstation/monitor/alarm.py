"""One alarm. Pure."""

from dataclasses import dataclass

TO_DO = "To do: "


@dataclass(frozen=True, slots=True)
class Alarm:
    """An alarm line; `grave` ones are red, the others yellow.

    about: identifies the alarm while figures in its text change.

    advice: first whether an operator must do something now, then what happens next.

    told_ns: time when it was first raised, for an alarm that stands from then on.
    """

    about: str
    text: str
    grave: bool = True
    advice: str = ""
    told_ns: int | None = None

    @property
    def asks(self) -> bool:
        """Return whether an operator must do something now."""
        return self.advice.startswith(TO_DO)
