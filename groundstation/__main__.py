"""The program `groundstation`: a stop goes ahead of all other programs before anything is imported for it."""

import sys

from groundstation.process.priority import go_first

# An ordinary process of a shell gets a thirtieth of a full machine (docs/decisions/0137). A dead man's switch stays
# one: drones hold when it is late, and it lasts.
STOPS = ("hold", "land", "cut-motors")


def main() -> None:
    """Entry point of the `groundstation` script."""
    if sys.argv[1:] and sys.argv[1] in STOPS:
        go_first(heirs=True)
    from groundstation.cli.main import main as carry_out

    carry_out()


if __name__ == "__main__":
    main()
