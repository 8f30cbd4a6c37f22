"""Modules with one small error each, made by the operators of cosmic-ray: one error for each place."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code
from cosmic_ray.plugins import get_operator

BINARY = (
    "Add_Sub Sub_Add Mul_Div Div_Mul FloorDiv_Mul Mod_Mul Pow_Mul BitOr_BitAnd BitAnd_BitOr BitXor_BitOr LShift_RShift"
)
COMPARISONS = "Lt_LtE LtE_Lt Gt_GtE GtE_Gt Eq_NotEq NotEq_Eq Is_IsNot IsNot_Is"
UNARY = "USub_UAdd Delete_Not Delete_Invert"
OPERATORS = (
    *(f"ReplaceBinaryOperator_{name}" for name in f"{BINARY} RShift_LShift".split()),
    *(f"ReplaceComparisonOperator_{name}" for name in COMPARISONS.split()),
    *(f"ReplaceUnaryOperator_{name}" for name in UNARY.split()),
    *("ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "AddNot"),
    *("NumberReplacer", "ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop"),
)
"""Replacements; of another number there are two, of which the greater is taken."""


@dataclass(frozen=True)
class Mutant:
    """A module with one small error: a line's number, the line before and after, and the whole source."""

    number: int
    before: str
    after: str
    source: str

    def __str__(self) -> str:
        """The line and what became of it."""
        return f"{self.number}: {self.before}  ->  {self.after}"


def mutants(source: str) -> Iterator[Mutant]:
    """Yield each mutant of a module that differs from it by more than annotations."""
    tree, right = get_ast(source), _meaning(source)
    for name in OPERATORS:
        operator, seen = get_operator(f"core/{name}")(), set()
        places = [place for node in ast_nodes(tree) for place in operator.mutation_positions(node)]
        for occurrence, place in enumerate(places):
            if place in seen:
                continue
            seen.add(place)
            changed = mutate_code(source, operator, occurrence)
            if changed is None or _meaning(changed) in (right, None):
                continue
            lines = zip(source.splitlines(), changed.splitlines(), strict=False)
            number, before, after = next((n, a, b) for n, (a, b) in enumerate(lines, start=1) if a != b)
            yield Mutant(number, before.strip(), after.strip(), changed)


def _meaning(source: str) -> str | None:
    """Return a module's syntax tree without annotations, which nobody evaluates; None for text that is not Python."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return None
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                setattr(node, name, ast.Constant(None))
    return ast.dump(tree)
