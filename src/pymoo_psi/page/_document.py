"""The page as one HTML document: template, data, style and scripts, sealed by a policy."""

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
        payload: What ``logic.js`` decodes: JSON without NaN.
    """
    scripts = {name: _asset(f"{name}.js") for name in ("logic", "charts", "page")}
    style = _asset("page.css")
    parts = {
        "title": escape(title),
        "style": style,
        # Within a script element only "<" can end it or open a comment.
        "payload": json.dumps(payload, allow_nan=False, separators=(",", ":")).replace(
            "<", "\\u003c"
        ),
        "policy": _policy(list(scripts.values()), style),
        **scripts,
    }
    # One pass: a text of the user's that looks like a place is not filled in.
    return _PLACE.sub(lambda place: parts[place.group(1)], _asset("page.html"))


def _policy(scripts: list[str], style: str) -> str:
    """Return the policy that forbids every request, and every script and style but these.

    ``require-trusted-types-for`` makes the browser refuse every text that a script would turn
    into markup: names and labels of the user's reach the page as text or not at all.
    """
    allowed = " ".join(_digest(script) for script in scripts)
    return (
        f"default-src 'none'; script-src {allowed}; style-src {_digest(style)}; "
        "base-uri 'none'; form-action 'none'; require-trusted-types-for 'script'"
    )


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}'"


def _asset(name: str) -> str:
    return files("pymoo_psi.page").joinpath(name).read_text(encoding="utf-8")
