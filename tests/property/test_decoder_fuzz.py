"""Every decoder either reads a damaged input or refuses it with its declared error.

$FUZZ_INPUTS: number of inputs in the long run; `make fuzz` takes a million.
"""

import os

import pytest
from fuzzed_decoders import DECODERS, fuzz

LONG = int(os.environ.get("FUZZ_INPUTS", "30000"))
QUICK = 500
_SLOW_TO_READ = {"field": 5}  # times slower than others


@pytest.mark.parametrize("name", DECODERS)
def test_damaged_inputs_raise_declared_errors_only(name: str) -> None:
    outcomes = fuzz(DECODERS[name], QUICK // _SLOW_TO_READ.get(name, 1), 1)
    assert outcomes.pop("read") > 0, "some must get through, or the depth of the decoder is never reached"
    assert outcomes or name == "pave", "a stream of video is never refused: damage is skipped"


@pytest.mark.slow
@pytest.mark.fuzz
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("name", DECODERS)
def test_many_damaged_inputs_raise_declared_errors_only(name: str) -> None:
    inputs = LONG if "FUZZ_INPUTS" in os.environ else LONG // _SLOW_TO_READ.get(name, 1)
    assert sum(fuzz(DECODERS[name], inputs, 2).values()) == inputs
