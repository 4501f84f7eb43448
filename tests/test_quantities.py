import math
from typing import Annotated

import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError
from pydantic_core import PydanticCustomError

from exudyn_flexlink.quantities import (
    UNITS,
    USUAL,
    Dimension,
    Measure,
    Number,
    PositiveLength,
    find_unit,
    to_si,
)

REGISTRY = pint.UnitRegistry()


def pints(name):
    """Factor and powers of a unit, by an independent library."""
    quantity = REGISTRY.Quantity(1.0, REGISTRY.parse_units(name)).to_base_units()
    return quantity.magnitude, dict(quantity.unit_items())


def found(name):
    return find_unit(name, Dimension.LENGTH)


def powers_of(unit):
    names = ("meter", "kilogram", "second", "radian")
    return {name: power for name, power in zip(names, unit.powers, strict=True) if power}


@pytest.mark.parametrize("name", [*UNITS, *USUAL])
def test_every_unit_is_pints(name):
    factor, powers = pints(name)
    assert found(name).factor == pytest.approx(factor, rel=1e-15)
    assert powers_of(found(name)) == powers


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from([" ", "/"]),
            st.sampled_from(["m", "mm", "kg", "ms", "rad", "N", "(N m)", "(kg/m^3)", "rpm"]),
            st.sampled_from(["", "^2", "^3", "^-1"]),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_products_powers_and_parentheses_are_read_as_pint_reads_them(parts):
    name = "1" + "".join(map("".join, parts))
    factor, powers = pints(name)
    assert found(name).factor == pytest.approx(factor, rel=1e-13)
    assert powers_of(found(name)) == powers


def test_units_of_ten_are_exact():
    """A hundredth of a centimetre cubed is not off by rounding: 7.85 g/cm^3 is 7850 kg/m^3."""
    for name, factor in {"mm": 1e-3, "g/cm^3": 1e3, "mm^4": 1e-12, "N/um": 1e6}.items():
        assert found(name).factor == factor


@pytest.mark.parametrize("dimension", [item for item in Dimension if item.example])
def test_every_example_and_every_si_unit_is_of_its_dimension(dimension):
    assert to_si(dimension.example, dimension) > 0
    if dimension.si not in ("metres", "radians", "seconds"):
        assert to_si(f"1 {dimension.si}", dimension) == 1.0


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("5 mm", Dimension.LENGTH, 5e-3),
        (" -.5e1 cm ", Dimension.LENGTH, -0.05),
        ("5 µm", Dimension.LENGTH, 5e-6),
        ("90°", Dimension.ANGLE, math.pi / 2),
        ("60 rpm", Dimension.ANGULAR_SPEED, 2 * math.pi),
        ("360 deg / s", Dimension.ANGULAR_SPEED, 2 * math.pi),
        ("1 turn/min", Dimension.ANGULAR_SPEED, 2 * math.pi / 60),
        ("7.85 g / cm**3", Dimension.DENSITY, 7850),
        ("5 N·m", Dimension.TORQUE, 5),
        ("5 mNm", Dimension.TORQUE, 5e-3),
        ("5 Ncm", Dimension.TORQUE, 5e-2),
        ("5 Nm / deg", Dimension.TORSIONAL_STIFFNESS, 5 * 180 / math.pi),
        ("5 Nms/rad", Dimension.TORSIONAL_DAMPING, 5),
        ("5 Nm·s/rad", Dimension.TORSIONAL_DAMPING, 5),
        ("5 nm", Dimension.LENGTH, 5e-9),
        ("5 pm", Dimension.LENGTH, 5e-12),
        ("45 Grad", Dimension.ANGLE, math.pi / 4),
        ("45 Grad/s", Dimension.ANGULAR_SPEED, math.pi / 4),
        ("5 msec", Dimension.TIME, 5e-3),
        ("5 cNm", Dimension.TORQUE, 5e-2),
        ("5 daN", Dimension.FORCE, 50),
        *(
            (f"60{unit}", Dimension.ANGULAR_SPEED, 2 * math.pi)
            for unit in (" U/min", " min-1", " min⁻¹", " 1/min", "/min", " r/min", " tr/min")
        ),
        ("601/min", Dimension.ANGULAR_SPEED, 601 * 2 * math.pi / 60),
        ("60 1/min", Dimension.FREQUENCY, 1),
        ("401/s", Dimension.FREQUENCY, 401),
        ("5 N m", Dimension.TORSIONAL_STIFFNESS, 5),
        ("5 N s m/rad", Dimension.TORSIONAL_DAMPING, 5),
        ("10 kN/mm^1.5", Measure.stiffness(1.5), 1e4 * 1e3**1.5),
        ("2 Pa m^0.9", Measure.stiffness(1.1), 2),
        (7, Dimension.LENGTH, 7.0),
        (0.5, Dimension.NUMBER, 0.5),
    ],
)
def test_quantities_in_si(text, dimension, value):
    assert to_si(text, dimension) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("value", "dimension", "words"),
    [
        ("5 N", Dimension.LENGTH, "got '5 N'; a number in metres, or a length such as '5 mm'"),
        ("5 m^1.5", Dimension.LENGTH, "expected a length, got '5 m^1.5'"),
        ("5 m^1.5.2", Dimension.LENGTH, "unknown unit"),
        ("5 m^0.5", Dimension.NUMBER, "expected a number, got '5 m^0.5'"),
        ("5 mmm", Dimension.LENGTH, "unknown unit 'mmm'; did you mean 'mm'?"),
        ("5 Gm", Dimension.LENGTH, "unknown unit 'Gm'"),
        ("5 Mm", Dimension.LENGTH, "unknown unit 'Mm'; did you mean 'mm'?"),
        ("5 Ms", Dimension.TIME, "unknown unit 'Ms'; did you mean 'ms'?"),
        ("45 krad", Dimension.ANGLE, "unknown unit 'krad'; did you mean 'rad'?"),
        ("210 mPa", Dimension.PRESSURE, "unknown unit 'mPa'; did you mean 'MPa'?"),
        ("45 grad", Dimension.ANGLE, "'grad' may be of degrees or of 400ths of a turn: write deg"),
        ("60 1/min", Dimension.SPEED, "expected a speed, got '60 1/min'"),
        ("5 Gm^9 Gm^9 Gm^9 Gm^9", Dimension.LENGTH, "unknown unit"),
        ("5 km^30 km^30 km^30 km^30", Dimension.LENGTH, "unknown unit"),
        ("5 h^9 h^9 h^9 h^9 h^9 h^9 h^9 h^9 h^9 h^9", Dimension.TIME, "unknown unit"),
        ("5 N/(m", Dimension.STIFFNESS, "unknown unit"),
        ("5 gm^2", Dimension.INERTIA, "unknown unit 'gm^2'; did you mean 'g m^2'?"),
        ("5 Nm", Dimension.FORCE, "expected a force, got '5 Nm'"),
        ("5 nm", Dimension.TORQUE, "expected a torque, got '5 nm'"),
        ("5 m/s2", Dimension.ACCELERATION, "unknown unit 'm/s2'; did you mean 'm/s^2'?"),
        ("0.05", Dimension.LENGTH, "got the text '0.05'; a number without quotes"),
        ("", Dimension.LENGTH, "expected a length, got ''"),
        ("5 m**9**9**9", Dimension.LENGTH, "unknown unit"),
        ("5 __import__('os')", Dimension.LENGTH, "expected a length"),
        ("5 " + "m " * 40, Dimension.LENGTH, "expected a length"),
        ("1e999 m", Dimension.LENGTH, "must be a finite number"),
        ("10 Hz", Dimension.ANGULAR_SPEED, "rad/s, deg/s, turn/s or rpm"),
        (True, Dimension.LENGTH, "expected a length, got true"),
        (None, Dimension.LENGTH, "expected a length, got nothing"),
        (-math.inf, Dimension.LENGTH, "must be a finite number, got -.inf"),
        (10**400, Dimension.LENGTH, "must be a finite number, got a very large number"),
    ],
)
def test_what_is_no_such_quantity(value, dimension, words):
    with pytest.raises(PydanticCustomError) as caught:
        to_si(value, dimension)
    assert words in "{message}; {hint}".format(**caught.value.context)


@pytest.mark.parametrize("value", [1.1e20, -1.1e20, 10**400 - 1, "1e15 GPa", 1e300])
def test_what_exceeds_all_bounds_is_refused(value):
    with pytest.raises(PydanticCustomError, match="must"):
        to_si(value, Dimension.PRESSURE)


def test_limits_hold_after_conversion_and_stand_in_the_schema():
    adapter = TypeAdapter(PositiveLength)
    assert adapter.validate_python("1 mm") == 1e-3
    assert adapter.validate_python(1e-30) == 1e-30
    for value in (0, "0 mm", -1, "-1 mm", "1e-320 nm", 9e-31):
        with pytest.raises(ValidationError, match="greater"):
            adapter.validate_python(value)
    number, text = adapter.json_schema()["anyOf"]
    assert number == {"type": "number", "exclusiveMinimum": 0.0}
    assert text["type"] == "string"
    ratio = TypeAdapter(Annotated[float, Number(at_least=0.0, at_most=1.0)])
    assert ratio.json_schema() == {"type": "number", "minimum": 0.0, "maximum": 1.0}
    with pytest.raises(ValidationError, match="must be 1 or less"):
        ratio.validate_python(1.5)
    with pytest.raises(ValidationError, match="must be 0 or greater"):
        ratio.validate_python(-0.5)


@settings(max_examples=150, deadline=None)
@given(
    st.one_of(
        st.text(max_size=70),
        st.from_regex(r"[0-9]{1,3} [mNsdegk^*/()\-+. 0-9]{1,20}", fullmatch=True),
        st.floats(),
        st.integers(),
    ),
    st.sampled_from(Dimension),
)
def test_anything_is_a_finite_number_or_a_mistake(value, dimension):
    try:
        number = to_si(value, dimension)
    except PydanticCustomError as error:
        str(error)
    else:
        assert math.isfinite(number)
