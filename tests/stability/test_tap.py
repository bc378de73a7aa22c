"""The tap test: response, double hits and overloads, modes with intervals, files in and out, and what cannot be used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lathesim.errors import LatheSimError
from lathesim.stability.choose_modes import find_modes
from lathesim.stability.lesson_settings import Cut, tap_until_good, with_modes
from lathesim.stability.modal_fit import ModalModel, weights_of_mean
from lathesim.stability.response_files import read_response, write_response
from lathesim.stability.tap import TapEstimate, TapSettings, estimate_response, judged_hits, tap
from lathesim.stability.tool_point import FrequencyResponse, Mode, Quantity, ToolPoint, ends_too_low

THREE = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(420.0, 0.035, 3e7), Mode(1180.0, 0.012, 9e7)), (1.0, 1.0, 1.0))
F = np.arange(1, 2001) * 0.5
CLEAN = FrequencyResponse(F, THREE.receptance(F), np.full(len(F), 0.99), np.stack([THREE.receptance(F) * 1.01] * 2))


@pytest.fixture(scope="module")
def tapped() -> TapEstimate:
    return estimate_response(tap(THREE, TapSettings(), 5))


def test_the_response_of_taps_is_that_of_the_tool_point(tapped: TapEstimate) -> None:
    response = tapped.response
    near = np.isin(response.frequency, (150.0, 420.0, 1180.0))
    assert response.receptance_values[near] == pytest.approx(THREE.receptance(response.frequency[near]), rel=5e-3)
    assert response.coherence is not None
    assert response.coherence[near].min() > 0.999


@pytest.mark.slow
def test_modes_number_and_values_from_taps(tapped: TapEstimate) -> None:
    found = find_modes(tapped.response)
    assert found.decided_on == "each of 5 hits in turn, which was not fitted"
    assert len(found.modes) == 3
    for mode, true in zip(found.modes, THREE.modes, strict=True):
        assert mode.frequency.value == pytest.approx(true.frequency, rel=1e-4)
        assert mode.damping.value == pytest.approx(true.damping, rel=5e-3)
        assert mode.stiffness.value == pytest.approx(true.stiffness, rel=5e-3)
        assert mode.stiffness.low < mode.stiffness.value < mode.stiffness.high


def test_double_hits_are_found_and_made_again() -> None:
    settings = TapSettings(double_hits=0.5, length=0.4)
    record = tap(THREE, settings, 3)
    found = estimate_response(record)
    assert [bool(hit.reason) for hit in found.hits] == list(record.truth)
    again = tap_until_good(THREE, settings, 3)
    assert sum(not hit.reason for hit in again.hits) >= 5


@pytest.mark.parametrize("contact", [8e-5, 1.5e-4])
def test_ringing_of_the_filter_after_a_short_contact_is_no_double_hit(contact: float) -> None:
    record = tap(THREE, TapSettings(hits=6, length=0.1, contact=contact, double_hits=0.5), 2)
    assert 0 < sum(record.truth) < 6
    assert [bool(hit.reason) for hit in judged_hits(record)] == list(record.truth)


def test_noise_of_the_force_is_known_where_it_lies_beside_the_pulse(tapped: TapEstimate) -> None:
    response = tapped.response
    true = THREE.receptance(response.frequency)
    assert response.hits is not None
    assert 0.0 < response.pulse_lead < 0.5 * response.pulse_length  # the filter's tail is behind the pulse
    weights = weights_of_mean(response, response.hits, len(response.hits), true)
    misfit = weights.misfit(response.receptance_values - true) / (2.0 * len(true))
    assert misfit == pytest.approx(1.0, abs=0.12)


def test_an_overload_is_told() -> None:
    record = tap(THREE, TapSettings(length=0.3, force_range=400.0, hits=2), 1)
    with pytest.raises(LatheSimError, match="the force is overloaded at 400 N"):
        estimate_response(record)


@pytest.mark.slow
def test_a_response_that_has_not_died_out_is_windowed_and_its_damping_corrected() -> None:
    slow = ToolPoint((Mode(200.0, 0.004, 1e7),), (1.0,))
    found = estimate_response(tap(slow, TapSettings(length=0.3), 2))
    assert found.response.window_rate > 1.0
    (mode,) = find_modes(found.response, 1).modes
    assert mode.damping.value == pytest.approx(0.004, rel=0.01)


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize("name", ["response.csv", "response.mat", "response.uff"])
def test_what_is_written_is_read_back_with_its_quantity(name: str, quantity: Quantity, tmp_path: Path) -> None:
    whole = replace(CLEAN, quantity=quantity, forces=1e-3 / F, window_rate=0.3, pulse_length=3e-3, pulse_lead=1e-3, force_noise=4e-3)
    write_response(whole, tmp_path / name)
    read = read_response(tmp_path / name)
    within = 0.0 if quantity == "receptance" else 1e-15
    for item in ("frequency", "receptance_values", "coherence", "forces", "hits"):
        assert np.allclose(getattr(read, item), getattr(whole, item), rtol=within, atol=0.0), item
    assert (read.quantity, read.notes) == (quantity, whole.notes)


def test_taps_with_an_accelerometer_lead_to_the_mode_from_the_file_too(tmp_path: Path) -> None:
    tool = ToolPoint((Mode(212.0, 0.027, 1.2e7),), (1.0,))
    response = estimate_response(tap(tool, TapSettings(length=0.5, sensor="accelerance", response_noise=0.02), 1)).response
    write_response(response, tmp_path / "tap.csv")
    (mode,) = find_modes(read_response(tmp_path / "tap.csv")).modes
    assert mode.frequency.value == pytest.approx(212.0, rel=1e-4)
    assert mode.damping.value == pytest.approx(0.027, rel=2e-3)
    assert mode.stiffness.value == pytest.approx(1.2e7, rel=2e-3)


def test_uneven_frequencies_and_ascii_universal_files(tmp_path: Path) -> None:
    uneven = np.round(np.geomspace(1.0, 900.0, 300), 2)
    response = FrequencyResponse(uneven, THREE.receptance(uneven))
    for binary in (False, True):
        write_response(response, tmp_path / "uneven.uff", binary=binary)
        read = read_response(tmp_path / "uneven.uff")
        assert np.array_equal(read.frequency, uneven)
        assert read.receptance_values == pytest.approx(response.receptance_values, rel=1e-12)
    fine = FrequencyResponse(np.geomspace(1.0, 900.0, 300), THREE.receptance(np.geomspace(1.0, 900.0, 300)))
    with pytest.raises(LatheSimError, match="more than the six digits"):
        write_response(fine, tmp_path / "fine.uff", binary=False)


def test_traps_of_real_universal_files(tmp_path: Path) -> None:
    write_response(CLEAN, tmp_path / "plain.uff")
    raw = (tmp_path / "plain.uff").read_bytes()
    spoilt = (
        raw.replace(b"tool point", b"Fr\xe4se \xb5m  ")
        .replace(b"\n    -1\n", b"\r\n\n    -1\r\n")
        .replace(b"       32000", b"       16000")
    )
    (tmp_path / "spoilt.uff").write_bytes(spoilt)
    assert np.array_equal(read_response(tmp_path / "spoilt.uff").receptance_values, CLEAN.receptance_values)
    write_response(CLEAN, tmp_path / "ascii.uff", binary=False)
    text = (tmp_path / "ascii.uff").read_text(encoding="ascii")
    (tmp_path / "d.uff").write_text(text[:1200] + text[1200:].replace("e-", "D-").replace("e+", "D+"), encoding="ascii")
    assert read_response(tmp_path / "d.uff").receptance_values == pytest.approx(CLEAN.receptance_values, rel=1e-11)
    (tmp_path / "short.uff").write_bytes(raw[:20000])
    with pytest.raises(LatheSimError, match="the data end after"):
        read_response(tmp_path / "short.uff")


def test_pyuff_reads_what_is_written(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    for binary in (False, True):
        write_response(CLEAN, tmp_path / "ours.uff", binary=binary)
        found = pyuff.UFF(str(tmp_path / "ours.uff")).read_sets(0)
        assert found["data"] == pytest.approx(CLEAN.receptance_values, rel=1e-11)
        assert found["x"] == pytest.approx(CLEAN.frequency)


def test_mobility_and_accelerance_become_receptance(tmp_path: Path) -> None:
    omega = 2.0 * np.pi * F
    for unit, factor in (("m/s/N", 1j * omega), ("g/N", -(omega**2) / 9.80665)):
        values = CLEAN.receptance_values * factor
        table = np.stack([F, values.real, values.imag], axis=1)
        np.savetxt(tmp_path / "r.csv", table, delimiter=",", header=f"frequency [Hz],real [{unit}],imag [{unit}]", comments="", fmt="%.17g")
        assert read_response(tmp_path / "r.csv").receptance_values == pytest.approx(CLEAN.receptance_values, rel=1e-12)


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ("frequency [Hz],magnitude [m/N]\n" + "".join(f"{f},1e-6\n" for f in range(1, 20)), "the response has no phase"),
        ("frequency [Hz],real [m/N],imag [m/N]\n" + "".join(f"{f},1e300,-1e299\n" for f in range(1, 20)), "1e+300 m/N in the median"),
        (
            "frequency [Hz],real [m/N],imag [m/N]\n" + "".join(f"{20 - f},1e-6,-1e-7\n" for f in range(19)),
            "the frequencies fall from 20 to 19",
        ),
        ("frequency [Hz],real,imag\n" + "".join(f"{f},1e-6,-1e-7\n" for f in range(1, 20)), "gives no unit of the response"),
        (
            "frequency [Hz],real [N/m],imag [N/m]\n" + "".join(f"{f},1,-1\n" for f in range(1, 20)),
            "'N/m' is no unit of a frequency response",
        ),
        (
            "frequency [Hz],real [m/N],imag [m/N],coherence\n" + "".join(f"{f},1e-6,-1e-7,0.3\n" for f in range(1, 20)),
            "the coherence is at most 0.3",
        ),
        ("frequency [Hz],real [m/N],imag [m/N]\n1,1e-6,-1e-7\n", "the response has 1 lines"),
    ],
)
def test_a_response_that_cannot_be_used_is_told_in_one_sentence(rows: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "r.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(LatheSimError) as caught:
        read_response(tmp_path / "r.csv")
    assert told in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_close_pair_is_told_as_two() -> None:
    pair = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(154.5, 0.02, 8e6)), (1.0, 1.0))
    found = [len(find_modes(estimate_response(tap(pair, TapSettings(), seed)).response).modes) for seed in range(5)]
    assert found.count(2) >= 4


def test_modes_without_single_hits_are_decided_on_lines() -> None:
    found = find_modes(replace(CLEAN, hits=None, coherence=None))
    assert "every second line" in found.decided_on
    assert [mode.frequency.value for mode in found.modes][:2] == pytest.approx([150.0, 420.0], rel=1e-3)


def measured(modes: list[tuple[float, float, float]], highest: float, noise: float, seed: int) -> FrequencyResponse:
    """Return a response of modes (frequency, damping, stiffness) from 20 Hz on, a line each hertz, with noise on each line [m/N]."""
    f, chance = np.arange(20.0, highest + 0.5), np.random.default_rng(seed)
    tool = ToolPoint(tuple(Mode(*mode) for mode in modes), tuple(1.0 for _ in modes))
    return FrequencyResponse(f, tool.receptance(f) + noise * (chance.standard_normal(len(f)) + 1j * chance.standard_normal(len(f))))


ABOVE = [
    ([(300.0, 0.03, 2e7), (1500.0, 0.02, 5e7)], 2e-10),
    ([(300.1, 0.012, 2e7), (460.7, 0.026, 1.1e7), (665.6, 0.012, 6.3e7), (2322.0, 0.02, 2.2e7)], 5e-10),
    ([(113.0, 0.038, 1e7), (710.5, 0.03, 2.2e7), (1446.0, 0.023, 4.4e7), (3100.0, 0.02, 3e7)], 1e-10),
]


@pytest.mark.parametrize(("modes", "noise"), ABOVE)
@pytest.mark.parametrize("given", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_mode_above_the_band_stays_a_residual_term(modes: list[tuple[float, float, float]], noise: float, given: bool) -> None:
    response, inside = measured(modes, 1000.0, noise, 1), [mode for mode in modes if mode[0] < 1000.0]
    found = find_modes(response, len(inside) if given else None)
    assert len(found.modes) == len(inside)
    for mode, true in zip(found.modes, inside, strict=True):
        assert [mode.frequency.value, mode.damping.value, mode.stiffness.value] == pytest.approx(true, rel=2e-3)
        assert mode.stiffness.high < 1.01 * mode.stiffness.low
    tool, told = with_modes(Cut(response, 1e9))
    lines = np.linspace(20.0, 1000.0, 20000)
    true = ToolPoint(tuple(Mode(*mode) for mode in modes), tuple(1.0 for _ in modes)).receptance(lines).real.min()
    assert tool.receptance(lines).real.min() == pytest.approx(true, rel=0.01)
    assert "the residual term outside 20 to 1000 Hz is kept" in told


def test_poles_that_cancel_each_other_or_that_nothing_determines_are_phantoms() -> None:
    omega, damping = 2.0 * np.pi * np.array([300.0, 600.0, 600.1, 900.0]), np.array([0.03, 0.02, 0.02, 1e-6])
    model = ModalModel(omega, damping, np.array([0.2, 9.0, -9.1, 0.1]), np.zeros(2), 0.0, 0.0, np.diag([1e-6] * 7 + [9.0] + [1e-6] * 6))
    assert model.phantoms(np.array([20.0, 1000.0])) == [1, 2, 3]


@pytest.mark.parametrize(
    ("highest", "told"), [(250.0, "below a mode that still adds to it"), (303.0, "below the chatter frequency"), (800.0, None)]
)
def test_a_response_that_ends_too_low_is_told(highest: float, told: str | None) -> None:
    found = ends_too_low(measured([(300.0, 0.03, 2e7)], highest, 2e-10, 1), 0.5)
    assert found == () if told is None else told in found[0]


@pytest.mark.slow
def test_a_number_that_is_given_leads_to_the_modes_that_are_found_without_it() -> None:
    tool = ToolPoint((Mode(150.0, 0.02, 8e6), Mode(420.0, 0.035, 3e7), Mode(1180.0, 0.012, 9e7)), (1.0, 1.0, 1.0))
    response = tap_until_good(tool, TapSettings(double_hits=0.25), 22_002).response
    given, found = find_modes(response, 3), find_modes(response)
    for one, other in zip(given.modes, found.modes, strict=True):
        assert one.frequency.value == pytest.approx(other.frequency.value, rel=1e-6)
        assert one.stiffness.value == pytest.approx(other.stiffness.value, rel=1e-4)
