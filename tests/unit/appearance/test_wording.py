"""Topologies and costs are shown in one form."""

import pytest

from groundstation.appearance.cost import cost_text
from groundstation.appearance.topology import topology_words


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("drone_1/drone_2", "drone_1 over drone_2"),
        ("drone_1,drone_2", "drone_1 + drone_2"),
        ("a,b/c/d", "a + b over c over d"),
        ("drone_1", "drone_1"),
        ("", "nobody in the air"),
    ],
)
def test_a_topology_is_said_in_words(text: str, words: str) -> None:
    assert topology_words(text) == words


@pytest.mark.parametrize(
    ("cost_m2", "text"),
    [
        (0.0, "0.00 cm²"),
        (0.000123, "1.23 cm²"),
        (0.00099949, "9.99 cm²"),
        (0.00099951, "10.0 cm²"),
        (0.0104987, "105 cm²"),
        (1.5, "15000 cm²"),
    ],
)
def test_a_cost_has_three_digits_in_one_unit(cost_m2: float, text: str) -> None:
    assert cost_text(cost_m2) == text
