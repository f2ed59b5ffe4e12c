"""What a page holds, read from its document."""

import json
import re


def payload_of(page):
    """Return the data that a page gives its script."""
    (text,) = re.findall(r'id="payload">(.*?)</script>', page.html(), re.DOTALL)
    return json.loads(text)
