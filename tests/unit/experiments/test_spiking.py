"""Grid, border and place cells whose spikes are samples of a posterior."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.spiking import measure as spiking
from cogmap.estimation.spiking.cells import (
    GAMMA_S,
    PEAK,
    BorderCells,
    GridModule,
    generate,
    place_centres_m,
)
from cogmap.experiments.spiking.network import Border, Cues, exact, record

ROUND = Cues((2.5, 2.5), ((0.09, 0.0), (0.0, 0.09)), (Border(0, 2.8, 0.3),))
TOP_CELLS = 20


def test_a_grid_cells_field_repeats_on_a_hexagonal_lattice() -> None:
    module = GridModule(0.8)
    where_m = np.random.default_rng(1).uniform(-3, 3, (40, 2))
    tuning = module.tuning(where_m)

    for neighbour_m in module.lattice_m.T:
        repeated = module.tuning(where_m + neighbour_m)
        assert repeated == pytest.approx(tuning, abs=1e-4)


@pytest.mark.parametrize("spacing_m", [0.5, 1.36])
def test_every_place_has_a_grid_cell_that_fires_there(spacing_m: float) -> None:
    centres_m = place_centres_m(5.0)
    module = GridModule(spacing_m)

    chosen = module.nearest(centres_m)
    tuning = module.tuning(centres_m)[chosen, np.arange(len(centres_m))]

    assert (tuning > 0.6).all()


def test_every_place_has_a_border_cell_that_fires_there() -> None:
    centres_m = place_centres_m(5.0)
    cells = BorderCells(5.0)

    chosen = cells.nearest(centres_m[:, 0])

    assert cells.distances_m[chosen] == pytest.approx(centres_m[:, 0])


def test_cells_fire_in_proportion_to_their_tuning() -> None:
    never, half, always = np.float32([0.0, 0.5, 1.0])
    share = np.repeat([[never], [half], [always]], 20_000, axis=1)
    spikes = generate(share, np.random.default_rng(1))
    fired = np.unpackbits(spikes, axis=1)

    assert fired.mean(axis=1) == pytest.approx([0.0, PEAK / 2, PEAK], abs=0.01)


def test_place_cells_fire_only_where_all_their_inputs_do() -> None:
    spikes = record(ROUND, 5.0, 30.0, np.random.default_rng(1))
    busiest = np.argsort(spikes.counts)[-TOP_CELLS:]
    centres_m = spikes.centres_m[busiest]
    grid_cells = GridModule(0.5).nearest(centres_m)
    border_cells = BorderCells(5.0).nearest(centres_m[:, 0])

    fired = spikes.place[busiest]
    grid_fired = spikes.grid[0][grid_cells]
    border_fired = spikes.border[0][border_cells]

    assert fired.any()
    assert not (fired & ~grid_fired).any()
    assert not (fired & ~border_fired).any()


def test_the_exact_posterior_lies_between_the_cues_by_their_precision() -> None:
    found = exact(ROUND)

    assert found.mean_m == pytest.approx([2.65, 2.5])
    assert found.sd_m == pytest.approx([0.3 / 2**0.5, 0.3])


def test_a_border_moves_the_estimate_along_it_where_the_prior_is_slanted() -> None:
    slanted = Cues((2.5, 2.5), ((0.09, 0.06), (0.06, 0.09)), (Border(0, 2.8, 0.3),))
    expected = exact(slanted)
    spikes = record(slanted, 5.0, 300.0, np.random.default_rng(1))

    assert expected.mean_m[1] > 2.59
    assert spikes.posterior.mean_m == pytest.approx(expected.mean_m, abs=0.05)


def test_spikes_are_samples_of_the_posterior() -> None:
    scenes = [spiking.scene(seed) for seed in range(4)]
    metrics = spiking.metrics(scenes)

    assert metrics["posterior_sd_ratio"] == pytest.approx(1.0, abs=0.1)
    assert metrics["posterior_mean_error"] < 0.1


def test_the_same_seed_gives_the_same_spikes() -> None:
    first, again = (
        record(ROUND, 5.0, 8 * GAMMA_S, np.random.default_rng(4)).place for _ in range(2)
    )

    assert np.array_equal(first, again)


def test_a_recording_without_spikes_has_no_posterior() -> None:
    far = Cues((2.5, 2.5), ((1e-4, 0.0), (0.0, 1e-4)), (Border(0, 0.2, 0.01),))
    spikes = record(far, 5.0, 1.0, np.random.default_rng(1))

    with pytest.raises(ValueError, match="record for longer"):
        _ = spikes.posterior
