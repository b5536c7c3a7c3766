"""The registry names entry points that exist."""

import importlib
from pathlib import Path

from drivers import registry


def test_vehicle_entry_points_exist():
    module, _, function = registry.entry_point("ardrone").partition(":")
    assert callable(getattr(importlib.import_module(module), function))


def test_every_kind_is_a_package_with_a_driver():
    for entry in registry.ENTRY_POINTS.values():
        module = entry.partition(":")[0]
        folder = Path(registry.__file__).parents[1] / Path(*module.split(".")[:-1])
        assert folder.is_dir(), module
