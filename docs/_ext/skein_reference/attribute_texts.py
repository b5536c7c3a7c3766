"""The texts that stand below attributes in the source, which Python itself forgets."""

import ast
import inspect
import itertools
import textwrap
from types import ModuleType
from typing import Any


def attribute_texts(owner: type[Any] | ModuleType) -> dict[str, str]:
    """Return the text below each attribute of a class (inherited ones included) or module that has one."""
    if isinstance(owner, ModuleType):
        return _texts(ast.parse(inspect.getsource(owner)).body)
    found: dict[str, str] = {}
    for base in reversed(owner.__mro__):
        if base.__module__.split(".")[0] == owner.__module__.split(".")[0]:
            (node,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
            assert isinstance(node, ast.ClassDef)
            found |= _texts(node.body)
    return found


def _texts(body: list[ast.stmt]) -> dict[str, str]:
    found: dict[str, str] = {}
    for node, following in itertools.pairwise(body):
        text = following.value if isinstance(following, ast.Expr) else None
        if isinstance(text, ast.Constant) and isinstance(text.value, str):
            found |= {name: " ".join(text.value.split()) for name in _names(node)}
    return found


def _names(node: ast.stmt) -> list[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return [target.id for target in targets if isinstance(target, ast.Name)]


def first_sentence(owner: object) -> str:
    """Return the first paragraph of a docstring."""
    return " ".join((inspect.getdoc(owner) or "").split("\n\n")[0].split())
