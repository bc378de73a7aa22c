"""What the lesson's own simulation says of effects: it judges where a controller keeps simulation and recording together."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lathesim.identification.estimation import estimates as parameters
from lathesim.identification.estimation.estimates import Estimates, estimates
from lathesim.identification.replay import closed_loop as own_simulation
from lathesim.identification.replay.closed_loop import agreed_in_closed_loop, in_own_simulation, own_error
from tests.diagnosis.pushed_table import MASS, VISCOUS, Hidden, experiments, recording


@pytest.mark.parametrize(("left", "feeds_back", "agreed"), [((10.0, 20.0), True, 0.8), ((10.0, 60.0), True, 0.0), ((1.0, 1.0), False, 0.0)])
def test_most_of_the_error_must_go_on_both_recordings(
    left: tuple[float, float], feeds_back: bool, agreed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    experiment: Any = SimpleNamespace(feeds_back=feeds_back)
    monkeypatch.setattr(own_simulation, "own_error", lambda experiment, values, **_: values["left"])
    recordings: Any = [(experiment, *(SimpleNamespace(by_name={"left": size}) for size in (100.0, after))) for after in left]
    assert agreed_in_closed_loop(*recordings) == pytest.approx(agreed)


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


@pytest.mark.parametrize(("at", "told_by"), [("cutting.force", "replay"), ("x_axis", "own")])
def test_what_an_effect_of_the_cut_does_is_told_by_the_replay(at: str, told_by: str) -> None:
    """A loop that swings between two steps of a converter moves the cut by chance, and that hides what the tool does."""
    ports = {"cutting": {"force": "force"}, "x_axis": {"effort": "force", "flow": "velocity"}}
    parts = [SimpleNamespace(name=name, component=SimpleNamespace(ports=roles)) for name, roles in ports.items()]
    asked: list[str] = []

    def simulator(name: str, left: float) -> SimpleNamespace:
        def outputs(names: list[str], rows: np.ndarray) -> list[np.ndarray]:
            asked.append(name)
            with_it = np.full((1, 100), left)
            return [with_it, with_it + 1.0, with_it + 1.0]

        return SimpleNamespace(settable=list, given=lambda name: 0.0, outputs=outputs, samples=100)

    own, replay = simulator("own", 10.0), simulator("replay", 0.1)
    replay.as_seen, replay.seen, replay.seen_floors = (lambda run: run), np.zeros((1, 100)), np.array([0.1])
    experiment: Any = SimpleNamespace(
        machine=SimpleNamespace(assembly=SimpleNamespace(parts=parts)), own=own, sensed=replay, feeds_back=True
    )
    candidate: Any = SimpleNamespace(at=at, parameters=("wear.growth",), neutral=np.zeros(1))
    fits: list[Any] = [SimpleNamespace(by_name={"wear.growth": value}) for value in (0.0, 1.0)]
    moved, _ = in_own_simulation(experiment, *fits, candidate)
    assert asked == [told_by]
    assert moved == pytest.approx({"replay": 30.0, "own": 0.3}[told_by])
