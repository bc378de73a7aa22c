"""Kinematics of machines: printed numbers, round trips on both branches, singularities told in a sentence."""

from __future__ import annotations

import numpy as np
import pytest

from lathesim.motion.joint_path import MotionError, fit_curve
from lathesim.motion.kinematics import CHAINS, Poses, branches, chain_from, forward, inverse, path_error, tip_speed

TRUNNION = CHAINS["trunnion"]


@pytest.mark.parametrize(
    ("joints", "point", "direction"),
    [
        ((10.0, -5.0, 30.0, 20.0, -35.0), (35.77576224, 15.8227455, 33.65861557), (0.53898554, 0.34202014, 0.76975113)),
        ((3.0, 4.0, -12.0, -60.0, 100.0), (-2.94761091, -13.58845727, 2.5265365), (-0.49240388, -0.8660254, -0.08682409)),
        ((0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 20.0), (0.0, 0.0, 1.0)),
    ],
)
def test_the_trunnion_has_the_computed_poses(joints: tuple[float, ...], point: tuple[float, ...], direction: tuple[float, ...]) -> None:
    poses = forward(TRUNNION, np.array([[*(1e-3 * value for value in joints[:3]), *np.deg2rad(joints[3:])]]))
    assert 1e3 * poses.points[0] == pytest.approx(point, abs=1e-8)
    assert poses.directions[0] == pytest.approx(direction, abs=1e-8)


def test_the_trunnion_has_the_computed_second_branch() -> None:
    first = np.array([[0.01, -0.005, 0.03, *np.deg2rad([20.0, -35.0])]])
    found = branches(TRUNNION, forward(TRUNNION, first))
    assert found[0].joints == pytest.approx(first, abs=1e-12)
    x, y, z, a, b = found[1].joints[0]
    assert 1e3 * np.array([x, y, z]) == pytest.approx([-10.0, -1.840403, 11.206148], abs=1e-6)
    assert np.rad2deg([a, b]) == pytest.approx([160.0, 145.0], abs=1e-9)


@pytest.mark.parametrize("name", CHAINS)
def test_ten_thousand_poses_come_back_on_every_branch(name: str) -> None:
    chain, rng = CHAINS[name], np.random.default_rng(3)
    joints = np.column_stack([rng.uniform(-0.1, 0.1, 10_000) if unit == "m" else rng.uniform(0.1, 1.4, 10_000) for unit in chain.units])
    poses = forward(chain, joints)
    for branch in branches(chain, poses):
        again = forward(chain, branch.joints)
        assert np.abs(again.points - poses.points).max() < 1e-12
        assert np.abs(again.directions - poses.directions).max() < 1e-12


def test_at_the_singularity_the_axis_keeps_its_angle_and_a_sentence_says_so() -> None:
    tilt = np.deg2rad([60.0, 75.0, 90.0, 75.0])
    joints = np.column_stack([np.zeros((4, 3)), tilt, np.deg2rad([40.0] * 4)])
    poses = forward(TRUNNION, joints)
    found = inverse(TRUNNION, poses, joints[0])
    assert (
        found.note == "The tool lies along the axis b at sample 3: every angle of b gives the same pose there, and it keeps the last one."
    )
    assert found.joints == pytest.approx(joints, abs=1e-7)
    assert forward(TRUNNION, found.joints).points == pytest.approx(poses.points, abs=1e-9)


def test_angles_go_on_over_a_whole_turn() -> None:
    turns = np.linspace(0.0, 6.0 * np.pi, 400)
    joints = np.column_stack([np.zeros((400, 3)), np.full(400, 0.4), turns])
    found = inverse(TRUNNION, forward(TRUNNION, joints), joints[0])
    assert found.joints[:, 4] == pytest.approx(turns, abs=1e-9)


def test_a_pose_out_of_reach_is_named() -> None:
    poses = Poses(np.array([[0.02, 0.0, 0.1], [0.02, 0.001, 0.1]]), np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    with pytest.raises(MotionError, match=r"the position along y of sample 2 is out of reach of the machine 'lathe', by 0.001\."):
        inverse(CHAINS["lathe"], poses)


def test_the_way_of_the_tip_is_that_of_the_chain() -> None:
    rng = np.random.default_rng(4)
    joints, slopes = rng.normal(size=(50, 5)), rng.normal(size=(50, 5))
    step = 1e-5
    ways = (forward(TRUNNION, joints + step * slopes).points - forward(TRUNNION, joints - step * slopes).points) / (2.0 * step)
    assert tip_speed(TRUNNION, joints, slopes) == pytest.approx(np.linalg.norm(ways, axis=1), rel=1e-6)


def test_the_path_error_falls_with_the_square_of_the_distance_of_samples() -> None:
    errors = []
    for count in (51, 101):
        s = np.linspace(0.0, 1.0, count)
        points = np.column_stack([0.05 * s, np.zeros(count), np.zeros(count)])
        directions = np.column_stack([np.sin(s), 0.3 + 0.0 * s, np.cos(s)])
        joints = inverse(TRUNNION, Poses(points, directions)).joints
        straight = fit_curve(joints, np.ones(5))
        straight.coefficients[:2] = 0.0
        straight.coefficients[2] = np.diff(joints, axis=0) / np.diff(straight.knots)[:, None]
        errors.append(path_error(TRUNNION, straight).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)


def test_kinematics_are_data() -> None:
    data = {
        "table": [
            {"axis": "a", "about": "x", "pivot": ["0 mm", "0 mm", "-30 mm"]},
            {"axis": "b", "about": [0, 1, 0], "pivot": ["0 mm", "0 mm", "10 mm"]},
        ]
    }
    assert chain_from(data, "f").table == TRUNNION.table
    with pytest.raises(MotionError, match=r"f: there is no kinematics 'trunion'\. Did you mean 'trunnion'?"):
        chain_from("trunion", "f")
    with pytest.raises(MotionError, match=r"there is no key 'abuot'\. Did you mean 'about'?"):
        chain_from({"table": [{"axis": "a", "abuot": "x"}]}, "f")
