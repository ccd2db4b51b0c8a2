"""Packages that some tests need."""

import importlib
import os
from typing import Any

import pytest


def package(name: str) -> Any:
    """Returns a package, or skips the test that needs it where it is not installed. In CI it must be there."""
    if os.environ.get("CI"):
        return importlib.import_module(name)
    return pytest.importorskip(name)
