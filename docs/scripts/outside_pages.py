"""Add to the site what is outside ``docs/``: README.md as its first page, files that pages link to, and tables.

A row of tables.md that links to a CSV file becomes a heading, a sentence and the table in that file.

Links are written for those who read the pages in the repository. In the site ``docs/own.md`` is ``own.md`` and
``examples/aec.py`` keeps its path; a link to something that does not exist is left, so that a strict build names it.
"""

from __future__ import annotations

import csv
import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from hierroom.support.tables import markdown_table

LINK = re.compile(r"(\]\()(?![a-z]+:|[#/])([^)\s#]+)")
ROW = re.compile(r"^\| \[([^]]+)\]\((\S+\.csv)\)(?:<!-- .+? -->)? \| (.+) \|$", re.MULTILINE)
HEADER = "| table | what it shows |\n|---|---|\n"
HOME = "README.md"
TABLES = "tables.md"


def in_repository(page: str) -> str:
    """Return the path of a page of the site in the repository."""
    return page if page == HOME else f"docs/{page}"


def in_site(page: str, target: str, root: Path) -> str | None:
    """Return the place in the site of a link's target (a path in the repository); None if there is no such file."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), target))
    return path.removeprefix("docs/") if (root / path).is_file() else None


def with_table(row: re.Match[str], folder: Path) -> str:
    """Write the row of a table as a heading, its sentence and the table itself."""
    name, link, sentence = row.groups()
    with (folder / link).open(newline="", encoding="utf-8") as file:
        headings, *rows = csv.reader(file)
    return f"\n### {name}\n\n{sentence} ([CSV]({link}))\n\n{markdown_table(headings, rows)}\n\n"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add README.md, and the files outside ``docs/`` that it or another page links to."""
    root = Path(config.config_file_path).parent
    home = File.generated(config, HOME, content=(root / HOME).read_text())
    files.append(home)
    for page in files.documentation_pages():
        source = in_repository(page.src_uri)
        for _, target in LINK.findall(page.content_string):
            path = in_site(source, target, root)
            if path is not None and files.get_file_from_path(path) is None:
                files.append(File.generated(config, path, abs_src_path=str(root / path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Write the links as they are in the site."""
    root, source = Path(config.config_file_path).parent, in_repository(page.file.src_uri)
    if page.file.src_uri == TABLES:
        markdown = ROW.sub(lambda row: with_table(row, root / "docs"), markdown.replace(HEADER, ""))
    return LINK.sub(lambda link: link[1] + (in_site(source, link[2], root) or link[2]), markdown)
