"""What judges where there is one recording: its second half, or every other stretch of a run whose only entry a half would lack."""

import numpy as np

from lathesim.identification.replay.validation_split import dealt_out, halves, halves_miss_a_switch, is_one_stroke, parted, switches
from lathesim.record import Record
from tests.diagnosis.one_cut import CUT, DEPTH, cut_machine, cut_record
from tests.diagnosis.pushed_table import FORCE, POSITION, as_record, machine, recording


def test_halves_begin_at_zero_and_share_nothing() -> None:
    record = recording(count=401)
    first, second = halves(record)
    assert (len(first), len(second)) == (200, 201)
    assert first.time[0] == second.time[0] == 0.0
    assert np.array_equal(np.concatenate([first[POSITION], second[POSITION]]), record[POSITION])
    assert second.sample_period == record.sample_period


def test_a_single_entry_lies_in_one_half_only() -> None:
    record = cut_record()
    rise, fall = switches(record, (DEPTH,))
    assert (rise.tolist(), fall.tolist()) == ([CUT.start], [CUT.stop])
    assert halves_miss_a_switch(record, (DEPTH,))


def test_four_cuts_have_entries_and_exits_in_both_halves() -> None:
    depth = np.where(np.arange(2000) % 500 < 250, 0.0, 1e-3)
    assert not halves_miss_a_switch(as_record({DEPTH: ("m", depth)}), (DEPTH,))


def test_a_step_between_two_levels_is_no_switch() -> None:
    assert switches(as_record({FORCE: ("N", np.repeat([5.0, 6.0], 500))}), (FORCE,)) == []


def test_no_sample_counts_in_both_and_each_side_sees_every_part_of_the_entry() -> None:
    to_fit, to_judge = dealt_out(cut_record(), (DEPTH,))
    assert not np.any((to_fit > 0.0) & (to_judge > 0.0))
    assert np.sum(to_fit) > 0.3 * len(to_fit) and np.sum(to_judge) > 0.3 * len(to_judge)
    for begin, end in ((0, 20), (20, 40), (40, 80)):
        entry = slice(CUT.start + begin, CUT.start + end)
        assert to_fit[entry].max() == to_judge[entry].max() == 1.0


def test_one_cut_is_dealt_out_and_a_motion_is_halved() -> None:
    fitted, judge, whole = parted(cut_machine(), "cut.csv", cut_record(), ())
    assert judge.name == "cut.csv, every other stretch of one run"
    assert fitted.record is judge.record is whole.record
    assert whole.weights is None
    pushed = np.where(np.arange(2000) < 700, 0.0, 40.0)
    record = as_record({FORCE: ("N", pushed), POSITION: ("m", np.cumsum(np.cumsum(pushed)) * 1e-9)})
    assert parted(machine(), "push.csv", record, ())[1].name == "push.csv, second half"


def moving_at(speed: np.ndarray) -> Record:
    """Return a recording of a table that moves at a speed [m/s], one value every millisecond."""
    return as_record({FORCE: ("N", np.gradient(speed) * 1e3), POSITION: ("m", np.cumsum(speed) * 1e-3)})


def test_one_stroke_is_fitted_whole_and_judges_itself_and_a_second_one_is_not() -> None:
    rest, stroke = np.zeros(100), np.concatenate([np.linspace(0.0, 0.6, 400), np.linspace(0.6, 0.0, 400)])
    alone = moving_at(np.concatenate([rest, stroke, rest]))
    fitted, judge, whole = parted(machine(), "stroke.csv", alone, ())
    assert fitted is judge is whole
    assert (judge.name, judge.machine.output_error, len(judge.record)) == ("stroke.csv", True, 1000)
    plateau = [np.linspace(0.0, 0.6, 100), np.full(600, 0.6), np.linspace(0.6, 0.0, 100), rest]
    for other in ([stroke, rest, stroke, rest], [stroke, -stroke, rest], [np.linspace(0.0, 0.6, 1000)], plateau):
        assert not is_one_stroke(machine(), moving_at(np.concatenate([rest, *other])))
