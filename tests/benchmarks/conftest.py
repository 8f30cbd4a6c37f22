from pathlib import Path

import pytest


def pytest_collection_modifyitems(items):
    """Scripts of frozen results guard no rule of the package: only make test-all runs their tests."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.slow)
