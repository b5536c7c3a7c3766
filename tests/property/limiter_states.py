"""The output limiter in very many random states: `make limiter-states`, or `python tests/property/limiter_states.py`.

Draws at least so many states (--states; a team's counts once for each of its robots) from --seed on, and judges the
limiter's response to a random wish in each. The first broken promise ends the run and is printed with the command that
draws it again.
"""

import argparse
import sys
import time
from collections import Counter
from itertools import count

from groundstation.process import numba_cache


def main() -> int:
    """Judge, and print the progress every minute."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--states", type=int, default=10_000_000)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="batch to begin with, to go on where another run ended")
    told = parser.parse_args()
    numba_cache.activate()
    from limiter_judge import TEAMS, judged_batch

    ends, began_s, said_s = Counter[str](), time.process_time(), time.monotonic()
    for number in count(told.first):
        if ends.total() >= told.states:
            break
        ends += judged_batch(told.seed, number, TEAMS)
        if time.monotonic() - said_s > 60.0:
            said_s = time.monotonic()
            print(f"{ends.total()} states, batches {told.first} to {number}", flush=True)
    shares = ", ".join(f"{end} {states}" for end, states in ends.most_common())
    spent = f"{time.process_time() - began_s:.0f} s of CPU time"
    print(f"{ends.total()} states from seed {told.seed}, none wrong: {shares}; {spent}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
