"""The page as one HTML document: template, data, style, scripts and a security policy."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Mapping
from hashlib import sha256
from html import escape
from importlib.resources import files
from typing import Any

_PLACE = re.compile(r"\{\{(\w+)\}\}")


def html_of(title: str, payload: Mapping[str, Any]) -> str:
    """Return the page with all it needs inlined.

    Args:
        title: Heading of the page.
        payload: Data that ``logic.js`` decodes; plain values without NaN.
    """
    logic = _asset("logic.js")
    charts = _asset("charts.js")
    page = _asset("page.js")
    style = _asset("page.css")
    data = json.dumps(payload, allow_nan=False, separators=(",", ":"))
    parts = {
        "title": escape(title),
        "policy": _policy(logic, charts, page, style=style),
        "style": style,
        # Within a script element only "<" can end it or open a comment.
        "payload": data.replace("<", "\\u003c"),
        "logic": logic,
        "charts": charts,
        "page": page,
    }
    # In one pass, so that a text of the user that looks like a place is not filled in.
    return _PLACE.sub(lambda place: parts[place.group(1)], _asset("page.html"))


def _policy(*scripts: str, style: str) -> str:
    """Return a policy that forbids all requests, and all scripts and styles except these.

    ``require-trusted-types-for`` makes the browser refuse every text that a script would turn
    into markup: the user's names and labels reach the page as text or not at all.
    """
    digests = " ".join(map(_digest, scripts))
    return (
        f"default-src 'none'; script-src {digests}; style-src {_digest(style)}; "
        "base-uri 'none'; form-action 'none'; require-trusted-types-for 'script'"
    )


def _digest(text: str) -> str:
    """Return the hash of a script or style, as a policy names it."""
    digest = sha256(text.encode("utf-8")).digest()
    return f"'sha256-{b64encode(digest).decode('ascii')}'"


def _asset(name: str) -> str:
    return files("pymoo_psi.page").joinpath(name).read_text(encoding="utf-8")
