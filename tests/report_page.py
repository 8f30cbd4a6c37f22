"""Reading a report's page back, and a run that tries to be more than text on it."""

from __future__ import annotations

import base64
import gzip
import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import evaluated_runs

import hierroom

HOSTILE = "<img src=x onerror=alert(1)>&lt;b&gt;{{7*7}}'\""
VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """The elements of a page: their tags and attributes, its text, and what its scripts hold; tags must be closed."""

    def __init__(self, path: Path):
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.scripts: dict[str | None, str] = {}
        self.text = ""
        self._open: list[tuple[str, dict]] = []
        self.source = path.read_text(encoding="utf-8")
        self.feed(self.source)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop()[0] == tag, self.getpos()

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1][0] == "script":
            identity = self._open[-1][1].get("id")
            self.scripts[identity] = self.scripts.get(identity, "") + data
        elif self._open and self._open[-1][0] != "style":
            self.text += data

    @property
    def data(self) -> dict[str, Any]:
        """The page's data."""
        return json.loads(self.scripts["data"])

    @property
    def plotly(self) -> str:
        """The chart library, unpacked."""
        return gzip.decompress(base64.b64decode(self.scripts["plotly"])).decode()


def hostile_run(folder: Path) -> Path:
    """A run with a folder, graph and provenance that try to be more than text."""
    path = folder / HOSTILE
    graph = hierroom.GoalGraph((0,), 1, label="</script><script>alert(2)</script>")
    evaluated_runs.make_run(path, {graph.name: evaluated_runs.line(1.0)}, graph=(graph,))
    given = {"started": "<svg onload=alert(3)>", "command": "</dd></dl><script>alert(4)</script>"}
    sessions = [{**given, "packages": {"<b>": "</b>"}}, "no session"]
    (path / "provenance.json").write_text(json.dumps({"sessions": sessions}))
    return path
