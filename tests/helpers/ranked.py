"""Which design is proposed, and what it costs: the definition in plain loops, slow and obvious."""


class Ranked:
    """The designs of a set, ranked by their distance from the best values, in shares of the ranges.

    Args:
        rows: Of each design by its name, its values by column; numbers of any kind.
        signs: Of each objective 1, or -1 where more is better.
    """

    def __init__(self, rows, signs):
        self.rows, self.signs = rows, signs
        self.front = [
            name for name in rows if not any(self.dominates(other, name) for other in rows)
        ]
        self.best, self.worst = {}, {}
        for name, sign in signs.items():
            ordered = sorted(sign * rows[design][name] for design in self.front)
            self.best[name], self.worst[name] = sign * ordered[0], sign * ordered[-1]
        self.front.sort(key=self.distance)

    def dominates(self, one, other):
        pairs = [
            (sign * self.rows[one][n], sign * self.rows[other][n]) for n, sign in self.signs.items()
        ]
        return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)

    def lost(self, design, name):
        """How far a design is behind the best value."""
        return abs(self.rows[design][name] - self.best[name])

    def range(self, name):
        return abs(self.worst[name] - self.best[name])

    def shares(self, design):
        return {name: self.lost(design, name) / (self.range(name) or 1) for name in self.signs}

    def distance(self, design):
        """The square of the distance."""
        return sum(share**2 for share in self.shares(design).values())
