"""Numbers with units: text at the boundary, SI floats inside.

``parse_quantity`` reads what an engineer writes ("22.1k", "100nF", "4k7", "10 µF");
``format_quantity`` writes it back. Prefixes are those of the SI: ``M`` is mega and ``m`` is milli,
unlike SPICE, where both are milli. All scaling is decimal, so "22.1k" is the same float as 22.1e3.

Part numbers spell values in codes of their own; ``encode_value`` and ``decode_value`` know the
ones that the catalogues name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_EVEN, Context, Decimal
from functools import lru_cache

_PREFIXES = {
    "f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "": 0, "k": 3, "K": 3, "M": 6, "G": 9, "T": 12,
}  # fmt: skip
_PREFIX_OF = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
_MICRO = str.maketrans({"µ": "u", "μ": "u"})
_OHM = "Ω"
_OHMS = ("Ω", "\N{OHM SIGN}", "ohms", "ohm", "Ohms", "Ohm", "R")
# Digits are not given back: of a long text that is no number each part would be tried again.
_NUMBER = r"[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d{1,3})?"
_PREFIXED = re.compile(rf"({_NUMBER})\s*([fpnumkKMGT]?)", re.ASCII)
_INFIX = re.compile(r"([+-]?\d+)([fpnumkKMGTR])(\d+)", re.ASCII)
ACCELERATIONS = {"g": 9.80665, "m/s²": 1.0}
"""Units of an acceleration, in m/s²."""
_POWERS = ("²", "^2", "2", "**2")
"""How the square of a unit may be written."""
_LONGEST = 64  # characters; a quantity is never longer


def parse_quantity(value: str | float, unit: str) -> float:
    """The SI value of a number, or of a text such as "22.1k", "4k7", "100nF" or "12 kN/m".

    Parameters
    ----------
    value : a number is taken as it is; a text may carry a prefix, the unit, or both.
    unit : what the quantity is measured in, such as "Ω", "F", "N/m"; "" for a bare number.
        A text that ends in the unit is read with it first: for metres "5m" is 5 m, "5mm" 5e-3 m.
        The unit after the slash may carry a prefix too: for V/s "9 V/µs" is 9e6 V/s.

    Raises
    ------
    ValueError : not a finite number, an unknown prefix, or another unit; the message says which.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"not a number: a {type(value).__name__}")
    if not isinstance(value, str):
        try:
            result = float(value)
        except OverflowError:
            raise ValueError("too large for a number") from None
        if not math.isfinite(result):
            raise ValueError("not a finite number")
        return result
    text = value.strip()
    if not text or len(text) > _LONGEST:
        raise ValueError("not a number: " + ("empty text" if not text else "a very long text"))
    number, shift = _split(text, unit)
    result = float(number.scaleb(shift))
    if not math.isfinite(result):
        raise ValueError("too large for a number")
    return result


def parse_angle(value: str | float) -> float:
    """An angle in rad: a number is one, a text may be in rad, deg or °.

    Raises
    ------
    ValueError : as ``parse_quantity``.
    """
    if isinstance(value, str):
        degrees = value.strip().removesuffix("°").removesuffix("deg")
        if degrees != value.strip():
            return math.radians(parse_quantity(degrees, ""))
        if is_bare_milli(value):
            raise ValueError('"m" alone is no unit of an angle')
    return parse_quantity(value, "rad")


def is_bare_milli(text: str) -> bool:
    """Whether a text is a number and an m alone: milli, where its writer may mean metres."""
    return re.fullmatch(rf"{_NUMBER}\s*m", text.strip(), re.ASCII) is not None


def format_quantity(value: float, unit: str = "", digits: int = 4) -> str:
    """``value`` with an SI prefix and ``unit``: 22100.0, "Ω" gives "22.1kΩ"; 1e-7, "F" "100nF".

    Rounded to ``digits`` significant digits. ``parse_quantity`` reads the text back, exactly where
    the value has no more digits than that (as every E-series value has for digits >= 3).
    """
    if not math.isfinite(value):
        raise ValueError("not a finite number")
    if digits < 1:
        raise ValueError("digits must be at least 1")
    exact = Decimal(repr(float(value)))
    if not exact:
        return f"0{unit}"
    rounded = Context(prec=digits, rounding=ROUND_HALF_EVEN).plus(exact)
    exponent = 3 * math.floor(rounded.adjusted() / 3)
    if unit == "kg":  # carries a prefix already
        exponent = 0
    if exponent not in _PREFIX_OF:
        return f"{_plain(rounded.scaleb(-rounded.adjusted()))}e{rounded.adjusted()}{unit}"
    return f"{_plain(rounded.scaleb(-exponent))}{_PREFIX_OF[exponent]}{unit}"


def axis_label(quantity: str, unit: str) -> str:
    """What stands at an axis; the unit in brackets where there is one."""
    return f"{quantity} [{unit}]" if unit else quantity


def restated(value: float, unit: str, like: str) -> str:
    """``value`` in the unit and prefix of another text of this unit, in no more digits than it
    takes to read it back: 5.5e-4, "m" is "0.55 mm" like "0.4 mm", "550µm" like "400µm"."""
    written = re.fullmatch(rf"{_NUMBER}(\s*)(.*)", like.strip(), re.ASCII | re.DOTALL)
    space, ending = (written[1], written[2]) if written else ("", "")
    try:
        factor = parse_quantity(f"1{space}{ending}", unit)
    except ValueError:  # such as 4k7
        space, ending, factor = " ", unit, 1.0
    return shortest(lambda text: parse_quantity(text, unit), value, value / factor, space + ending)


def shortest(read: Callable[[str], float], value: float, number: float, ending: str) -> str:
    """``number`` and ``ending`` in the fewest digits that ``read`` makes ``value`` of; in all of
    them where none gives it to the last digit."""
    for digits in range(1, 18):
        figure = f"{number:.{digits}g}"
        if 1e-5 < abs(number) < 1e15:
            figure = f"{Decimal(figure):f}"
        if read(figure + ending) == value:
            return figure + ending
    return f"{number!r}{ending}"


def spaced_quantity(value: float, unit: str, digits: int = 4) -> str:
    """``format_quantity`` as pages and pictures write it, "22.1 kΩ": the space does not break.
    Lengths are in mm down to 0.01 mm, masses below 1 kg in g."""
    if unit == "m" and 1e-5 <= abs(value) < 1.0:  # mechanical lengths
        return f"{1e3 * value:.{digits}g}\u00a0mm"
    if unit == "kg" and 0.0 < abs(value) < 1.0:
        value, unit = 1e3 * value, "g"
    elif unit in ("kg", "g"):  # it has a prefix already; accelerations in g are written without one
        return f"{value:.{digits}g}\u00a0{unit}"
    text = format_quantity(value, unit, digits).removesuffix(unit)
    figure = text.rstrip("fpnµmkMGT")
    return f"{figure}\u00a0{text[len(figure) :]}{unit}"


def distinct_texts(values: Sequence[float], digits: int, most: int = 12) -> list[str]:
    """Each value in ``digits`` significant digits, or in as many more as tell those that differ in
    ``most`` digits apart."""
    different = len({f"{value:.{most}g}" for value in values})
    while digits < most and len({f"{value:.{digits}g}" for value in values}) < different:
        digits += 1
    return [f"{value:.{digits}g}" for value in values]


@lru_cache(maxsize=65536)  # each reading of a catalogue spells every value of it
def encode_value(code: str, value: float) -> str:
    """``value`` (ohm or farad) as the named code of a part number spells it.

    "yageo": 22100.0 is "22K1"; "vishay": 10000.0 is "10K0"; "decade": 22100.0 is "2212", 18.2 is
    "1829"; "eia3": 1e-9 is "102"; "multiplier-first": 2.2e-8 is "322"; "microfarads": 1e-5 is
    "100"; "plain": 22100.0 is "22.1k".

    Raises
    ------
    ValueError : no such code, or a value that the code cannot spell.
    """
    if code not in VALUE_CODES:
        raise ValueError(f"no such code: {code}")
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError("not a finite number > 0")
    return VALUE_CODES[code].encode(value)


def decode_value(code: str, text: str) -> float:
    """The value that ``text`` spells in the named code: the inverse of ``encode_value``."""
    if code not in VALUE_CODES:
        raise ValueError(f"no such code: {code}")
    return VALUE_CODES[code].decode(text)


def _split(text: str, unit: str) -> tuple[Decimal, int]:
    """Number and power of ten of a text that may end in ``unit``."""
    if unit == "kg":
        return _split_mass(text)
    normal = text.translate(_MICRO)
    bare, per = _without_denominator(_without_unit(normal, unit), unit)
    infix = _INFIX.fullmatch(bare)
    if infix and (infix[2] != "R" or unit == _OHM):
        shift = 0 if infix[2] == "R" else _PREFIXES[infix[2]]
        return Decimal(f"{infix[1]}.{infix[3]}"), shift - per
    prefixed = _PREFIXED.fullmatch(bare)
    if prefixed:
        return Decimal(prefixed[1]), _PREFIXES[prefixed[2]] - per
    if re.match(_NUMBER, bare, re.ASCII):
        wanted = f"in {unit}, with or without an SI prefix" if unit else "without a unit"
        raise ValueError(f"not a number {wanted}")
    raise ValueError("not a number")


def _split_mass(text: str) -> tuple[Decimal, int]:
    """The kilogram is a unit with a prefix of its own: "2.5", "2.5 kg", "500 g", "3 Mg"."""
    plain = re.fullmatch(_NUMBER, text, re.ASCII)
    if plain:
        return Decimal(text), 0
    if not text.endswith("g"):
        raise ValueError("not a number in kg")
    number, shift = _split(text, "g")
    return number, shift - 3


def _without_unit(text: str, unit: str) -> str:
    for spelling in _spellings(unit):
        if spelling and text.endswith(spelling):
            return text.removesuffix(spelling).rstrip()
    return text


def _spellings(unit: str) -> Sequence[str]:
    if unit.endswith("²"):
        return [unit.removesuffix("²") + power for power in _POWERS]
    return _OHMS if unit == _OHM else (unit, unit.replace(" ", "·"), unit.replace(" ", ""))


def has_unit(text: str, unit: str) -> bool:
    """Whether a text is a number with this unit, which may have a prefix."""
    spellings = "|".join(map(re.escape, _spellings(unit)))
    written = text.strip().translate(_MICRO)
    return re.fullmatch(rf"{_NUMBER}\s*[fpnumkMGT]?({spellings})", written, re.ASCII) is not None


def _without_denominator(text: str, unit: str) -> tuple[str, int]:
    """A text without a unit such as V/us for V/s; the power of ten of the denominator's prefix."""
    above, slash, below = unit.partition("/")
    if not slash or not below[0].isalpha():  # V/√Hz has no prefix below
        return text, 0
    above = "[ ·]?".join(map(re.escape, above.split(" ")))
    match = re.fullmatch(rf"(.*?)\s*{above}\s*/\s*([fpnumkMGT]){re.escape(below)}", text)
    return (match[1], _PREFIXES[match[2]]) if match else (text, 0)


def _plain(number: Decimal) -> str:
    """Digits without exponent and without zeros after the last one that counts."""
    text = f"{number:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _significant(value: float, most: int) -> tuple[int, int]:
    """``value`` as an integer of at most ``most`` digits times a power of ten."""
    digits, exponent = Decimal(repr(float(value))).normalize().as_tuple()[1:]
    if len(digits) > most or not isinstance(exponent, int):
        raise ValueError(f"this code spells at most {most} significant digits")
    return int("".join(map(str, digits))), exponent


@dataclass(frozen=True)
class _PointCode:
    """Digits with R, K or M as the decimal point."""

    padded: bool = False
    """Whether there are always three digits."""

    def encode(self, value: float) -> str:
        _significant(value, 3)
        for letter, power in (("M", 6), ("K", 3), ("R", 0)):
            scaled = Decimal(repr(float(value))).scaleb(-power)
            if 1 <= scaled < 1000:
                digits, _, rest = _plain(scaled).partition(".")
                zeros = "0" * (3 - len(digits) - len(rest)) if self.padded else ""
                return f"{digits}{letter}{rest}{zeros}"
        raise ValueError("this code spells 1 Ω to less than 1 GΩ")

    def decode(self, text: str) -> float:
        match = re.fullmatch(r"(\d{1,3})([RKM])(\d{0,2})", text, re.ASCII)
        if not match or (self.padded and len(text) != 4):
            digits = "three digits" if self.padded else "digits"
            raise ValueError(f"expected {digits} with R, K or M as the decimal point")
        power = {"R": 0, "K": 3, "M": 6}[match[2]]
        return float(f"{match[1]}.{match[3] or 0}e{power}")


@dataclass(frozen=True)
class _PowerCode:
    """Digits, and one character for the power of ten."""

    digits: int
    powers: str
    """The character of each power, from ``least`` on."""
    least: int
    """The least power of ten, in ohm or farad."""
    spells: str
    """The values that it spells, in words."""
    power_first: bool = False
    """Whether the power stands in front of the digits."""

    def encode(self, value: float) -> str:
        number, exponent = _significant(value, self.digits)
        missing = self.digits - len(str(number))
        place = exponent - missing - self.least
        if not 0 <= place < len(self.powers):
            raise ValueError(f"this code spells {self.spells}")
        text, power = str(number * 10**missing), self.powers[place]
        return power + text if self.power_first else text + power

    def decode(self, text: str) -> float:
        power, number = (text[:1], text[1:]) if self.power_first else (text[-1:], text[:-1])
        fits = re.fullmatch(rf"[1-9]\d{{{self.digits - 1}}}", number, re.ASCII)
        if not fits or power not in self.powers:
            order = "after" if self.power_first else "before"
            raise ValueError(f"expected {self.digits} digits {order} one for the power of ten")
        return float(f"{number}e{self.powers.index(power) + self.least}")


class _PlainCode:
    """A number with its prefix."""

    def encode(self, value: float) -> str:
        return format_quantity(value, digits=15).replace("µ", "u")

    def decode(self, text: str) -> float:
        return parse_quantity(text, "")


VALUE_CODES: dict[str, _PointCode | _PowerCode | _PlainCode] = {
    "yageo": _PointCode(),
    "eia3": _PowerCode(2, "01234567", -12, "10 pF to 990 µF"),
    "multiplier-first": _PowerCode(2, "01234567", -12, "10 pF to 990 µF", power_first=True),
    "vishay": _PointCode(padded=True),
    "decade": _PowerCode(3, "7890123456", -3, "0.1 Ω to 999 MΩ"),
    "microfarads": _PowerCode(2, "01234567", -6, "10 µF to 990 F"),
    "plain": _PlainCode(),
}
"""How part numbers spell values, by the name of the code."""
