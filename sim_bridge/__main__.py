"""`python -m sim_bridge --spec FILE`: emulate what a field and a scenario describe.

Exit codes: 0 stopped as asked, 1 cannot run (a port is taken, a camera does not start), 2 wrong spec or scenario.
"""

import argparse
import sys
from pathlib import Path

# Imports wait for `main`: the render processes import this file once more when they are spawned.


def main() -> int:
    """Run the bridge to its end."""
    parser = argparse.ArgumentParser(prog="python -m sim_bridge", description=__doc__)
    parser.add_argument(
        "--spec", type=Path, required=True, help="JSON: child, field, scenario, addresses, streams, seed"
    )
    arguments = parser.parse_args()

    from groundstation.errors import GroundStationError, SettingsError

    try:
        return _serve(arguments.spec)
    except SettingsError as error:
        print(error, file=sys.stderr)
        return 2
    except GroundStationError as error:
        print(f"sim_bridge: {error}", file=sys.stderr)
        return 1


def _serve(spec: Path) -> int:
    from groundstation.process.child import Child
    from sim_bridge.harness import Harness
    from sim_bridge.launch_spec import read_order

    order = read_order(spec)
    with Child(order.child) as child:
        harness = Harness(child, order)
        try:
            harness.open()
            harness.run()
        finally:
            harness.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
