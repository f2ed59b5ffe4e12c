"""Options that are printed alike, and names that a study cannot have."""

import numpy as np
import pytest
from pymoo.core.variable import Choice

from pymoo_psi import Recorded, investigate
from pymoo_psi.errors import StudyMismatchError
from tests.helpers.models import Model
from tests.helpers.refusals import refused


def typed(*options):
    """A choice whose options differ in their types."""
    return Model(lambda x: {"F": len(str(x["a"]))}, vars={"a": Choice(options=options)}, n_obj=1)


def test_models_of_options_that_look_alike_are_different(study_file):
    investigate(typed(12, "oak"), 4, study=study_file)
    refused(
        "another model.*choices",
        investigate,
        typed("12", "oak"),
        4,
        study=study_file,
        error=StudyMismatchError,
    )


def test_zero_is_one_design_whatever_its_sign(study_file):
    model = Model(lambda x: {"F": [x[0], 1 - x[0]]}, n_var=1)
    recorded = Recorded(model, study=study_file)
    recorded.evaluate(np.array([[0.0], [-0.0], [1.0]]))
    assert len(recorded.table) == len(model.calls) == 2


@pytest.mark.parametrize(
    "suffix", ["-journal", "-wal", "-SHM", ".pymoo-psi-lock", ".csv", ".xlsx", ".toml"]
)
def test_files_that_belong_to_a_study_or_to_none_are_refused(suffix, study_file):
    refused(
        "study must be a database with a name such as",
        investigate,
        typed(12, "oak"),
        4,
        study=f"{study_file}{suffix}",
    )
