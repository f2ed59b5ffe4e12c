"""A model whose run somebody steers."""

import time

from pymoo_psi.study import Study
from tests.helpers.models import Model


class Steered(Model):
    """A model; while it tests a design, somebody makes requests of a study that has none yet.

    Args:
        study: The study.
        requests: What is requested.
        at: The number of the design.
    """

    def __init__(self, study, *requests, at=1):
        def results(x):
            if len(self.calls) == at and not Study(study).facts().steering:
                for request in requests:
                    with Study(study).changes() as database:
                        database.steer({"name": "Bo", **request})
                time.sleep(0.6)  # requests are read twice a second
            return {"F": [x[0], 1 - x[0] + x[1]]}

        super().__init__(results, n_var=2)
