"""A browser window, in which pages are opened one after the other."""

import pytest

from tests.helpers.reader import WINDOW, Reader


@pytest.fixture(scope="module")
def window(browser):
    return Reader(browser)


@pytest.fixture
def visit(window):
    """Open a file anew, all in one window: another one costs more than most pages."""

    def opened(path, **size):
        window.page.set_viewport_size(WINDOW | size)
        window.page.emulate_media(media="null")
        window.page.goto("about:blank")  # a page that is there already would only get its address
        window.open(path.as_uri())
        window.settle()
        return window

    yield opened
    trouble, window.trouble = window.trouble, []
    assert trouble == []


@pytest.fixture
def show(visit, tmp_path):
    """Open a page that Python has made."""

    def opened(page, **size):
        page.save(tmp_path / "page.html")
        return visit(tmp_path / "page.html", **size)

    return opened
