"""What the lesson's own simulation says of effects: it judges where a controller keeps simulation and recording together."""

from types import SimpleNamespace
from typing import Any

import pytest

from lathesim.diagnosis import own_simulation, parameters
from lathesim.diagnosis.own_simulation import agreed_in_closed_loop, own_error
from lathesim.diagnosis.parameters import Estimates, estimates
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, recording, rigs


@pytest.mark.parametrize(("left", "feeds_back", "agreed"), [((10.0, 20.0), True, 0.8), ((10.0, 60.0), True, 0.0), ((1.0, 1.0), False, 0.0)])
def test_most_of_the_error_must_go_on_both_recordings(
    left: tuple[float, float], feeds_back: bool, agreed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig: Any = SimpleNamespace(feeds_back=feeds_back)
    monkeypatch.setattr(own_simulation, "own_error", lambda rig, values: values["left"])
    recordings: Any = [(rig, *(SimpleNamespace(by_name={"left": size}) for size in (100.0, after))) for after in left]
    assert agreed_in_closed_loop(*recordings) == pytest.approx(agreed)


def test_the_right_machine_leaves_next_to_nothing() -> None:
    (rig,) = rigs(recording(Hidden()))
    right, wrong = ({"x_axis.mass": factor * MASS, "x_axis.viscous": VISCOUS} for factor in (1.0, 1.1))
    samples = rig.own.samples
    assert own_error(rig, right) < 10.0 * samples
    assert own_error(rig, wrong) > 1e4 * samples


@pytest.mark.parametrize(("error_of_recorded", "taken"), [(1.0, "recorded"), (1.5, "simulated")])
def test_values_come_from_the_recorded_motion_where_its_simulation_is_as_good(
    error_of_recorded: float, taken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A replay that feels its own motion jumps where a value moves a little, and its slopes tell more than is there."""
    fitted = SimpleNamespace(constant={"felt": 0.0})
    model: Any = SimpleNamespace(fitted=fitted, terms=(), held_out_fit=SimpleNamespace(by_name={}))
    rig: Any = SimpleNamespace(feeds_back=True, feeling_their_motion=lambda terms: {"felt": 0.0})
    monkeypatch.setattr(parameters, "replace", lambda item, **changes: SimpleNamespace(**{**vars(item), **changes}))

    def by_motion(model: Any, *others: Any) -> Estimates:
        return Estimates({}, 1.0 if "felt" in model.fitted.constant else 2.0)

    monkeypatch.setattr(parameters, "_estimates", by_motion)
    errors = iter((1.0, error_of_recorded))
    monkeypatch.setattr(parameters, "own_error", lambda rig, values: next(errors))
    assert estimates(model, rig, rig, None).inflation == {"simulated": 1.0, "recorded": 2.0}[taken]
