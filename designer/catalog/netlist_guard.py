"""What may reach ngspice.

ngspice does what a deck tells it. A comment that starts with ``*#`` is a command, text after
``.end`` is another deck, a model card can name a file or a program.
"""

from __future__ import annotations

import re

CARDS = frozenset(
    ".subckt .ends .model .param .func .tran .ic .nodeset .options .option .save .end .title "
    ".global .temp .ac .dc .op .noise".split()
)


MODEL_TYPES = frozenset(
    # SPICE devices
    "r c l sw csw d npn pnp njf pjf nmf pmf nmos pmos vdmos ltra urc "
    # XSPICE code models that only compute: others read files (filesource, d_state, table2d),
    # and from ngspice 42 on run programs (d_process, d_cosim)
    "gain summer mult divide limit climit ilimit slew hyst pwl int d_dt s_xfer aswitch".split()
)


_ELEMENT = re.compile(r"[A-Za-z][^\s]*\s")


_MODEL = re.compile(r"\.model\s+[^\s(]+\s+([A-Za-z_]\w*)\s*(?:[\s(]|$)", re.IGNORECASE)


_HARMFUL = '\\`"$;'  # joins lines, runs commands, names files, expands variables, hides text


class RefusedNetlist(ValueError):
    """A deck that is not given to ngspice.

    reason : why. line, text : number of the offending line from 1 and the line, if it is one.
    """

    def __init__(self, reason: str, line: int | None = None, text: str = "") -> None:
        self.reason = reason
        message = reason if line is None else f"line {line} is refused ({reason}): {text[:80]!r}"
        super().__init__(f"netlist: {message}")


def check_netlist(netlist: str) -> None:
    """Refuse a deck that holds anything but elements, comments and the harmless dot cards.

    Allowed: a title line, element lines, ``*`` comments, ``+`` continuations, the cards in
    `CARDS`, models of the types in `MODEL_TYPES`, and nothing after ``.end``.

    Raises
    ------
    RefusedNetlist : with the number of the first offending line.
    """
    statements: list[tuple[int, str]] = []
    ended = 0
    for number, raw in enumerate(netlist.split("\n"), start=1):
        line = raw.strip(" \t")
        if not line.replace("\t", " ").isprintable():
            raise RefusedNetlist("a control character", number, line)
        if number == 1:
            # The first line is the title, unless it makes ngspice take the deck for a script.
            if not line or line[0] in ".+" or _is_command(line):
                raise RefusedNetlist("not a title", number, line)
        elif ended and line:
            raise RefusedNetlist(f"text after .end (line {ended})", number, line)
        elif line.startswith("*"):
            if _is_command(line):
                raise RefusedNetlist("a comment that ngspice would execute", number, line)
        elif line.startswith("+"):
            if not statements:
                raise RefusedNetlist("a continuation of nothing", number, line)
            first, text = statements[-1]
            _check_characters(number, line)
            statements[-1] = (first, f"{text} {line[1:]}")  # ngspice puts a blank there too
        elif line:
            _check_characters(number, line)
            statements.append((number, line))
            if line.lower() == ".end":
                ended = number
    if not ended:
        raise RefusedNetlist("no .end line")
    for number, text in statements:
        _check_statement(number, text)


def _is_command(comment: str) -> bool:
    return bool(re.match(r"\*\s*(#|ng_)", comment, re.IGNORECASE))


def _check_characters(number: int, line: str) -> None:
    if not line.isascii():
        raise RefusedNetlist("a character outside ASCII", number, line)
    for character in _HARMFUL:
        if character in line:
            raise RefusedNetlist(f"the character {character}", number, line)


def _check_statement(number: int, text: str) -> None:
    if not text.startswith("."):
        if not _ELEMENT.match(text):
            raise RefusedNetlist("not an element line", number, text)
        return
    card = text.split(maxsplit=1)[0].lower()
    if card not in CARDS:
        raise RefusedNetlist(f"the card {card}", number, text)
    if card == ".model":
        kind = _MODEL.match(text)
        if kind is None or kind[1].lower() not in MODEL_TYPES:
            raise RefusedNetlist("a model of a type that is not allowed", number, text)
