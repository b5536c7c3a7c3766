"""`python -m sim_bridge.conformance tello`: judge a kind of vehicle; `groundstation vehicle check` runs this.

Exit codes: 0 all checks that apply pass, 1 some fail, 2 wrong usage.
"""

import argparse
import json
import sys
from collections import Counter

from groundstation.errors import SettingsError
from sim_bridge.conformance.kit import DAMAGED, Kit, Verdict, chosen

_SIGNS = {"passed": "pass", "failed": "FAIL", "does not apply": " -- "}


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_bridge.conformance")
    parser.add_argument("kind", metavar="KIND")
    parser.add_argument("--with", dest="options", action="append", default=[], metavar="SECTION.KEY=VALUE")
    parser.add_argument("--only", default="", metavar="WORDS")
    parser.add_argument("--damaged", type=int, default=DAMAGED, metavar="N")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def _tell(verdict: Verdict) -> None:
    why = f": {verdict.why}" if verdict.why else ""
    print(f"{_SIGNS[verdict.end]}  {verdict.check.text}{why}  [{verdict.check.name}]", flush=True)


def main() -> int:
    """Judge, and print a line for each check."""
    order = _arguments()
    try:
        checks = chosen(order.only)
        kit = Kit(order.kind, order.options, order.damaged)
    except SettingsError as error:
        print("\n".join(error.problems), file=sys.stderr)
        return 2
    verdicts = []
    for verdict in kit.verdicts(checks):
        verdicts.append(verdict)
        if not order.json:
            _tell(verdict)
    count = Counter(one.end for one in verdicts)
    if order.json:
        rows = [{"check": v.check.name, "flight": v.check.flight, "text": v.check.text, "end": v.end, "why": v.why}
                for v in verdicts]  # fmt: skip
        print(json.dumps({"kind": order.kind, **count, "checks": rows}, indent=1))
    else:
        print(", ".join(f"{count[end]} {end}" for end in _SIGNS if count[end]) + f" of {len(verdicts)} checks")
    return 1 if count["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
