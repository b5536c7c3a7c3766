"""The mutation operators that judge the tests of the safety path."""

import ast

import pytest
from operators import mutants_of


def changes(source):
    return [one.source for one in mutants_of(source)]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a < b", ["a <= b", "a >= b"]),
        ("a == b", ["a != b"]),
        ("a and b", ["a or b"]),
        ("not a", ["a"]),
        ("x = True", ["x = False"]),
        ("M = 1 << 12", ["M = 1 >> 12", "M = 1 << 13", "M = 1 << 11", "M = 2 << 12", "M = 0 << 12"]),
        ("def f():\n    return a", ["def f():\n    return None"]),
        ("def f():\n    stop()", ["def f():\n    pass"]),
        ("if a:\n    b", ["if not a:\n    b"]),
    ],
)
def test_each_kind_of_change_is_made(source, expected):
    assert set(expected) <= set(changes(source))


def test_words_decorations_and_types_stay_as_they_are():
    source = '''"""Says 3 < 4."""
@dataclass(frozen=True)
class A:
    """Keeps."""
    x: Annotated[int, 3]

def f() -> Literal[4]:
    """Says."""
    _log.info("5 of %d", 6)
    return None
'''
    assert changes(source) == []


def test_every_mutant_is_one_change_that_compiles_under_a_name_of_its_own():
    source = "def f(a, b):\n    if a < 3 and b > 3:\n        return a + 3\n    return b + 3\n"
    mutants = mutants_of(source)
    for mutant in mutants:
        compile(mutant.source, "mutant", "exec")
        lines = zip(ast.unparse(ast.parse(source)).splitlines(), mutant.source.splitlines(), strict=True)
        assert sum(one != other for one, other in lines) == 1
    assert len({mutant.name for mutant in mutants}) == len(mutants) >= 15
    assert [mutant.line for mutant in mutants] == sorted(mutant.line for mutant in mutants)
