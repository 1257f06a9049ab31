"""Quantities against hand-written values, exact decimal arithmetic and published part numbers."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from designer.base.eseries import SERIES, eseries
from designer.base.units import (
    VALUE_CODES,
    decode_value,
    encode_value,
    format_quantity,
    parse_quantity,
)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("22.1k", "Ω", 22.1e3),
        ("22.1 kΩ", "Ω", 22.1e3),
        ("22.1 k\N{OHM SIGN}", "Ω", 22.1e3),
        ("22.1kohm", "Ω", 22.1e3),
        ("4k7", "Ω", 4700.0),
        ("4K7", "Ω", 4700.0),
        ("4R7", "Ω", 4.7),
        ("100R", "Ω", 100.0),
        ("1M", "Ω", 1e6),
        ("1M2", "Ω", 1.2e6),
        ("1m", "Ω", 1e-3),
        ("1e3", "Ω", 1e3),
        ("1.5e-3k", "Ω", 1.5),
        ("100nF", "F", 1e-7),
        ("100n", "F", 1e-7),
        ("2n2", "F", 2.2e-9),
        ("10 µF", "F", 1e-5),
        ("10 μF", "F", 1e-5),
        ("10uF", "F", 1e-5),
        ("4µ7", "F", 4.7e-6),
        ("5m", "m", 5.0),
        ("5mm", "m", 5e-3),
        ("0.5 m", "m", 0.5),
        ("12 kN/m", "N/m", 12e3),
        ("12 N/mm", "N/m", 12e3),
        ("9 V/µs", "V/s", 9e6),
        ("9 mV/us", "V/s", 9e3),
        ("200 V/mV", "V/V", 200e3),
        ("20 nV/√Hz", "V/√Hz", 20e-9),
        ("55 N s/m", "N s/m", 55.0),
        ("55 N·s/m", "N s/m", 55.0),
        ("240 rad/s", "rad/s", 240.0),
        ("2.5 kg", "kg", 2.5),
        ("500 g", "kg", 0.5),
        ("2.5", "kg", 2.5),
        ("-3 mV", "V", -3e-3),
        (" 15 ", "V", 15.0),
        (".5", "V", 0.5),
        ("5.", "V", 5.0),
        ("+5", "", 5.0),
        (15, "V", 15.0),
        (1.5, "", 1.5),
    ],
)
def test_reads_what_engineers_write(text: str | float, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("value", "unit"),
    [
        ("", "Ω"),
        ("  ", "Ω"),
        ("abc", "Ω"),
        ("k", "Ω"),
        ("1,5k", "Ω"),
        ("1 2", "Ω"),
        ("1_000", "Ω"),
        ("1Meg", "Ω"),
        ("100nF", "Ω"),
        ("22.1k", "kg"),
        ("22.1 kkg", "kg"),
        ("4R7", "F"),
        ("9 A/µs", "V/s"),
        ("9 V/µm", "V/s"),
        ("4.5k7", "Ω"),
        ("0x10", "Ω"),
        ("nan", "Ω"),
        ("inf", "Ω"),
        ("1e999", "Ω"),
        ("1e9999999999", "Ω"),
        ("1" * 65, "Ω"),
        ("٣k", "Ω"),
        (math.nan, "Ω"),
        (math.inf, "Ω"),
        (-math.inf, "Ω"),
        (True, "Ω"),
        (False, ""),
        (None, ""),
        ([1.0], ""),
        (10**400, ""),
    ],
)
def test_refuses_what_is_no_quantity(value: object, unit: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        parse_quantity(value, unit)  # type: ignore[arg-type]


def test_message_names_the_unit() -> None:
    with pytest.raises(ValueError, match="in F"):
        parse_quantity("100nH", "F")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (22.1e3, "", "22.1k"),
        (22.1e3, "Ω", "22.1kΩ"),
        (1e-7, "F", "100nF"),
        (1e-5, "F", "10µF"),
        (1e6, "Ω", "1MΩ"),
        (4.7, "Ω", "4.7Ω"),
        (0.0, "V", "0V"),
        (-0.0, "V", "0V"),
        (-3e-3, "V", "-3mV"),
        (999.96, "", "1k"),
        (999.4, "", "999.4"),
        (1234567.0, "", "1.235M"),
        (2500.0, "kg", "2500kg"),
        (1e-20, "F", "1e-20F"),
        (1e20, "", "1e20"),
    ],
)
def test_writes_with_a_prefix(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text


def test_rounds_to_the_digits_that_are_asked_for() -> None:
    assert format_quantity(math.pi, "V", digits=3) == "3.14V"
    assert format_quantity(12345.0, "Ω", digits=2) == "12kΩ"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_does_not_write_what_is_no_number(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        format_quantity(value)


def test_needs_a_digit() -> None:
    with pytest.raises(ValueError, match="digits"):
        format_quantity(1.0, digits=0)


series_values = st.builds(
    lambda mantissa, decade: float(f"{mantissa}e{decade}"),
    st.sampled_from(sorted({each for name in SERIES for each in eseries(name)})),
    st.integers(min_value=-17, max_value=10),
)
units = st.sampled_from(["", "Ω", "F", "V", "m", "N/m", "Hz", "kg"])


@given(series_values, units, st.integers(min_value=3, max_value=17))
def test_series_values_survive_exactly(value: float, unit: str, digits: int) -> None:
    assert parse_quantity(format_quantity(value, unit, digits), unit) == value


@given(
    st.floats(min_value=1e-30, max_value=1e30) | st.floats(min_value=-1e30, max_value=-1e-30),
    units,
)
def test_seventeen_digits_keep_any_number(value: float, unit: str) -> None:
    assert parse_quantity(format_quantity(value, unit, 17), unit) == value


@given(st.floats(min_value=1e-14, max_value=1e14), st.integers(min_value=1, max_value=6))
def test_rounding_is_within_half_a_digit(value: float, digits: int) -> None:
    shown = parse_quantity(format_quantity(value, "", digits), "")
    assert abs(Fraction(shown) / Fraction(value) - 1) <= Fraction(1, 2 * 10 ** (digits - 1)) * (
        1 + Fraction(1, 10**9)
    )


@given(
    st.integers(min_value=-(10**6), max_value=10**6),
    st.integers(min_value=0, max_value=6),
    st.sampled_from([("p", -12), ("n", -9), ("u", -6), ("µ", -6), ("m", -3), ("", 0), ("k", 3)]),
)
def test_scaling_is_correctly_rounded(number: int, places: int, prefix: tuple[str, int]) -> None:
    text = f"{number / 10**places:.{places}f}{prefix[0]}V"
    exact = Fraction(f"{number / 10**places:.{places}f}") * Fraction(10) ** prefix[1]
    assert parse_quantity(text, "V") == float(exact)


@pytest.mark.parametrize(
    ("code", "value", "text"),
    [
        # Yageo RC0603 data sheet: 5R6, 56R, 560R, 5K6, 56K; RT: 9R76, 97R6, 9K76, 9M76, 1R, 1K, 1M.
        ("yageo", 5.6, "5R6"),
        ("yageo", 56.0, "56R"),
        ("yageo", 560.0, "560R"),
        ("yageo", 5600.0, "5K6"),
        ("yageo", 56e3, "56K"),
        ("yageo", 9.76, "9R76"),
        ("yageo", 97.6, "97R6"),
        ("yageo", 9760.0, "9K76"),
        ("yageo", 9.76e6, "9M76"),
        ("yageo", 1.0, "1R"),
        ("yageo", 1e3, "1K"),
        ("yageo", 1e6, "1M"),
        ("yageo", 22.1e3, "22K1"),
        ("yageo", 100e3, "100K"),
        # EIA three-digit codes: 102 is 1 nF, 103 is 10 nF, 104 is 100 nF, 220 is 22 pF.
        ("eia3", 1e-9, "102"),
        ("eia3", 10e-9, "103"),
        ("eia3", 100e-9, "104"),
        ("eia3", 22e-12, "220"),
        ("eia3", 4.7e-9, "472"),
        # Vishay Roederstein: 310 is 10 nF, 322 is 22 nF, 410 is 100 nF, 510 is 1 µF.
        ("multiplier-first", 10e-9, "310"),
        ("multiplier-first", 22e-9, "322"),
        ("multiplier-first", 100e-9, "410"),
        ("multiplier-first", 1e-6, "510"),
        # Vishay's chips: CRCW060310K0FKEA is 10 kΩ, TNPW060340K2BEEA 40.2 kΩ.
        ("vishay", 10e3, "10K0"),
        ("vishay", 40.2e3, "40K2"),
        ("vishay", 1.0, "1R00"),
        ("vishay", 620e3, "620K"),
        ("vishay", 1e6, "1M00"),
        # Vishay MRS, document 28724: 5119 is 51.1 Ω; 1829 is 18.2 Ω.
        ("decade", 51.1, "5119"),
        ("decade", 18.2, "1829"),
        ("decade", 1.0, "1008"),
        ("decade", 22.1e3, "2212"),
        ("decade", 10e6, "1005"),
        # Panasonic EEU-FC1H100: 10 µF; EEU-FC1V101: 100 µF.
        ("microfarads", 10e-6, "100"),
        ("microfarads", 100e-6, "101"),
        ("plain", 22.1e3, "22.1k"),
        ("plain", 4.7e-6, "4.7u"),
    ],
)
def test_codes_of_part_numbers(code: str, value: float, text: str) -> None:
    assert encode_value(code, value) == text
    assert decode_value(code, text) == value


@pytest.mark.parametrize(
    ("code", "value"),
    [
        ("yageo", 1.234),
        ("yageo", 0.5),
        ("yageo", 1e9),
        ("yageo", 0.0),
        ("yageo", -1.0),
        ("yageo", math.nan),
        ("eia3", 1.05e-9),
        ("eia3", 1e-12),
        ("eia3", 1e-2),
        ("multiplier-first", 1.21e-9),
        ("vishay", 1.234),
        ("vishay", 0.5),
        ("vishay", 1e9),
        ("decade", 1.234),
        ("decade", 1e-2),
        ("decade", 1e9),
        ("microfarads", 1e-6),
        ("microfarads", 12.5e-6),
        ("morse", 1.0),
    ],
)
def test_codes_refuse_what_they_cannot_spell(code: str, value: float) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        encode_value(code, value)


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("yageo", "22k1"),
        ("yageo", "K1"),
        ("eia3", "10"),
        ("eia3", "998"),
        ("vishay", "10K"),
        ("vishay", "1000"),
        ("decade", "0109"),
        ("decade", "100K"),
        ("microfarads", "10"),
        ("morse", "…"),
    ],
)
def test_codes_refuse_what_is_not_theirs(code: str, text: str) -> None:
    with pytest.raises(ValueError, match=r"\w"):
        decode_value(code, text)


def test_every_code_round_trips_over_its_values() -> None:
    for mantissa in eseries("E192") + eseries("E24"):
        for decade in range(-2, 5):
            value = float(f"{mantissa}e{decade}")
            for code in ("yageo", "vishay", "decade"):
                assert decode_value(code, encode_value(code, value)) == value
    for mantissa in eseries("E24"):
        for decade in range(-13, -6):
            value = float(f"{mantissa}e{decade}")
            for code in ("eia3", "multiplier-first", "plain"):
                assert decode_value(code, encode_value(code, value)) == value
    for mantissa in eseries("E24"):
        for decade in range(-7, -2):
            value = float(f"{mantissa}e{decade}")
            assert decode_value("microfarads", encode_value("microfarads", value)) == value
    resistors = {"yageo", "vishay", "decade"}
    capacitors = {"eia3", "multiplier-first", "microfarads"}
    assert set(VALUE_CODES) == {*resistors, *capacitors, "plain"}
