"""The mechanical model drawn with plain characters, for comments and for Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from designer.laws.law_elements import Law
from designer.model.lumped_elements import words_of

if TYPE_CHECKING:
    from designer.model.lumped_elements import Elements
    from designer.model.model import Dimensionless

_SPRING, _DAMPER, _NONE = "---/\\/\\/\\---", "----[=------", " " * 12
_PLATE_LEFT, _PLATE_RIGHT = "|-/\\/\\/\\-|", "|-/\\/\\/\\-|"
_MASS_1 = 33
"""Column of the left side of M1."""


def sketch(model: Dimensionless | None = None) -> str:
    """Lines of ASCII: two masses in a row from ground, the stops of M1, the forces.

    model : what it does not have is left out: a damper, a force, a stop. None : every part.
    """
    lower = model is None or (model.k0 > 0.0 and model.sides in ("both", "lower"))
    upper = model is None or (model.k0 > 0.0 and model.sides in ("both", "upper"))
    damper = _DAMPER if model is None or model.c > 0.0 else _NONE
    first = " --> P1 sin(Omega T)" if model is None or model.f20 < 1.0 else ""
    second = "'--> P2 sin(Omega T)" if model is None or model.f20 > 0.0 else ""
    rod = _MASS_1 + 3
    lines = []
    if lower or upper:
        names = f"{'K0' if lower else '':>{rod - 8}}{'B' if lower else '':>6}   "
        lines.append(names + (" B     K0" if upper else ""))
        left = _PLATE_LEFT if lower else ""
        lines.append(f"{left:>{rod - 4}}    |" + (f"    {_PLATE_RIGHT}" if upper else ""))
        lines.append(" " * rod + "|")
    rows = (
        ("|", _NONE, "+------+", _NONE, "+------+", ""),
        ("|", _SPRING, "|      |", _SPRING, "|      |", ""),
        ("|", "     K2     ", "|  M2  |", "     K1     ", "|  M1  |", first),
        ("|", damper, "|      |", _DAMPER, "|      |", ""),
        ("|", "     C2     " if damper is _DAMPER else _NONE, "+------+", "     C1     ",
         "+------+", ""),
    )  # fmt: skip
    lines += ["".join(row) for row in rows]
    mark = "|" if second else "'"
    lines.append(" " * 16 + f"{mark}--> x2" + " " * 13 + "'--> x1")
    if second:
        lines.append(" " * 16 + second)
    return "\n".join(line.rstrip() for line in lines)


def system_sketch(system: Elements) -> str:
    """Lines of ASCII for any system: the masses in a row from ground, what joins neighbours between
    them; a line for everything else."""
    row = ("|", *system.row)
    widths = [len(name) + 4 for name in row]
    widths[0] = 1
    springs = {frozenset(spring.between) for spring in system.shown_springs}
    laws = system.nonlinear.values()
    unnamed = [law for law in laws if not isinstance(law, Law)]
    springs |= {frozenset(law.factors) for law in unnamed if law.drawn == "spring"}
    dampers = {frozenset(damper.between) for damper in system.shown_dampers}
    pairs = [frozenset(name.replace("|", "ground") for name in row[i : i + 2])
             for i in range(len(row) - 1)]  # fmt: skip
    lines = []
    for joints, symbol in ((springs, _SPRING), (None, _NONE), (dampers, _DAMPER)):
        named = joints is None
        parts = ["|"]
        for pair, name, width in zip(pairs, row[1:], widths[1:], strict=True):
            parts.append(symbol if joints and pair in joints else _NONE)
            parts.append(f"[ {name} ]" if named else "|" + " " * (width - 2) + "|")
        lines.append("".join(parts))
    lines.append("")
    for kind, joints in (("spring", springs), ("damper", dampers)):
        apart = sorted(sorted(pair) for pair in joints - set(pairs))
        lines += [f"{kind}: {first} to {second}" for first, second in apart]
    for gap in system.gaps:
        sides = " and ".join(s for s in ("upper", "lower") if getattr(gap, s) is not None)
        lines.append(f"{gap.name}: {sides} stop, {words_of(gap)}")
    lines += [f"law {law.name}: {words_of(law)}" for law in system.laws]
    lines += [f"{law.WORDS}: {words_of(law)}" for law in unnamed]
    lines += [f"force on {force.on}" for force in system.forces]
    if system.base is not None:
        stops = "with it" if system.base.stops == "base" else "stay"
        lines.append(f"the ground moves, stops go {stops}".replace("go stay", "stay"))
    return "\n".join(line.rstrip() for line in lines)
