import math
import os
import signal

import pytest
from hypothesis import settings

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # windows are opened, on no screen
settings.register_profile("hierroom", settings.default, deadline=None)  # how long one takes depends on the load
settings.load_profile("hierroom")
# In the background of a shell SIGINT is ignored, and commands that tests start and interrupt inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser):
    parser.addoption("--cases", type=int, metavar="N", help="run at most N cases of each test, evenly spread")


@pytest.hookimpl(trylast=True)  # after -m and -k
def pytest_collection_modifyitems(config, items):
    if (most := config.getoption("--cases")) is None:
        return
    tests = {}
    for item in items:
        tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    kept = {case for cases in tests.values() for case in cases[:: math.ceil(len(cases) / most)]}
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = [item for item in items if item in kept]


@pytest.fixture
def one_thread():
    """PyTorch uses one thread: at the sizes of tests two wait for each other more than they compute."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture
def heeded_hangup():
    """Do not ignore SIGHUP, which is ignored where the tests run under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)
