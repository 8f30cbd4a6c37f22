"""Tables on narrow terminals."""

import io

import pytest
from rich.console import Console
from rich.table import Table

from hierroom.support.tables import print_table


def printed(width: int) -> str:
    table = Table(title="what an agent did")
    table.add_column("mixing\ntime", no_wrap=True)
    table.add_column("what it did")
    table.add_column("hitting time", justify="right")
    for name, text, number in (("keys-0-1-2-3-exit-4", "reached the exit in time", "[b]1,234.5[/b]"), ("a", "", "8")):
        table.add_row(name, text, number)
    stream = io.StringIO()
    print_table(table, Console(file=stream, width=width))
    return stream.getvalue()


@pytest.mark.parametrize("width", [1, 20, 40, 80, 200])
def test_unwrapped_columns_are_whole_at_any_width(width):
    text = printed(width)
    assert "keys-0-1-2-3-exit-4" in text
    assert "1,234.5" in text
    assert "mixing" in text
    assert "…" not in text
    lines = {len(line) for line in text.splitlines()[1:]}
    assert max(lines) <= max(width, 60)
