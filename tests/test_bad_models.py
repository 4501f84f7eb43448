"""Every file of bad_models is refused at the line and column, and in the words, it announces.

Its first lines are comments `# expect LINE:COLUMN: path: message`: all of its mistakes, no others.
"""

from pathlib import Path

import pytest

from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.source import SceneError

FOLDER = Path(__file__).parent / "bad_models"
FILES = sorted(FOLDER.glob("*.yaml"))
EXPECT = "# expect "


def test_the_folder_is_there():
    assert len(FILES) > 60


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_mistake_is_reported_where_it_stands(path):
    lines = path.read_text(encoding="utf-8").splitlines()
    expected = [line.removeprefix(EXPECT) for line in lines if line.startswith(EXPECT)]
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    shown = str(caught.value).splitlines()
    headers = [line.removeprefix(f"{path}:") for line in shown if line.startswith(f"{path}:")]
    assert headers == expected


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_carets_lie_below_the_value(path):
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    shown = str(caught.value).splitlines()
    carets = [i for i, line in enumerate(shown) if line.strip() and not line.strip(" ^")]
    assert len(carets) == len(caught.value.mistakes)
    for mistake, i in zip(caught.value.mistakes, carets, strict=True):
        place = caught.value.document.place_of(mistake)
        assert place is not None
        source = path.read_text(encoding="utf-8").split("\n")[place.line - 1]
        marked = source[place.column - 1 : place.end_column - 1].expandtabs(1)
        below = shown[i - 1][shown[i].index("^") : len(shown[i])]
        assert below.startswith(marked) or not marked.strip()
