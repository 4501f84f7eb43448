import textwrap
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exudyn_flexlink.source import (
    Mistake,
    Place,
    SceneError,
    load_document,
    parse_document,
    with_settings,
)


def read(text):
    return parse_document(textwrap.dedent(text).lstrip("\n"), "model.yaml")


def refusal(text):
    with pytest.raises(SceneError) as caught:
        parse_document(text, "model.yaml")
    return caught.value


INF = float("inf")
NUMBERS = {"1e-6": 1e-6, "5e+7": 5e7, "-.5": -0.5, "1.": 1.0, ".inf": INF, "-.INF": -INF}
NUMBERS |= {"+12": 12, "012": 12, "0o17": 15, "0xff": 255, "!!float 5": 5.0}
NO_NUMBERS = {"true": True, "False": False, "null": None, "~": None, "": None}
AS_THEY_ARE = ("yes", "off", "12:30:45", "2001-12-14", "1_000", "5 mm", "<<")
TEXTS = {text: text for text in AS_THEY_ARE} | {"'5'": "5", "!!str 5": "5"}


@pytest.mark.parametrize(("text", "value"), (NUMBERS | NO_NUMBERS | TEXTS).items())
def test_scalars_are_those_of_yaml_1_2(text, value):
    found = read(f"key: {text}").data["key"]
    assert found == value
    assert type(found) is type(value)


def test_every_value_and_key_has_its_place_also_behind_an_alias():
    document = read("# a comment\nbodies:\n  link: {length: 5 mm, at: &a [1, 'two']}\nother: *a\n")
    assert document.places["bodies", "link", "length"] == Place(3, 18, 22)
    assert document.places["bodies", "link", "at", 1] == Place(3, 35, 40)
    assert document.data["other"] == [1, "two"]
    assert document.places["other", 1] == Place(3, 35, 40)
    assert document.key_places["bodies", "link"] == Place(3, 3, 7)


@pytest.mark.parametrize(
    ("text", "line", "column", "words"),
    [
        ("a: 1\nb: 2\na: 3\n", 3, 1, "'a' is already given in line 1"),
        ("a: 1\n5: 2\n", 2, 1, "a key must be a text, got 5"),
        ("a: 1\n[b]: 2\n", 2, 1, "a key must be a text"),
        ("a: !!python/name:os.system x\n", 1, 4, "!!python/name:os.system is not allowed"),
        ("a: !!binary aGk=\n", 1, 4, "the tag !!binary is not allowed"),
        ("a: !!int x\n", 1, 4, "'x' is not a value of !!int"),
        ("a: *b\n", 1, 4, "found undefined alias 'b'"),
        ("a: &a [1, *a]\n", 1, 4, "an alias (*) of a value that contains it"),
        ("a: [1, 2\nb: 3\n", 2, 2, "expected ',' or ']'"),
        ("", 1, 1, "nothing in it"),
        ("\ufeffa: 1\n", 1, 1, "byte order mark"),
        ("a: 1\n---\nb: 2\n", 2, 1, "but found another document"),
        ("a: 1\nb: \x01\n", 2, 4, "is not allowed"),
        ('a: "\\0"\n', 1, 4, "control character"),
        ('a: "\\ud800"\n', 1, 4, "control character"),
        ("a: " + "9" * 5000, 1, 4, "too many digits"),
        ("a: " + "[" * 3000, 1, 103, "nested deeper than 100 levels"),
    ],
)
def test_refused_where_it_stands(text, line, column, words):
    error = refusal(text)
    place = error.document.place_of(error.mistakes[0])
    assert words in str(error)
    assert place is not None
    assert (place.line, place.column) == (line, column)


def test_exploding_aliases_are_refused():
    levels = "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 12))
    assert "aliases" in str(refusal("a0: &a0 [x, x]\n" + levels))


def test_a_mistake_is_shown_with_its_line_and_a_caret_below_the_value():
    document = read("title: x\njoints:\n  sleeve: {clearance: 5 N}\n")
    mistake = Mistake(("joints", "sleeve", "clearance"), "expected a length", "a number")
    assert str(SceneError(document, [mistake])) == "\n".join(
        [
            "model.yaml:3:23: joints.sleeve.clearance: expected a length",
            "     3 |   sleeve: {clearance: 5 N}",
            "                               ^^^",
            "hint: a number",
        ]
    )


def test_long_lines_are_cut_around_the_value_and_wide_letters_move_the_caret():
    document = read("a: [" + "1, " * 200 + "here, " + "2, " * 200 + "]\n")
    shown = str(SceneError(document, [Mistake(("a", 200), "wrong")])).splitlines()
    assert len(shown[1]) < 120
    start = shown[2].index("^")
    assert shown[1][start : len(shown[2])] == "here"
    wide = str(SceneError(read("振り子: wrong\n"), [Mistake(("振り子",), "wrong")])).splitlines()
    assert wide[2].index("^") == 9 + 6 + 2


def test_files(tmp_path):
    path = tmp_path / "model.yaml"
    for content, words in [
        (b"title: \xff\n", f"{path}:1:1: not UTF-8 text: the byte 0xff"),
        ("title: x".encode("utf-16"), "not UTF-8 text"),
        (b"", "nothing in it"),
    ]:
        path.write_bytes(content)
        with pytest.raises(SceneError, match=words.replace("\\", "\\\\")):
            load_document(path)
    path.write_bytes(b"title: x\r\nrun: 5 N\r\n")
    document = load_document(path)
    assert document.data == {"title": "x", "run": "5 N"}
    assert document.folder == tmp_path
    assert document.places["run",] == Place(2, 6, 9)
    with pytest.raises(SceneError, match="can't read the file: No such file"):
        load_document(tmp_path / "nowhere.yaml")
    with pytest.raises(SceneError, match="can't read the file"):
        load_document(tmp_path)


def test_a_file_too_large_to_be_a_model_is_not_even_read(tmp_path):
    path = tmp_path / "model.yaml"
    path.write_bytes(b"title: " + b"x" * 10_000_000)
    with pytest.raises(SceneError, match="the file is larger than 1 MB"):
        load_document(path)
    if Path("/dev/zero").exists():
        with pytest.raises(SceneError, match="a pipe or a device"):
            load_document("/dev/zero")


BASE = "run: {turns: 4}\nbodies:\n  link: {rods: 10, at: [0, 1]}\n"


@pytest.mark.parametrize(
    ("setting", "path", "value"),
    [
        ("run.turns=2", ("run", "turns"), 2),
        ("run.sample=1e-3", ("run", "sample"), 1e-3),
        ("bodies.link.at.1=5 mm", ("bodies", "link", "at", 1), "5 mm"),
        ("bodies.link={rods: 3}", ("bodies", "link"), {"rods": 3}),
        ("gravity=[0, -9.81]", ("gravity",), [0, -9.81]),
        ("initial.angles.guide=1", ("initial", "angles", "guide"), 1),
        ("bodies.link.note=a=b", ("bodies", "link", "note"), "a=b"),
    ],
)
def test_settings_replace_values(setting, path, value):
    before = read(BASE)
    document = with_settings(before, [setting])
    found = document.data
    for step in path:
        found = found[step]
    assert found == value
    assert before.data == read(BASE).data
    error = SceneError(document, [Mistake(path, "wrong")])
    assert str(error).startswith(f"--set {setting}: ")


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("turns", "expected path=value"),
        ("=2", "expected path=value"),
        ("run..turns=2", "expected path=value"),
        ("bodies.lnik.rods=5", "no 'lnik' in 'bodies'; did you mean 'link'?"),
        ("run.turns.x=5", "'run.turns' is one value"),
        ("bodies.link.at.2=5", "has 2 entries, counted from 0"),
        ("bodies.link.at.x=5", "has 2 entries, counted from 0"),
        ("run.turns=[1", "expected ',' or ']'"),
        ("run.turns=!!python/name:os.system x", "is not allowed"),
    ],
)
def test_settings_that_lead_nowhere(setting, words):
    with pytest.raises(SceneError) as caught:
        with_settings(read(BASE), [setting], named=["bodies"])
    assert str(caught.value).startswith(f"--set {setting}: ")
    assert words in str(caught.value)


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=40))
def test_any_setting_is_taken_or_refused(text):
    try:
        with_settings(read(BASE), [text])
    except SceneError as error:
        str(error)  # it can be shown


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("drives {motor: {type: speed}}\n", "a key without ': ' before its bracket"),
        ("title:Slider\nrun: 2\n", "a key needs ': ' after it"),
        ("title: Slider\nrun\ngravity: 2\n", "a key needs ': ' after it"),
        ("bodies:\n  rod: 1\n link: 2\n", "keys of one section stand below one another"),
        ("points:\n  - 1\n  more: 2\n", "a section is a list or has keys, not both"),
        ("run: {turns: 2}}\n", "a bracket too many"),
        ("run: {turns: 2\ntitle: Slider\n", "a comma or a closing bracket is missing"),
        ("run: {turns: 2 of: crank}\n", "a comma or a closing bracket is missing"),
        ("title: 'Slider\n", "a quote is not closed"),
        ("run:\n\tturns: 2\n", "indent with spaces"),
        ("title: @home\n", "needs quotes"),
        ("title: one\n---\ntitle: two\n", "a model is one document"),
        ("steel: {density: 7,85, name: x}\n", "decimals begin with a point, as in 7.85"),
    ],
)
def test_what_is_no_yaml_is_told_with_what_to_look_for(text, hint):
    (mistake,) = refusal(text).mistakes
    assert hint in mistake.hint


def test_a_missing_file_of_a_model_that_comes_with_the_program_is_told_by_its_name(tmp_path):
    """Who installed the wheel has no folder `models`, which README and documentation name."""
    with pytest.raises(SceneError, match="comes with the program is called 'pump', without"):
        load_document(tmp_path / "models" / "textbook" / "pump.yaml")
    with pytest.raises(SceneError) as caught:
        load_document(tmp_path / "nowhere.yaml")
    assert "hint" not in str(caught.value)


def test_a_minus_sign_of_typeset_text_is_a_minus():
    data = parse_document("a: [\N{MINUS SIGN}5, \N{MINUS SIGN}.5, 2e\N{MINUS SIGN}3]\n", "m").data
    assert data == {"a": [-5, -0.5, 2e-3]}
    assert isinstance(data["a"][0], int)
    said = parse_document("a: '\N{MINUS SIGN}5'\nb: \N{MINUS SIGN}x\n", "m").data
    assert said == {"a": "\N{MINUS SIGN}5", "b": "\N{MINUS SIGN}x"}
