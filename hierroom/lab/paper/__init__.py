"""The paper's tables and figures: its own numbers, and ours next to them."""

from hierroom.lab.paper.published import PAPER_TABLE_2, PAPER_TABLE_3
from hierroom.lab.paper.table2 import TableCell, table_2

__all__ = ["PAPER_TABLE_2", "PAPER_TABLE_3", "TableCell", "table_2"]
