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


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_mistake_is_reported_where_it_stands_with_a_caret_below(path):
    lines = path.read_text(encoding="utf-8").split("\n")
    expected = [line.removeprefix(EXPECT) for line in lines if line.startswith(EXPECT)]
    with pytest.raises(SceneError) as caught:
        load_scene(path)
    shown = str(caught.value).splitlines()
    headers = [line.removeprefix(f"{path}:") for line in shown if line.startswith(f"{path}:")]
    assert headers == expected
    carets = [i for i, line in enumerate(shown) if line.strip() and not line.strip(" ^")]
    assert len(carets) == len(caught.value.mistakes)
    for mistake, i in zip(caught.value.mistakes, carets, strict=True):
        place = caught.value.document.place_of(mistake)
        assert place is not None
        source = lines[place.line - 1]
        marked = source[place.column - 1 : place.end_column - 1].expandtabs(1)
        below = shown[i - 1][shown[i].index("^") : len(shown[i])]
        assert below.startswith(marked) or not marked.strip()
