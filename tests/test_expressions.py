"""Expressions: values, derivatives and bounds against Python's arithmetic, units, mistakes."""

import cmath
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exudyn_flexlink.expressions import (
    Bounds,
    ExpressionError,
    NoValueError,
    Sensed,
    looks_like_expression,
    parse_expression,
)
from exudyn_flexlink.quantities import Powers

STEEPEST = 1e4  # slope of a formula: of a steeper one rounding leaves too few digits to compare
SMOOTH = ("sin", "cos", "tan", "atan", "exp", "log", "sqrt", "tanh", "asin", "acos")


def by_python(text, t, state=()):
    """Value of a formula without units, by Python; complex numbers give derivatives."""
    names = {name: getattr(cmath, name) for name in SMOOTH}
    names |= {"t": t, "pi": math.pi, "a": state[0] if state else 0, "w": state[-1] if state else 0}
    return eval(text, {"__builtins__": {}}, names)


def formulas():
    """Formulas that Python and cmath understand, too."""
    atoms = st.one_of(
        st.sampled_from(["t", "pi", "a", "w", "0.5", "2", "1.7e-1"]),
        st.integers(0, 9).map(str),
    )

    def grown(inner):
        return st.one_of(
            st.builds("({} {} {})".format, inner, st.sampled_from("+-*/"), inner),
            st.builds("(-{})".format, inner),
            st.builds("{}({})".format, st.sampled_from(SMOOTH), inner),
            st.builds("({} ** {})".format, inner, st.integers(0, 3)),
            st.builds("({} * {} - {})".format, inner, inner, inner),
        )

    return st.recursive(atoms, grown, max_leaves=8)


@settings(max_examples=400, deadline=None)
@given(formulas(), *(st.integers(-200, 200).map(lambda k: (k + 0.5) / 100) for _ in range(3)))
def test_values_and_slopes_are_those_of_complex_steps(text, t, a, w):
    """``f(x + i h)`` has the derivative as its imaginary part over h, without cancellation."""
    written = _with_state(text)
    try:
        found = parse_expression(written)
        state = [{"angle": a, "speed": w}[one.kind] for one in found.sensed]
        value = found.at(t, state)
        slopes = [] if found.sensed else list(found.derivatives(np.array([t]), 1))
        expected = complex(by_python(text, t, (a, w)))
        step = 1e-30
        exact = [complex(by_python(text, t + 1j * step)).imag / step]
    except (ExpressionError, NoValueError, ArithmeticError, ValueError):
        return
    if abs(expected.imag) > 0:
        return  # Python found a complex root where there is no real one
    if max(map(abs, exact)) > STEEPEST:
        return
    assert value == pytest.approx(expected.real, rel=1e-9, abs=1e-9)
    assert slopes == pytest.approx(exact[: len(slopes)], rel=1e-6, abs=1e-6)


def _with_state(text):
    """Write a and w, where they are names, as an angle and a speed."""
    for name, word in (("a", "angle(o)"), ("w", "speed(o)")):
        padded = f" {text} "
        for before in " (":
            for after in " )":
                padded = padded.replace(f"{before}{name}{after}", f"{before}{word}{after}")
        text = padded.strip()
    return text


def test_second_derivatives_of_a_swing():
    found = parse_expression("20 deg * sin(2*pi*t / 1.5 s)")
    w, size = 2 * math.pi / 1.5, math.radians(20)
    times = np.array([0.0, 0.3, 7.1])
    for t in times:
        assert found.at(t) == pytest.approx(size * math.sin(w * t), abs=1e-15)
    assert found.derivatives(times, 1) == pytest.approx(size * w * np.cos(w * times), abs=1e-14)
    assert found.derivatives(times, 2) == pytest.approx(
        -size * w * w * np.sin(w * times), abs=1e-13
    )


@pytest.mark.parametrize(("text", "value"), [
    ("-2**2", -4), ("2**-1", 0.5), ("2**3**2", 512), ("1 - 2 - 3", -4), ("8/4/2", 1),
    ("--3", 3), ("min(3, 2) + max(3, 2)", 5), ("abs(-2)", 2), ("sign(-3)*sign(0)", 0),
    ("atan2(1, -1)", 3 * math.pi / 4), ("where(1 < 2, 3, 4)", 3), ("where(2 <= 2, 3, 4)", 3),
    ("where(2 > 2, 3, 4)", 4), ("where(2 >= 2, 3, 4)", 3), ("where(1 < 2, 1, sqrt(-1))", 1),
    ("5 mm", 5e-3), ("1/2 mm", 500), ("3 N m + 2 N mm", 3.002), ("5Nm*2", 10), ("2e3 µm", 2e-3),
    ("90 deg / pi", 0.5), ("2 kg m / s^2 + 3 N", 5),
    ("0.8 N m s/rad", 0.8), ("6 N mm s", 6e-3), ("5 1/s", 5), ("3 m/min", 0.05),
    ("2 m / min(4, 5)", 0.5), ("95 rpm", 95 * math.pi / 30),
])  # fmt: skip
def test_arithmetic_and_units(text, value):
    assert parse_expression(text).at(0.0) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(("text", "powers"), [
    ("5 mm * sin(2*pi*t / 3 s)", Powers(m=1)),
    ("5 mm * t", None),
    ("5 mm * sin(2)", Powers(m=1)),
    ("sqrt(4 m^2)", Powers(m=1)),
    ("(3 s)**2 * 2 m/s^2", Powers(m=1)),
    ("20 deg", None),
    ("3 N + 5*t", Powers(m=1, kg=1, s=-2)),
    ("(2 m)**1e999", None),  # infinite as a float
])  # fmt: skip
def test_dimensions_as_far_as_units_tell(text, powers):
    assert parse_expression(text).powers == powers


@pytest.mark.parametrize(("text", "words"), [
    ("sn(t)", "unknown name 'sn'; did you mean 'sin'?"),
    ("spedd(o)", "did you mean 'speed'?"),
    ("t^2", "'^' can't stand"),
    ("t.real", "'.' can't stand"),
    ("t[0]", "'[' can't stand"),
    ("'t'", "can't stand"),
    ("__import__(t)", "unknown name '__import__'"),
    ("lambda: t", "':' can't stand"),
    ("sin", "expected '('"),
    ("sin(t", "expected ')', got the end"),
    ("sin()", "expected a number or a name, got ')'"),
    ("sin(t, 2)", "sin takes 1 argument"),
    ("min(t)", "min takes 2 arguments"),
    ("where(t, 1, 2)", "expected a condition"),
    ("t < 2", "compares only in where"),
    ("2 t", "expected an operator before 't'"),
    ("", "got the end"),
    ("t/s", "the unit 's' follows no number"),
    ("5 1/2", "expected an operator before '1'"),
    ("5 m/s**2 * t", "the unit 's' follows no number"),
    ("5 mm + 3 s", "a length and a time can't go together"),
    ("sin(3 s)", "sin of a time"),
    ("where(t < 5 mm, 1 s, 2 N)", "a time and a force can't go together"),
    ("angle()", "expected the name of a joint"),
    ("place(rod.end)", "expected a point and its coordinate"),
    ("place(rod.end, z)", "expected a point and its coordinate"),
    ("sign(speed(o))", "sign may depend on t alone"),
    ("where(angle(o) < 1, 1, 2)", "where may depend on t alone"),
    ("5 1/min * t", "'1/min' may be a speed or a frequency: write rpm or 1/s"),
    ("5 grad * t", "'grad' may be of degrees or of 400ths of a turn"),
    ("(" * 50 + "t" + ")" * 50, "40 deep"),
    ("1+" * 300 + "1", "601 letters"),
    ("t * 1 " + "km^9 " * 12, "unknown unit"),  # larger than any float
])  # fmt: skip
def test_mistakes_name_the_piece(text, words):
    with pytest.raises(ExpressionError) as raised:
        parse_expression(text)
    assert words in str(raised.value)


def test_what_is_sensed_in_order():
    found = parse_expression("angle(crank pin) - 2*speed(o-1) + place(rod.end, x)*angle(crank pin)")
    assert found.sensed == (
        Sensed("angle", "crank pin"), Sensed("speed", "o-1"), Sensed("place", "rod.end", "x"),
    )  # fmt: skip
    assert found.at(0.0, [2, 3, 4]) == 2 - 6 + 8


def test_conditions_bend_at_their_instants():
    assert parse_expression("where(2*t < 3, t, 1)*abs(t - 0.5)").bends(0.0, 9.0) == [0.5, 1.5]
    found = parse_expression("abs(sin(2*pi*t))").bends(0.0, 2.2)
    assert found == pytest.approx([0.5, 1.0, 1.5, 2.0], abs=1e-15)
    assert parse_expression("max(speed(o), 0)*t").bends(0.0, 9.0) == []


def test_only_what_computes_looks_like_an_expression():
    assert looks_like_expression("2*3")
    assert looks_like_expression("t")
    assert not looks_like_expression("5 mm")
    assert not looks_like_expression("-5 mm")
    assert not looks_like_expression("95 rmp")


def test_derivatives_do_not_explode():
    """Each derivative of a product of n factors shares its pieces: n squared pieces, not 2^n."""
    found = parse_expression("*".join(["sin(t)"] * 60))
    assert found.derivatives(np.array([0.3]), 2) == pytest.approx(
        60 * 59 * math.sin(0.3) ** 58 * math.cos(0.3) ** 2 - 60 * math.sin(0.3) ** 60
    )
    assert len(found._tape.operations) < 2000


def test_an_expression_survives_pickling():
    found = pickle.loads(pickle.dumps(parse_expression("2*sin(t) + angle(o)")))
    assert found == parse_expression("2*sin(t) + angle(o)")
    assert found.at(1.0, [3.0]) == 2 * math.sin(1.0) + 3


PIECES = st.sampled_from([
    "t", "pi", "sin", "(", ")", "+", "-", "*", "/", "**", ",", "<", "where", "5 mm", "2", "1e9",
    "angle(o)", "place(b.p, x)", " ", ".", "_", "s", "deg", "min(", "__class__", "'", "[",
])  # fmt: skip


@settings(max_examples=300, deadline=None)
@given(st.one_of(st.text(max_size=60), st.lists(PIECES, max_size=14).map("".join)), st.floats())
def test_any_text_is_an_expression_or_a_mistake(text, t):
    try:
        found = parse_expression(text)
    except ExpressionError:
        return
    try:
        assert math.isfinite(found.at(t, [0.5] * len(found.sensed)))
        if not found.sensed:
            assert np.isfinite(found.derivatives(np.array([t]), 2)).all()
    except NoValueError:
        return


def test_a_formula_is_held_on_a_side_of_its_kinks():
    """Beyond a kink it goes on as it was, or as it is written where that has no value."""
    found = parse_expression("abs(place(way) - 1) + 0*max(0, t)")
    assert found.kinks == 1
    places = np.array([0.0, 3.0])
    np.testing.assert_array_equal(found.values(0 * places, [places]), [1, 2])
    for side, held in ((0.0, [-1, 2]), (1.0, [1, -2])):
        np.testing.assert_array_equal(found.values(0 * places, [places, side]), held)
        np.testing.assert_array_equal(found.switches(0 * places, [places, side]), [places - 1])
    root = parse_expression("sqrt(max(0, place(way) - 1))")
    np.testing.assert_array_equal(root.values(0 * places, [places, 0.0]), [0, math.sqrt(2)])
    np.testing.assert_array_equal(root.values(0 * places, [places, 1.0]), [0, 0])


@pytest.mark.parametrize(
    ("typed", "plain"),
    [
        ("30 RPM * sin(t)", "30 rpm * sin(t)"),
        ("30 rev/min * t/1 s", "30 rpm * t/1 s"),
        ("30 U/min * t/1 s", "30 rpm * t/1 s"),
        ("30 Grad * t", "30 deg * t"),
        ("30 degrees/s * cos(t)", "30 deg/s * cos(t)"),
        ("\N{MINUS SIGN}3 \N{MINUS SIGN} 2*t", "-3 - 2*t"),
        ("2 rad·s⁻¹ * t", "2 rad/s * t"),
        ("5 kg·m² * t", "5 kg m^2 * t"),
        ("50 µm * t", "50 um * t"),
        ("2 seconds * t", "2 s * t"),
    ],
)
def test_units_and_signs_as_people_type_them(typed, plain):
    one, other = parse_expression(typed), parse_expression(plain)
    assert one.powers == other.powers
    assert [one.at(t) for t in (0.3, 1.7)] == pytest.approx([other.at(t) for t in (0.3, 1.7)])


# --- bounds over intervals ------------------------------------------------------------------------

FORMULAS = (
    "3 + 2*t - t**2",
    "(t - 1)**2 * exp(-t)",
    "exp(-((t - 1)/0.01)**2)",
    "1/(0.001 + (t - 1.2)**2)",
    "sin(7*t) + cos(t)*tan(t/4)",
    "tanh(30*(t - 1)) - tanh(30*(t - 1.1))",
    "where(t < 1, t, 2 - t) + abs(t - 0.5)",
    "min(t, 1)*max(sin(3*t), 0.2)",
    "atan2(t - 1, t - 1.5) + atan(5*t)",
    "asin(t/4) + acos(t/4) + sqrt(t) + log(t + 0.1)",
    "(t - 1)**3 + t**-2 + (t + 0.5)**1.5 + 2**t",
    "sign(t - 1)*t",
    "(1 - 3.5)*sin(3*t)*t",
    "angle(hub)*speed(hub) - t*angle(hub)**2",
    "place(hub)/(2 + sin(speed(hub)))",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_no_value_is_outside_the_bounds(text):
    formula = parse_expression(text)
    rng = np.random.default_rng(1)
    begin = rng.uniform(0.01, 2, 200)
    end = begin + 10 ** rng.uniform(-4, 0, 200)
    low = rng.uniform(-2, 2, (len(formula.sensed), 200))
    high = low + rng.uniform(0, 1, low.shape)
    state = [Bounds(*pair) for pair in zip(low, high, strict=True)]
    for addend in formula.addends:
        least, most = addend.ranges(Bounds(begin, end), state)
        for part in rng.uniform(0, 1, (100, 1 + len(low))):
            values = addend.values(
                begin + part[0] * (end - begin), low + part[1:, None] * (high - low)
            )
            assert (values >= least - 1e-9 * abs(values)).all()
            assert (values <= most + 1e-9 * abs(values)).all()


@pytest.mark.parametrize(
    ("text", "least", "most"),
    [
        ("exp(-((t - 1)/0.01)**2)", 0.0, 1.0),
        ("sin(t)", np.sin(0.5), 1.0),
        ("cos(4*t)", -1.0, np.cos(2.0 * np.pi)),
        ("t**3", 0.125, 8.0),
        ("t*(1 - 3)", -4.0, -1.0),
        ("(t - 1)**2", 0.0, 1.0),
        ("where(t < 3, t, 50)", 0.5, 2.0),
        ("1/t", 0.5, 2.0),
    ],
)
def test_what_takes_its_argument_once_has_its_own_range(text, least, most):
    """Over 0.5 to 2 s."""
    (addend,) = parse_expression(text).addends
    found = addend.ranges(Bounds(np.array([0.5]), np.array([2.0])), [])
    assert found.low[0] == pytest.approx(least, abs=1e-12)
    assert found.high[0] == pytest.approx(most, abs=1e-12)
