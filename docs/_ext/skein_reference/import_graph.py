"""The import graph of the packages, read from the sources, and its layers."""

import ast
from collections import defaultdict
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("groundstation", "drivers", "sim_bridge")
Graph = dict[str, set[str]]


def import_graph() -> Graph:
    """Return each package with those that it imports directly.

    A package is one below the three at the top, or a module that stands beside such packages; of `drivers` and
    `sim_bridge` the modules beside packages count as the package itself, with those packages that import them back.
    """
    paths = {_name(path, root): path for root in _roots() for path in sorted(root.rglob("*.py"))}
    graph: Graph = defaultdict(set)
    for module, path in paths.items():
        targets = {target if target in paths else target.rpartition(".")[0] for target in _imports(path)}
        graph[_node(module, paths)] |= {_node(target, paths) for target in targets if target in paths}
    merged = {node: _merged_into(node, graph) for node in graph}
    result: Graph = {merged[node]: set() for node in graph}
    for node, others in graph.items():
        result[merged[node]] |= {merged[other] for other in others} - {merged[node]}
    return {node: others for node, others in result.items() if others or node != PACKAGES[0]}


def layers(graph: Graph) -> list[list[str]]:
    """Return the packages in layers, lowest first: each imports lower layers only; raises ValueError for a circle."""
    rank: dict[str, int] = {}

    def visit(node: str, above: tuple[str, ...] = ()) -> int:
        if node in above:
            raise ValueError(f"packages import each other in a circle: {' -> '.join((*above, node))}")
        if node not in rank:
            rank[node] = 1 + max((visit(other, (*above, node)) for other in sorted(graph[node])), default=-1)
        return rank[node]

    for node in sorted(graph):
        visit(node)
    return [sorted(node for node in graph if rank[node] == level) for level in range(max(rank.values()) + 1)]


def reduced(graph: Graph) -> Graph:
    """Return the graph without the imports that longer ways imply."""
    implied = {node: {far for other in graph[node] for far in _reachable(other, graph)} for node in graph}
    return {node: graph[node] - implied[node] for node in graph}


def _reachable(node: str, graph: Graph) -> set[str]:
    found: set[str] = set()
    waiting = [node]
    while waiting:
        new = graph.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def _merged_into(node: str, graph: Graph) -> str:
    top = node.partition(".")[0]
    return top if node in _reachable(top, graph) and top in _reachable(node, graph) else node


def _node(module: str, paths: dict[str, Path]) -> str:
    top, _, rest = module.partition(".")
    inner = f"{top}.{rest.partition('.')[0]}"
    is_package = inner in paths and paths[inner].name == "__init__.py"
    return inner if rest and (is_package or top == PACKAGES[0]) else top


def _roots() -> list[Path]:
    found = [find_spec(package) for package in PACKAGES]
    return [Path(spec.origin).parent for spec in found if spec is not None and spec.origin is not None]


def _name(path: Path, root: Path) -> str:
    parts = path.relative_to(root.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found
