"""The report of a run in a real browser: on a phone, at a desk, in the dark, and printed."""

import pytest
from browsing.chromium import browser, lacking
from results import tilting_link

from exudyn_flexlink.page import write_page

pytestmark = pytest.mark.skipif(lacking(), reason="no Chromium, to look at pages with")

PHONE, DESK = (390, 844), (1280, 900)  # pixels
WIDEST = "document.documentElement.scrollWidth"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Return a page with all a page can have, written once."""
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_page(tilting_link(samples=1001), path)
    return path


@pytest.fixture(scope="module")
def page():
    with browser() as opened:
        yield opened


@pytest.mark.parametrize("size", [PHONE, DESK], ids=["phone", "desk"])
def test_a_page_fits_its_window(size, page, file):
    page.open(file, *size)
    assert page.value(WIDEST) <= size[0]
    assert page.complaints == []
    # What is wider scrolls by itself, down to its last column.
    reached = page.value(
        "[...document.querySelectorAll('.scrolls')].filter(s => s.clientWidth)"
        ".every(s => s.clientWidth <= innerWidth && getComputedStyle(s).overflowX === 'auto')"
    )
    assert reached is True


def test_the_animation_plays(page, file):
    """In sight, which it is not at first."""
    page.open(file, *PHONE)
    page.value("document.querySelector('.flexlink-main').scrollIntoView()")
    page.value("document.querySelector('.flexlink-main').click()")
    later = page.value(
        "new Promise(done => { const told = document.querySelector('.flexlink-told'), before = "
        "told.textContent; const look = () => told.textContent === before "
        "? requestAnimationFrame(look) : done(told.textContent); look(); })"
    )
    assert later.startswith("t = 0")
    assert page.complaints == []


def test_what_someone_put_into_a_page_does_not_run(page, file, tmp_path):
    changed = tmp_path / "changed.html"
    evil = "<script>document.title = 'changed'</script><img src=x onerror=\"document.title='it'\">"
    changed.write_text(file.read_text(encoding="utf-8").replace("</body>", f"{evil}</body>"))
    page.open(changed, *DESK)
    assert page.value("document.title") == "a rigid link that tilts in its guide"
    refused = [told for told in page.complaints if "Content Security Policy" in told]
    assert len(refused) >= 2  # a program and an image


def test_a_page_is_printed_whole(page, file):
    page.open(file, *PHONE)
    printed = page.printed()
    assert printed.startswith(b"%PDF")
    assert 3 <= printed.count(b"/Type /Page\n") <= 20
