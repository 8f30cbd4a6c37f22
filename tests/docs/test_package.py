"""The package as it is installed: built from the source, and used where there is no source tree."""

import re
import sys
import tomllib
import zipfile
from pathlib import Path

import architecture
import pytest
from children import run_child

ROOT = Path(__file__).parents[2]
USE = """
import hierroom, hierroom.lab.report
agent = hierroom.load("learned-g")
print(hierroom.__file__, hierroom.__version__, agent.steps, sep="\\n")
"""


def run(*command: str | Path, **options) -> str:
    done = run_child(command, quiet_seconds=60, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("source")
    listed = run("git", "ls-files", "--cached", "--others", "--exclude-standard", "-z", cwd=ROOT).split("\0")
    for name in filter(None, listed):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes((ROOT / name).read_bytes())
    return folder


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source)
    (path,) = folder.glob("*.whl")
    return path


def test_package_imports_nothing_that_the_wheel_lacks():
    for path in architecture.files():
        assert not re.search(r"^ *(from|import) (benchmarks|examples|tests)\b", path.read_text(), re.MULTILINE), path


@pytest.mark.slow
def test_wheel_contains_only_the_package(source, wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    package = {path.relative_to(source).as_posix() for path in (source / "hierroom").rglob("*") if path.is_file()}
    assert names == {name for name in package if "__pycache__" not in name}
    assert {"hierroom/py.typed", "hierroom/weights/c.safetensors"} <= names
    assert any(name.startswith("hierroom/lab/report/templates/") for name in names)


@pytest.mark.slow
def test_wheel_works_without_the_source(wheel, tmp_path):
    target, empty = tmp_path / "site", tmp_path / "empty"
    empty.mkdir()
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", target, wheel)
    environment = {"PYTHONPATH": str(target), "PATH": "/usr/bin:/bin", "HOME": str(empty)}
    file, version, steps = run(sys.executable, "-c", USE, cwd=empty, env=environment).split()
    assert Path(file) == target / "hierroom" / "__init__.py"
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools_scm"]
    assert version == settings["fallback_version"]  # a copy without git
    assert int(steps) >= 3_000_000
    (script,) = (target / "bin").glob("hierroom*")
    assert run(script, "--version", cwd=empty, env=environment).strip() == version


def test_citation_and_changelog_have_the_next_version():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools_scm"]
    version = settings["fallback_version"].removesuffix(".dev0")
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"\n## {version} (" in (ROOT / "CHANGELOG.md").read_text()
