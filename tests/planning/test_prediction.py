"""What a prediction consists of."""

from wam_cast.planning import prediction
from wam_cast.planning.prediction import OUTPUTS


def test_outputs_are_named_as_their_columns():
    columns = {name: getattr(prediction, name.removeprefix("landing_").upper()) for name in OUTPUTS}
    assert columns == {name: column for column, name in enumerate(OUTPUTS)}
