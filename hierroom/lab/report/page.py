"""The report as one HTML file: templates filled with texts that are escaped, data as JSON, and the chart library."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from hierroom.support.files import to_json


def render_page(texts: Mapping[str, Any], data: Mapping[str, Any]) -> bytes:
    """Fill the templates with escaped texts, and with plain data that the page's scripts draw; return UTF-8."""
    loader = PackageLoader("hierroom.lab.report", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    page = environment.get_template("page.html")
    return page.render(**texts, data=script_json(data), plotly=_plotly()).encode("utf-8", "replace")


def script_json(value: Any) -> Markup:
    """Return plain types as JSON for a script element: nothing in it can end the element or begin another."""
    text = to_json(value, indent=None)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)


def _plotly() -> str:
    """Return the chart library, gzip as base64, a third of its size; the page unpacks it to draw charts."""
    from plotly.offline import get_plotlyjs

    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), 9, mtime=0)).decode()
