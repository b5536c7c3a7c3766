"""The file in which a console's user finds the code that other users of the machine must show."""

import os
import secrets
from contextlib import suppress
from types import TracebackType
from typing import Self

from groundstation.supervisor import runtime_file


class CodeFile:
    """The code of one console, and the file that holds it while the console serves: readable by its owner only."""

    def __init__(self, port: int) -> None:
        self.code = secrets.token_urlsafe(9)
        self.path = runtime_file.folder() / f"console-{port}.code"

    def __enter__(self) -> Self:
        with suppress(OSError):  # nobody but other users needs it
            self.path.unlink(missing_ok=True)
            descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
            with os.fdopen(descriptor, "w") as file:
                file.write(f"{self.code}\n")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.path.unlink(missing_ok=True)
