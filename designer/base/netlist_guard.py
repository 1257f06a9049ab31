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


def check_netlist(netlist: str) -> None:
    """Refuse a deck that holds anything but elements, comments and the harmless dot cards.

    Allowed: a title line, element lines, ``*`` comments, ``+`` continuations, the cards in
    `CARDS`, models of the types in `MODEL_TYPES`, and nothing after ``.end``.

    Raises
    ------
    ValueError : with the number of the first offending line.
    """
    statements: list[tuple[int, str]] = []
    ended = 0
    for number, raw in enumerate(netlist.split("\n"), start=1):
        line = raw.strip(" \t")
        if not line.replace("\t", " ").isprintable():
            raise _refusal(number, line, "a control character")
        if number == 1:
            # The first line is the title, unless it makes ngspice take the deck for a script.
            if not line or line[0] in ".+" or _is_command(line):
                raise _refusal(number, line, "not a title")
        elif ended and line:
            raise _refusal(number, line, f"text after .end (line {ended})")
        elif line.startswith("*"):
            if _is_command(line):
                raise _refusal(number, line, "a comment that ngspice would execute")
        elif line.startswith("+"):
            if not statements:
                raise _refusal(number, line, "a continuation of nothing")
            first, text = statements[-1]
            _check_characters(number, line)
            statements[-1] = (first, f"{text} {line[1:]}")  # ngspice puts a blank there too
        elif line:
            _check_characters(number, line)
            statements.append((number, line))
            if line.lower() == ".end":
                ended = number
    if not ended:
        raise ValueError("netlist: no .end line")
    for number, text in statements:
        _check_statement(number, text)


def _is_command(comment: str) -> bool:
    return bool(re.match(r"\*\s*(#|ng_)", comment, re.IGNORECASE))


def _check_characters(number: int, line: str) -> None:
    if not line.isascii():
        raise _refusal(number, line, "a character outside ASCII")
    for character in _HARMFUL:
        if character in line:
            raise _refusal(number, line, f"the character {character}")


def _check_statement(number: int, text: str) -> None:
    if not text.startswith("."):
        if not _ELEMENT.match(text):
            raise _refusal(number, text, "not an element line")
        return
    card = text.split(maxsplit=1)[0].lower()
    if card not in CARDS:
        raise _refusal(number, text, f"the card {card}")
    if card == ".model":
        kind = _MODEL.match(text)
        if kind is None or kind[1].lower() not in MODEL_TYPES:
            raise _refusal(number, text, "a model of a type that is not allowed")


def _refusal(number: int, line: str, what: str) -> ValueError:
    return ValueError(f"netlist: line {number} is refused ({what}): {line[:80]!r}")
