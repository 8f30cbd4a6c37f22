"""A meta-controller that asks: what it may choose goes out as text, and the answer comes back as text.

Anything that answers a text can be asked: a language model, a person, a script. An answer that names no legal goal
counts as none, and the first legal goal is taken instead.

    python -m hierroom.train --meta asking_meta:AskingPerson
    python -m hierroom.train --task my_tasks:taxi --meta asking_meta:AskingPerson --steps 500
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import hierroom


class AskingMeta:
    """Puts each choice in words, asks for a goal, and understands the answer.

    Args:
        ask: from a question to an answer, such as a call of a language model.
        introduction: what stands above each question.
    """

    def __init__(self, ask: Callable[[str], str], introduction: str = "You choose goals for an agent.") -> None:
        self._ask, self._introduction = ask, introduction
        self.statistics: Mapping[str, float] = {"asked": 0, "not_understood": 0}

    def choose(self, observations, legal, situation) -> np.ndarray:
        """Ask for each environment that has a choice; without one nobody is asked."""
        return np.array([self._goal(situation.level(m), np.flatnonzero(legal[m]).tolist()) for m in range(len(legal))])

    def _goal(self, level: Any, legal: list[int]) -> int:
        names = {goal.id: goal.name for goal in level.goals}
        if len(legal) < 2:
            return legal[0] if legal else -1
        answer = self._ask(self.question(level, [names[goal] for goal in legal]))
        chosen = self.named(answer, {goal: names[goal] for goal in legal})
        is_understood = len(chosen) == 1
        self.statistics = {
            "asked": self.statistics["asked"] + 1,
            "not_understood": self.statistics["not_understood"] + (not is_understood),
        }
        return chosen[0] if is_understood else legal[0]

    @staticmethod
    def named(answer: str, names: Mapping[int, str]) -> list[int]:
        """Return the goals that an answer names; of `key 1` and `key 12` the longer one, where it stands."""
        found = {goal: name.lower() for goal, name in names.items() if name.lower() in answer.lower()}
        return [goal for goal, name in found.items() if not any(name in other != name for other in found.values())]

    def question(self, level: Any, legal: list[str]) -> str:
        """Return what is asked: what was achieved in the episode so far, and what may be chosen."""
        achieved = [goal.name for goal in level.goals if goal.achieved]
        return "\n".join(
            [
                self._introduction,
                f"Achieved so far: {', '.join(achieved) or 'nothing'}.",
                f"Goals that can be chosen: {', '.join(legal)}.",
                "Which goal comes next? Answer with its name alone.",
            ]
        )


class AskingPerson(AskingMeta):
    """Asks whoever sits at the terminal."""

    def __init__(self) -> None:
        super().__init__(lambda question: input(f"\n{question}\n> "))


def first_named(question: str) -> str:
    """Answer as a script would: with the first goal that can be chosen."""
    return question.partition("Goals that can be chosen: ")[2].partition(",")[0]


if __name__ == "__main__":
    questions: list[str] = []

    def answer(question: str) -> str:
        """Answer a question, and keep it."""
        questions.append(question)
        return f"I would say: the {first_named(question)}!"

    episodes = list(hierroom.rollout(hierroom.load("f", meta=AskingMeta(answer)), episodes=5))
    print(
        f"{questions[-1]}\n{sum(e.success for e in episodes)} of 5 episodes escaped, {len(questions)} questions asked"
    )
