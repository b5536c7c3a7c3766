"""Imports the product's modules with probes, from their sources; the compiled code is never cached."""

import ast
import importlib.abc
import importlib.machinery
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType
from typing import Any

from block_probes import HITS, put_probes

MEASURED = ("groundstation", "drivers", "sim_bridge")


class ProbingLoader(SourceFileLoader):
    """Loads one module and keeps its probes in the common table."""

    def __init__(self, name: str, path: str, hits: dict[str, bytearray]) -> None:
        super().__init__(name, path)
        self._hits = hits

    def get_code(self, fullname: str) -> CodeType:
        """Compile the source with probes."""
        path = self.get_filename(fullname)
        tree = ast.parse(self.get_data(path), path)
        self._hits[path] = bytearray(len(put_probes(tree).statements))
        return compile(tree, path, "exec", dont_inherit=True)

    def exec_module(self, module: ModuleType) -> None:
        """Run the module with its table of hits in its namespace."""
        code = self.get_code(module.__name__)
        vars(module)[HITS] = self._hits[self.path]
        exec(code, vars(module))


class ProbingFinder(importlib.abc.MetaPathFinder):
    """Finds the product's modules before all other finders."""

    def __init__(self) -> None:
        self.hits: dict[str, bytearray] = {}

    def find_spec(self, fullname: str, path: Sequence[str] | None, target: Any = None) -> ModuleSpec | None:
        """Return the usual specification of a module with a loader that puts probes in."""
        if fullname.partition(".")[0] not in MEASURED:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = ProbingLoader(fullname, spec.loader.path, self.hits)
        return spec
