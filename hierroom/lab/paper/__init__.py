"""The paper's tables and figures, with our numbers next to the paper's."""
