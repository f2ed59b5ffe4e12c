"""Files with odd values, as a slip of the hand or of another program leaves them."""

import copy
import json

ODD = (
    None, True, False, 0, 1, -1, 5, 1.5, 10**400, -(10**400), 1e308, float("inf"), float("nan"),
    "", " ", "x", "S235", "1e400", "<= 5", "<= 1e400", "a\nb", "{", "\x00", "ü", "width", "(", "../x",
    [], [5], ["x"], ["a", "a"], [1, 2], [2, 1], [[1, 2]], [1, "x"], [0, float("inf")], [10**400, 1],
    [None], {}, {"x": 1}, {"": ""}, {"bounds": [1, 2]}, [{}], [[[[[]]]]],
)  # fmt: skip
NAMES = ("x", "colour", "row", "bounds", "unit", "width", "")


def mutated(content, rng):
    """Return nested content of which one value, or two, are replaced, left out or added."""
    content = copy.deepcopy(content)
    for _ in range(rng.choice((1, 1, 2))):
        holder, key = rng.choice([*_places(content)])
        change = rng.choice(("replace", "replace", "leave out", "add"))
        if change == "leave out":
            del holder[key]
        elif change == "add" and isinstance(holder, list):
            holder.append(rng.choice(ODD))
        else:
            holder[rng.choice(NAMES) if change == "add" else key] = rng.choice(ODD)
    return content


def _places(content):
    """Yield each list or dict within the content, with each of its keys."""
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield content, key
        if isinstance(value, (dict, list)):
            yield from _places(value)


def toml(value):
    """Return a value as TOML, which has no None."""
    if isinstance(value, dict):
        entries = [f"{json.dumps(key)} = {toml(value)}" for key, value in value.items()]
        return f"{{{', '.join(entry for entry in entries if not entry.endswith('= '))}}}"
    if isinstance(value, list):
        return f"[{', '.join(toml(entry) for entry in value if entry is not None)}]"
    if isinstance(value, float):
        return repr(value)
    return "" if value is None else json.dumps(value)


def toml_file(content):
    lines = [f"{json.dumps(key)} = {toml(value)}" for key, value in content.items()]
    return "\n".join(line for line in lines if not line.endswith("= "))
