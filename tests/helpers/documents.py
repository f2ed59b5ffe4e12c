"""What a page holds, read from its document."""

import json
import re
from base64 import b64decode

import numpy as np


def payload_of(page):
    """Return the data that a page gives its script."""
    (text,) = re.findall(r'id="payload">(.*?)</script>', page.html(), re.DOTALL)
    return json.loads(text)


def script_of(page):
    """Return the first script of a page, which needs no document."""
    return re.findall(r"<script>(.*?)</script>", page.html(), re.DOTALL)[0]


def column_of(sent, name):
    """Return the numbers of a column, or the mask "optimal", as the script decodes them."""
    if name == "optimal":
        return np.frombuffer(b64decode(sent[name]), np.uint8)
    (column,) = (column for column in sent["columns"] if column["name"] == name)
    return np.frombuffer(b64decode(column["values"]), "<f8")
