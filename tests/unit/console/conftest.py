"""Fixtures of the console server's tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
