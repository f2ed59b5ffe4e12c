"""The guides, as Markdown files: a tutorial, guides for each kind of user, and how-to guides.

``pymoo-psi guide`` lists them and ``pymoo-psi guide NAME`` prints one; :func:`guides` returns their
texts. ``sphinx-build -c .sphinx src/pymoo_psi/guide site`` in a checkout makes a site of them, with
a gallery and the reference. Their examples and commands run as tests of the package.
"""

from pathlib import Path

from pymoo_psi.errors import PsiError

__all__: list[str] = []


def guides() -> dict[str, str]:
    """Return the text of each guide by its name."""
    texts = {}
    for path in sorted(Path(__file__).parent.glob("*.md")):
        if path.stem != "index":  # the first page of the site
            texts[path.stem] = path.read_text(encoding="utf-8")
    return texts


def site_page(name: str) -> Path:
    """Return the page of a guide in the site that was built in this folder or in the checkout.

    Raises:
        PsiError: Neither has a built site.
    """
    for folder in (Path.cwd(), Path(__file__).parents[3]):
        page = folder / "site" / f"{name}.html"
        if page.is_file():
            return page
    raise PsiError(
        "--open needs the built site, which neither this folder nor a checkout has; "
        "'pymoo-psi guide install' says how to build it, 'pymoo-psi guide NAME' prints a guide"
    )
