"""The docstring of every public name has an example, and the examples print what they show."""

import doctest
import inspect
import pkgutil
import re

import gymnasium
import numpy as np
import pytest
from doc_pages import PAGES

import hierroom
import hierroom.complexity
import hierroom.meta
from hierroom.controller import Observation

MODULES = (hierroom, hierroom.complexity)
NEEDED = {"minari_dataset": ("minari", "h5py"), "minigrid_view": ("minigrid",), "sb3_view": ("stable_baselines3",)}


def public_names() -> dict[str, object]:
    """Return the public names: those exported, those on the API page, and those that user code meets."""
    found = [getattr(module, name) for module in MODULES for name in module.__all__]
    found += [pkgutil.resolve_name(name) for name in re.findall(r"^::: (\S+)", PAGES["api.md"], re.MULTILINE)]
    found += [hierroom.meta.MetaController, hierroom.meta.make_meta, Observation]
    return {f"{one.__module__}.{one.__qualname__}": one for one in found if not inspect.ismodule(one)}


@pytest.mark.parametrize("name", sorted(public_names()))
def test_docstring_example_prints_the_shown_output(name, tmp_path, monkeypatch):
    for module in NEEDED.get(name.rpartition(".")[2], ()):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    names = {"hierroom": hierroom, "gymnasium": gymnasium, "np": np}
    text = inspect.getdoc(public_names()[name]) or ""
    example = doctest.DocTestParser().get_doctest(text, names, name, None, None)
    assert any(one.want for one in example.examples), "an example prints a result"
    said: list[str] = []
    assert doctest.DocTestRunner().run(example, out=said.append).failed == 0, "".join(said)
