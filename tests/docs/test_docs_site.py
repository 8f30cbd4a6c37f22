"""The site is built in strict mode: a broken link, a missing anchor or an unknown name in the reference fails it."""

import importlib.util
import os
from pathlib import Path

import pytest
from children import run_python

ROOT = Path(__file__).parents[2]
NEEDED = ("mkdocs", "material", "mkdocstrings")
missing = [name for name in NEEDED if importlib.util.find_spec(name) is None]
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing), reason=f"the extra docs is not installed: {', '.join(missing)}"),
]


def build(folder: Path, source: Path = ROOT):
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    return run_python("-m", "mkdocs", "build", "--strict", "--site-dir", folder, cwd=source, env=environment)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = build(folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_site_has_every_page(site):
    assert {path.stem for path in (ROOT / "docs").glob("*.md")} | {"index", "404"} == {
        path.stem for path in site.glob("*.html")
    }


def test_linked_files_outside_docs_are_in_the_site(site):
    shown = site / "examples" / "clients" / "torchrl_ppo.py"
    assert shown.read_bytes() == (ROOT / "examples" / "clients" / "torchrl_ppo.py").read_bytes()
    assert 'href="examples/clients/torchrl_ppo.py"' in (site / "clients.html").read_text()
    assert 'href="environments.html#who-observes-what"' in (site / "index.html").read_text()
