"""What way-points cannot tell is found and put in words."""

import numpy as np

from lathesim.experiments.free_values import Telling, telling


def told(powers: np.ndarray, names: list[str]) -> Telling:
    """Return what readings exp(powers p) tell of p, with noise 0.001."""
    return telling(names, powers / 1e-3, lambda points: np.abs(np.exp(points @ powers.T) - 1.0).max(axis=1) / 1e-3)


def test_only_a_product_shows() -> None:
    found = told(np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), ["gain", "slope", "lag"])
    assert [item.sentence for item in found.hidden] == ["Only the product of gain and slope shows, and neither of them alone."]
    assert found.known == 2
    assert [name for name, _ in found.loose] == ["gain", "slope"]


def test_a_gain_before_two_others_is_one_combination() -> None:
    found = told(np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0]]), ["gain", "proportional", "integral"])
    sentence = "Only the products of gain with each of proportional and integral show, and none of them alone."
    assert [item.sentence for item in found.hidden] == [sentence]


def test_what_does_not_act_does_not_show() -> None:
    found = told(np.array([[1.0, 0.0]]), ["gain", "spare"])
    assert [item.sentence for item in found.hidden] == ["spare does not show at all."]
