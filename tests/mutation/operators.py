"""Mutations of a module's source, one at a time: comparisons, constants, conditions, statements, return values."""

import ast
import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt), ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,), ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}  # fmt: skip
ARITHMETIC: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr, ast.LShift: ast.RShift, ast.RShift: ast.LShift,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A changed source. name: place and change, without line numbers, so that it survives edits elsewhere."""

    name: str
    line: int
    source: str


Place = tuple[str, int, str]  # field of a node, index in it (-1: no list), name of the enclosing function


def mutants_of(source: str) -> list[Mutant]:
    """Return all mutants of a source, in order of lines; equal names are numbered."""
    tree = ast.parse(source)
    found, counts = [], dict[str, int]()
    for path, scope in _paths(tree):
        for what, change in _changes(_at(tree, path)):
            other = copy.deepcopy(tree)
            before = _text(_at(other, path))
            replaced = change(_at(other, path))
            _put(other, path, replaced)
            text = ast.unparse(ast.fix_missing_locations(other))
            if text == ast.unparse(tree):
                continue
            name = f"{scope}: {what}: {before} -> {_text(replaced)}"
            counts[name] = counts.get(name, 0) + 1
            name += f" #{counts[name]}" if counts[name] > 1 else ""
            found.append(Mutant(name, getattr(_at(tree, path), "lineno", 0), text))
    return sorted(found, key=lambda one: one.line)


Path = tuple[tuple[str, int], ...]


def _paths(tree: ast.AST) -> Iterator[tuple[Path, str]]:
    """Yield the path of every node that may be changed, with the qualified name of its function."""

    def walk(node: ast.AST, path: Path, scope: str) -> Iterator[tuple[Path, str]]:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            scope = f"{scope}.{node.name}".lstrip(".")
        yield path, scope or "module"
        for field, value in ast.iter_fields(node):
            if field in ("decorator_list", "annotation", "returns", "type_params", "bases", "keywords") and not (
                field == "keywords" and isinstance(node, ast.Call)
            ):
                continue
            for index, child in enumerate(value) if isinstance(value, list) else [(-1, value)]:
                if isinstance(child, ast.AST) and not _is_words(child):
                    yield from walk(child, (*path, (field, index)), scope)

    return walk(tree, (), "")


def _is_words(node: ast.AST) -> bool:
    """Return whether it is a docstring, or text for people."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return True
    logs = isinstance(node, ast.Expr) and ast.unparse(node).startswith(("_log.", "log."))
    return logs or isinstance(node, ast.JoinedStr | ast.Import | ast.ImportFrom)


def _at(tree: ast.AST, path: Path) -> ast.AST:
    node = tree
    for field, index in path:
        node = getattr(node, field) if index < 0 else getattr(node, field)[index]
    return node


def _put(tree: ast.AST, path: Path, new: ast.AST) -> None:
    if path:
        field, index = path[-1]
        parent = _at(tree, path[:-1])
        if index < 0:
            setattr(parent, field, new)
        else:
            getattr(parent, field)[index] = new


def _text(node: ast.AST) -> str:
    text = " ".join(ast.unparse(ast.fix_missing_locations(node)).split())
    return text if len(text) <= 90 else f"{text[:87]}..."


Change = tuple[str, Callable[[Any], ast.AST]]


def _changes(node: ast.AST) -> Iterator[Change]:
    match node:
        case ast.Compare(ops=[operator]):
            for kind in COMPARISONS.get(type(operator), ()):
                yield "comparison", partial(_compared, kind)
        case ast.BinOp(op=operator) if type(operator) in ARITHMETIC:
            yield "arithmetic", lambda n: _with(n, op=ARITHMETIC[type(n.op)]())
        case ast.BoolOp():
            yield "boolean", lambda n: _with(n, op=ast.Or() if isinstance(n.op, ast.And) else ast.And())
        case ast.UnaryOp(op=ast.Not()):
            yield "boolean", lambda n: n.operand
        case ast.Constant(value=bool()):
            yield "boolean", lambda n: ast.Constant(not n.value)
        case ast.Constant(value=int() | float()):
            yield "constant", lambda n: ast.Constant(n.value + 1)
            yield "constant", lambda n: ast.Constant(n.value - 1)
        case ast.If() | ast.While() | ast.IfExp():
            yield "condition", lambda n: _with(n, test=ast.UnaryOp(ast.Not(), n.test))
        case ast.Return(value=ast.expr() as value) if not (isinstance(value, ast.Constant) and value.value is None):
            yield "return", lambda _: ast.Return(ast.Constant(None))
        case ast.Expr() | ast.Assign() | ast.AugAssign() | ast.Raise():
            yield "removed", lambda _: ast.Pass()


def _compared(kind: type[ast.cmpop], node: ast.AST) -> ast.AST:
    return _with(node, ops=[kind()])


def _with(node: ast.AST, **fields: object) -> ast.AST:
    for name, value in fields.items():
        setattr(node, name, value)
    return node
