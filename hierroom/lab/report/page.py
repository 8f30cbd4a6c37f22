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
    """Fill the templates: a page in UTF-8.

    Args:
        texts: what the page's template shows; every character is shown as it is.
        data: plain types, from which the page's scripts draw.
    """
    loader = PackageLoader("hierroom.lab.report", "templates")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    page = environment.get_template("page.html")
    return page.render(**texts, data=script_json(data), plotly=_plotly()).encode("utf-8", "replace")


def script_json(value: Any) -> Markup:
    """Plain types as JSON that can stand in a script element: nothing in it can end the element or begin another."""
    text = to_json(value, indent=None)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)


def _plotly() -> str:
    """The chart library, gzip as base64: a third of its size. It is unpacked by the page when charts are drawn."""
    from plotly.offline import get_plotlyjs

    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), 9, mtime=0)).decode()
