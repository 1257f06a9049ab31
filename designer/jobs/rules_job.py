"""The verb ``rules``: the design rules on a design folder and its board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from designer.board.kicad_reader import BoardFile, check_belongs
from designer.board.kicad_rules import board_rules
from designer.catalog.design_rule import FAIL, RuleOutcome
from designer.catalog.fab import fab_limits
from designer.check.synthesis_result import Synthesis
from designer.design_rules import on_board as rule_board, run_rules
from designer.design_rules.kicad_program import kicad_version
from designer.design_rules.rule_subject import RuleSubject
from designer.model.model_file import errors_in


@dataclass(frozen=True)
class RulesAnswer:
    """What the rules say of a design."""

    outcomes: tuple[RuleOutcome, ...]
    """Every rule and what became of it."""
    kicad: str | None
    """Version of the program that checked the board; None where it was not checked."""

    @property
    def passed(self) -> bool:
        """Whether no rule fails; what was not run does not fail."""
        return all(o.status != FAIL for o in self.outcomes)


def checked(
    synthesis: Synthesis, board: BoardFile | None = None, makers: Sequence[str] = ()
) -> RulesAnswer:
    """Every rule on a design, and on its board if there is one. makers : the fabs that shall make
    it; of none the limits of most hold.

    Raises
    ------
    InputError : the board is not of this design, or a part is not in the catalogue.
    """
    limits = synthesis.modelfile.rules
    with errors_in(synthesis.modelfile):
        subject = RuleSubject.of(synthesis)
        custom = board_rules(subject.circuit, limits)
    listed = subject.components
    if board is not None:
        check_belongs(board, listed)
    on_circuit = run_rules.on_circuit(subject, limits)
    if board is None:
        return RulesAnswer((*on_circuit, *rule_board.without_board(custom, limits)), None)
    fab = fab_limits(makers, synthesis.catalog.folders)
    on_board = rule_board.checked(board, listed, custom, limits, fab)
    return RulesAnswer((*on_circuit, *on_board), kicad_version())
