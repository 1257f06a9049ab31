"""The tables ``[[response]]`` of a model file: what a board shall show."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, ClassVar, Literal, NoReturn

from designer.base.errors import MISSING, InputError
from designer.base.json_schema import either
from designer.base.schema import Accepts, FileTable, choice, flag, literal, number, physical, span
from designer.base.si_unit import DIGITS, drive_text
from designer.dynamics.counts import MAX_PERIOD, Counts, read_counts
from designer.dynamics.orbit import SURE, WITHOUT_PERIOD, Orbit, OrbitStatus
from designer.model.model import SiScales
from designer.model.si_units import FREQUENCIES, angular_frequency

Twin = Literal["either", "exact"]

_OMEGA = 'a number > 0, or "best"'
_FREQUENCY = ("omega", "Omega", "frequency")
"""The keys that give a response's frequency."""


def _omega() -> Accepts:
    """None for "best"."""
    frequency = number("", _OMEGA, _positive)
    return Accepts(
        _OMEGA,
        lambda value: None if value == "best" else frequency.check(value),
        json=either(frequency.json, {"const": "best"}),
    )


def _positive(value: float) -> bool:
    return value > 0.0


def _frequency() -> Accepts:
    """A frequency in Hz, or a text with its unit; the value is in rad/s."""

    def check(value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError
        angular = angular_frequency(value)
        if not 0.0 < angular < math.inf:
            raise ValueError
        return angular

    expected = f"a number > 0 in Hz, or text such as {FREQUENCIES}"
    return Accepts(expected, check, json={"type": ["number", "string"]})


Wanted = Counts | OrbitStatus
"""What may be wanted: the n-p-q of a periodic response, or one of ``WITHOUT_PERIOD``."""


def read_wanted(text: str) -> Wanted:
    """What a text names.

    Raises
    ------
    ValueError : nothing that may be wanted.
    """
    return OrbitStatus(text) if text in WITHOUT_PERIOD else Counts.parse(text)


def _expect() -> Accepts:
    def check(value: object) -> Wanted:
        try:
            return read_wanted(str(value))
        except ValueError:
            raise ValueError from None

    expected = f'n-p-q such as "1-2-2", with n from 1 to {MAX_PERIOD} and p, q >= 0, or '
    expected += " or ".join(f'"{status}"' for status in sorted(WITHOUT_PERIOD))
    return Accepts(expected, check, json={"type": "string"})


def _clearance() -> Accepts:
    expected = "a number > 0, or a range [low, high] of numbers > 0"
    one, both = number("", expected, _positive), span("", expected, _positive)
    return Accepts(
        expected,
        lambda value: (both if isinstance(value, list) else one).check(value),
        json=either(one.json, both.json),
    )


@dataclass(frozen=True)
class Response(FileTable):
    """A response that the board shall show."""

    omega: Annotated[float | None, _omega()]
    """Dimensionless frequency; None for "best": the tool chooses it."""
    expect: Annotated[Wanted | None, _expect()] = None
    """The wanted n-p-q, "aperiodic" or "quasi-periodic"; None where any is of interest."""
    twin: Annotated[Twin, choice("either", "exact")] = "either"
    """"either" accepts the mirror twin of ``expect`` as well; "exact" does not."""
    symmetric: Annotated[bool | None, flag()] = None
    """Whether the orbit has to be symmetric (True), asymmetric (False) or either (None)."""
    b: Annotated[float | tuple[float, float] | None, _clearance()] = None
    """Clearance at which this response is wanted: a value, a range to choose from, or None for the
    model's own."""
    least_exponent: Annotated[float | None, number("", "a number > 0", _positive)] = None
    """Of an aperiodic response: the largest Lyapunov exponent is this at least, per unit of the
    model's time; None where any above 0 will do."""

    in_hertz: ClassVar[bool] = False
    """Whether people read ω in hertz, since it is in rad/s."""

    def as_dict(self) -> dict[str, Any]:
        """Plain data; the exponent where one is stated, so that studies of files without one keep
        their hashes."""
        out = asdict(self)
        if self.least_exponent is None:
            del out["least_exponent"]
        return out

    def place_text(self, digits: int = DIGITS) -> str:
        """Its drive frequency for people: "36 Hz" or "ω = 0.85"."""
        assert self.omega is not None
        return drive_text(
            self.omega, self.omega / (2.0 * math.pi) if self.in_hertz else None, digits
        )

    def completed(self, nominal: Orbit) -> Response:
        """The same; where nothing is expected, the nominal orbit's n-p-q or its twin is wanted, or
        a motion without a period as it is."""
        if self.expect is not None:
            return self
        shown = nominal.status if nominal.status in WITHOUT_PERIOD else nominal.counts
        return replace(self, expect=shown)

    @property
    def periodic(self) -> bool:
        """Whether an n-p-q is wanted."""
        return isinstance(self.expect, Counts)

    def accepts(self, counts: Counts) -> bool:
        """Whether these, or those of the mirror twin unless ``twin`` is "exact", are expected here;
        without an expectation, any are."""
        if self.expect is None or counts == self.expect:
            return True
        return self.twin != "exact" and counts.mirrored == self.expect

    def accepts_text(self, response: str, *, symmetric: bool) -> bool:
        """Whether a response in words, "1-2-2" or a status, survives as this one. The exponent is
        not looked at."""
        counts = read_counts(response)
        if counts is None:
            return response == self.expect
        return self.accepts(counts) and (symmetric or not self.symmetric)

    def difference(self, orbit: Orbit) -> str:
        """Why an orbit that has settled does not survive as this response; "" where it does.

        Boards are never exactly symmetric: ``symmetric = false`` refuses no orbit. Of one without a
        period the exponent is not looked at (``has_exponent``).
        """
        if orbit.status in WITHOUT_PERIOD:
            return "" if orbit.status is self.expect else str(orbit.status)
        if not self.accepts(orbit.counts):
            return f"to {orbit.response}"
        if self.symmetric and not orbit.symmetric:
            return f"asymmetric by {orbit.asymmetry:.2g} of the peak"
        return ""

    def has_exponent(self, value: float, error: float) -> bool | None:
        """Whether a largest exponent, with its standard error, per unit of the model's time, is
        ``least_exponent`` at least; None where it cannot be told from it."""
        if self.least_exponent is None:
            return True
        above = value - self.least_exponent
        return above > 0.0 if abs(above) > SURE * error else None


@dataclass(frozen=True)
class HertzResponse(Response):
    """A response of a model in SI units."""

    in_hertz: ClassVar[bool] = True


EXPECTED = ("expect", "twin", "symmetric", "least_exponent")
"""Keys by which a motion is judged; none changes it."""


@dataclass(frozen=True)
class ResponseTable(Response):
    """A response as a file states it."""

    omega: Annotated[float | None, _omega()] = None
    """Dimensionless frequency; None where another key gives it, or for "best"."""
    Omega: Annotated[float | None, physical("rad/s")] = None
    """Angular frequency [rad/s]."""
    frequency: Annotated[float | None, _frequency()] = None
    """The same of a key in Hz [rad/s]."""

    def response(
        self, keys: Iterable[str], index: int, si: SiScales | None, file: str | None
    ) -> Response:
        """The response at its dimensionless frequency.

        keys : those that the file has. index : number of the table in the file, from 1.

        Raises
        ------
        InputError : no frequency, or more than one; one in SI units without SI values of the model;
            a twin of nothing.
        """

        def refuse(key: str, found: object, expected: str) -> NoReturn:
            raise InputError(file, f"response[{index}].{key}", found, expected)

        frequency_keys = [key for key in _FREQUENCY if key in keys]
        if not frequency_keys:
            more = ", or Omega in rad/s, or frequency in Hz"
            refuse("omega", MISSING, _OMEGA + ("" if si is None else more))
        if len(frequency_keys) > 1:
            many = {2: "two", 3: "three"}[len(frequency_keys)]
            refuse(frequency_keys[-1], " and ".join(frequency_keys), f"one of the {many}")
        key, omega = frequency_keys[0], self.omega
        angular = self.frequency if self.Omega is None else self.Omega
        if angular is not None:
            if si is None:
                value, unit = (
                    (angular, "rad/s") if key == "Omega" else (angular / (2.0 * math.pi), "Hz")
                )
                refuse(key, value, f"omega: {key} in {unit} needs a table [mechanical]")
            omega = si.omega(angular)
            if not 0.0 < omega < math.inf:
                refuse(key, angular, "a frequency within the range of numbers")
        if self.twin == "exact" and self.expect is None:
            refuse("twin", literal(self.twin), "an expect that it can apply to")
        if isinstance(self.expect, OrbitStatus):
            for key in ("twin", "symmetric"):
                if key in keys:
                    refuse(
                        key,
                        literal(getattr(self, key)),
                        f'none beside expect = "{self.expect}", which has no twin',
                    )
        if self.least_exponent is not None and self.expect is not OrbitStatus.APERIODIC:
            expected = 'none without expect = "aperiodic"'
            refuse("least_exponent", self.least_exponent, expected)
        kind = HertzResponse if si == SiScales() else Response
        return kind(omega, self.expect, self.twin, self.symmetric, self.b, self.least_exponent)


def placed(
    table: Mapping[str, Any], omega: float | None, b: float | None, si: SiScales | None
) -> dict[str, Any]:
    """A table of a file with its response at another place; every other key stays as it is.

    omega : in the model's units; it is written by the key that the table gives its frequency by, in
    the unit of that key. b : the clearance. None : as the table has it. si : of the file.
    """
    other: dict[str, Any] = {} if b is None else {"b": b}
    if omega is None:
        return {**table, **other}
    key = next((key for key in _FREQUENCY if key in table), "omega")
    if key == "omega":
        return {**table, key: omega, **other}
    assert si is not None  # no file without SI values is read with such a key
    hertz = si.hertz(omega)
    text = f"{hertz!r} Hz" if key == "frequency" else 2.0 * math.pi * hertz
    return {**table, key: text, **other}
