"""The pages of the docs, and what is in them: code blocks by language, commands line by line."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).parents[1]
PAGES = {path.name: path.read_text() for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))}
_BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^\1```$", re.DOTALL | re.MULTILINE)
_INLINE = re.compile(r"(?<!`)`((?:python|pytest|make|mkdocs) [^`]+)`(?!`)")


@dataclass(frozen=True)
class Block:
    """A fenced block: the page it is on, its language and its text."""

    page: str
    language: str
    text: str


BLOCKS = [Block(page, b[2], dedent(b[3])) for page, text in PAGES.items() for b in _BLOCK.finditer(text)]


def lines_of(block: Block) -> list[str]:
    """The commands of a block: its lines, continued ones joined, without comments."""
    lines = block.text.replace("\\\n", " ").splitlines()
    return [shlex.join(shlex.split(line, comments=True)) for line in lines if line.strip()]


def commands() -> dict[str, list[str]]:
    """By page each command on it, in a block without a language or in a sentence."""
    found = {page: [" ".join(text.split()) for text in _INLINE.findall(text)] for page, text in PAGES.items()}
    for block in BLOCKS:
        if block.language == "":
            found[block.page] += lines_of(block)
    return {page: sorted(set(lines)) for page, lines in found.items()}
