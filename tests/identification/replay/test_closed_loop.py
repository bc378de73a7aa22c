"""What the lesson's own simulation says of effects: it judges where a controller keeps simulation and recording together."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.identification.estimation import estimates as parameters
from lathesim.identification.estimation.estimates import Estimates, estimates
from lathesim.identification.replay.closed_loop import own_error
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, experiments, recording


def test_the_right_machine_leaves_next_to_nothing() -> None:
    (experiment,) = experiments(recording(Hidden()))
    right, wrong = ({"x_axis.mass": factor * MASS, "x_axis.viscous": VISCOUS} for factor in (1.0, 1.1))
    samples = experiment.own.samples
    assert own_error(experiment, right) < 10.0 * samples
    assert own_error(experiment, wrong) > 1e4 * samples


@pytest.mark.parametrize(("error_of_recorded", "taken"), [(1.0, "recorded"), (1.5, "simulated")])
def test_values_come_from_the_recorded_motion_where_its_simulation_is_as_good(
    error_of_recorded: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A replay that feels its own motion jumps where a value moves a little, and its slopes tell more than is there."""
    fitted = SimpleNamespace(constant={"felt": 0.0})
    model: Any = SimpleNamespace(fitted=fitted, candidates=(), validation_fit=SimpleNamespace(by_name={}))
    experiment: Any = SimpleNamespace(feeds_back=True, simulated_motion_of=lambda candidates: {"felt": 0.0})
    monkeypatch.setattr(parameters, "replace", lambda item, **changes: SimpleNamespace(**{**vars(item), **changes}))

    def by_motion(model: Any, *others: Any) -> Estimates:
        return Estimates({}, 1.0 if "felt" in model.fitted.constant else 2.0)

    monkeypatch.setattr(parameters, "_estimates", by_motion)
    errors = iter((1.0, error_of_recorded))
    monkeypatch.setattr(parameters, "own_error", lambda experiment, values, **_: next(errors))
    assert estimates(model, experiment, experiment, None).inflation == {"simulated": 1.0, "recorded": 2.0}[taken]
