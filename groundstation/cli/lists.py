"""Lists on the command line, separated by commas."""

from collections.abc import Collection

import click


def parts(value: str) -> list[str]:
    """Return the parts of a list, each once."""
    return list(dict.fromkeys(part.strip() for part in value.split(",") if part.strip()))


def choices(value: str, allowed: Collection[str], option: str) -> list[str]:
    """Return the parts of an option; raises UsageError for none, or one that is not allowed."""
    chosen = parts(value)
    if not chosen:
        raise click.UsageError(f"{option}: name at least one of {', '.join(allowed)}")
    for part in chosen:
        if part not in allowed:
            raise click.UsageError(f"{option}: {part!r} is none of {', '.join(allowed)}")
    return chosen


def numbers(value: str, option: str, low: int, high: int) -> list[int]:
    """Return an option as whole numbers within a range, each once; raises UsageError."""
    try:
        found = [int(part) for part in parts(value)]
    except ValueError:
        raise click.UsageError(f"{option}: {value!r} is not a list of whole numbers") from None
    if not found or min(found) < low or max(found) > high:
        raise click.UsageError(f"{option}: numbers from {low} to {high}, separated by commas")
    return list(dict.fromkeys(found))
