"""The one lifecycle of a driver process, of what its vehicles report."""

from collections.abc import Sequence

from drivers.base import HostProcess


class StartReport:
    """READY when all vehicles are, else DEGRADED with what is missing; told to the process when it changes.

    As long as some have not been heard at all, the start goes on, unless one lacks something or flies: a process that
    is starting is not watched for its silence.
    """

    def __init__(self, child: HostProcess, names: Sequence[str]) -> None:
        self._child, self._names = child, tuple(names)
        self._of: dict[str, tuple[bool, str]] = {}
        self._unheard: frozenset[str] = frozenset()
        self._told: tuple[bool, str] | None = None

    def ready(self, name: str, detail: str, flies: bool) -> None:
        """Note that a vehicle is ready."""
        self._of[name] = True, detail
        self._unheard = self._unheard - {name}
        self._tell(flies)

    def degrade(self, name: str, detail: str, heard: bool = True) -> None:
        """Note what a vehicle lacks, until it is ready; heard: False if it has never answered this process."""
        self._of[name] = False, detail
        self._unheard = self._unheard - {name} if heard else self._unheard | {name}
        self._tell(at_once=True)

    def _tell(self, at_once: bool) -> None:
        missing = [detail for is_ready, detail in self._of.values() if not is_ready]
        unheard = [f"{name} has not answered yet" for name in self._names if name not in self._of]
        if unheard and not missing and not at_once and self._told is None:
            return
        lacks = missing + unheard
        news = not lacks, "; ".join(lacks or [self._of[name][1] for name in self._names])
        if news == self._told:
            return
        self._told = news
        if not lacks:
            self._child.ready(news[1])
        else:
            self._child.degrade(news[1], works=not (unheard or self._unheard))
