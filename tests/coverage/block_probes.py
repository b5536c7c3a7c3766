"""Records which statements of a source have run: a probe at the start of each basic block of a function.

A probe is one store into an array of bytes. Kernels have none: they run compiled. Nor have functions that write a
kernel's instructions: they run only where it is not in the cache yet. Why not a library:
docs/decisions/0079-coverage-by-probes.md.
"""

import ast

HITS = "__hits__"
# Functions that numba compiles, or calls during compilation.
COMPILED = frozenset({"kernel", "njit", "jit", "overload", "intrinsic", "lower_cast", "in_lanes"})
# Modules that import from here write instructions.
_INSTRUCTIONS = "llvmlite"

Function = ast.FunctionDef | ast.AsyncFunctionDef
_COMPOUND = (ast.If, ast.For, ast.AsyncFor, ast.While, ast.Try, ast.TryStar, ast.With, ast.AsyncWith, ast.Match)


class Probes:
    """The number of statements after each probe."""

    def __init__(self) -> None:
        self.statements: list[int] = []

    def add(self, before: ast.stmt) -> ast.stmt:
        """Return a new probe, placed before this statement."""
        target = ast.Subscript(ast.Name(HITS, ast.Load()), ast.Constant(len(self.statements)), ast.Store())
        self.statements.append(0)
        return ast.fix_missing_locations(ast.copy_location(ast.Assign([target], ast.Constant(1)), before))


def put_probes(tree: ast.Module) -> Probes:
    """Put probes into the functions of a module's tree; return their statement counts."""
    probes = Probes()
    if not any(isinstance(each, ast.ImportFrom) and each.module == _INSTRUCTIONS for each in tree.body):
        _enter(tree.body, probes)
    return probes


def _enter(body: list[ast.stmt], probes: Probes) -> None:
    """Search for functions in places where nothing is counted: modules, classes, and compiled functions."""
    for statement in body:
        if isinstance(statement, Function):
            if not _is_compiled(statement):
                statement.body = _probed(statement.body, probes)
        elif isinstance(statement, ast.ClassDef | ast.If | ast.Try):
            _enter(statement.body, probes)


def _is_compiled(function: Function) -> bool:
    nodes = [node for each in function.decorator_list for node in ast.walk(each)]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    return bool(COMPILED & (names | {node.attr for node in nodes if isinstance(node, ast.Attribute)}))


def _probed(body: list[ast.stmt], probes: Probes) -> list[ast.stmt]:
    """Return a body with probes at its start and after each compound statement, which may return or raise."""
    result: list[ast.stmt] = []
    current = -1
    for statement in body:
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            result.append(statement)  # a docstring or `...`
            continue
        if current < 0:
            current = len(probes.statements)
            result.append(probes.add(statement))
        probes.statements[current] += 1
        result.append(statement)
        if isinstance(statement, Function | ast.ClassDef):
            _enter([statement], probes)
        elif isinstance(statement, _COMPOUND):
            _enter_branches(statement, probes)
            current = -1
    return result


def _enter_branches(statement: ast.stmt, probes: Probes) -> None:
    for name in ("body", "orelse", "finalbody"):
        if getattr(statement, name, None):
            setattr(statement, name, _probed(getattr(statement, name), probes))
    for branch in (*getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
        branch.body = _probed(branch.body, probes)
