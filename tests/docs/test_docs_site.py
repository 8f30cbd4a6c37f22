"""The site is built in strict mode: a broken link, a missing anchor or an unknown name in the reference fails it."""

import importlib.util
import os
import re
import shutil
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


def test_pages_load_no_external_resources(site):
    for path in site.glob("*.html"):
        loaded = re.findall(r'<(?:script|img|link|iframe)[^>]*?(?:src|href)="(https?:[^"]*)"', path.read_text())
        assert not loaded, path.name


def test_broken_links_fail_the_build(tmp_path):
    (tmp_path / "docs" / "scripts").mkdir(parents=True)
    shutil.copy(ROOT / "docs" / "scripts" / "outside_pages.py", tmp_path / "docs" / "scripts")
    (tmp_path / "mkdocs.yml").write_text((ROOT / "mkdocs.yml").read_text().split("\nnav:")[0])
    (tmp_path / "README.md").write_text("# Home\n\n[own](docs/own.md#goals)\n")
    page = tmp_path / "docs" / "own.md"
    page.write_text("# Own\n\n## Goals\n\n[home](../README.md)\n")
    assert build(tmp_path / "site", tmp_path).returncode == 0
    links = ("gone.md", "../examples/gone.py", "../README.md#gone")
    page.write_text("# Own\n\n## Goals\n\n" + "\n".join(f"[gone]({link})" for link in links))
    done = build(tmp_path / "site", tmp_path)
    assert done.returncode != 0
    for link in ("gone.md", "../examples/gone.py", "#gone"):
        assert link in done.stderr
