"""The node of one vehicle, with its driver."""

import pytest
from ros2_node import Node


@pytest.fixture
def node(monkeypatch: pytest.MonkeyPatch) -> Node:
    return Node(monkeypatch)
