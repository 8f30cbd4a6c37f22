"""Made-up tables for the tests of the study."""


def run_rows(steps, method="hippo", **columns):
    return [
        {"method": method, "graph": graph, "seed": str(seed), "steps_to_95": "" if n is None else str(n), **columns}
        for graph, several in steps.items()
        for seed, n in enumerate(several)
    ]


def measured_rows(graphs, twins=(), **measures):
    """Rows of measures, a value of each for each graph, and those of the twins of some, which are the same."""
    rows = [
        {"graph": graph, "twin_of": "", **{name: str(values[i]) for name, values in measures.items()}}
        for i, graph in enumerate(graphs)
    ]
    return [*rows, *({**rows[graphs.index(of)], "graph": f"{of}-twin", "twin_of": of} for of in twins)]
