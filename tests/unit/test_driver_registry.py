"""The registry names entry points that exist."""

import importlib
from pathlib import Path

import pytest

from drivers import registry
from groundstation.errors import DriverError
from groundstation.settings.sections import DriverKind


def test_vehicle_entry_points_exist():
    module, _, function = registry.entry_point("ardrone").partition(":")
    assert callable(getattr(importlib.import_module(module), function))


def test_it_knows_every_kind_that_a_field_can_name():
    assert set(registry.ENTRY_POINTS) == set(DriverKind)


def test_every_kind_is_a_package_with_a_driver():
    for entry in registry.ENTRY_POINTS.values():
        module = entry.partition(":")[0]
        folder = Path(registry.__file__).parents[1] / Path(*module.split(".")[:-1])
        assert folder.is_dir(), module


def test_an_unknown_kind_is_named_with_the_known_ones():
    with pytest.raises(DriverError, match=r"mavlnk.*ardrone"):
        registry.entry_point("mavlnk")
