"""The paper's predictions of place cells (§5.6): those of a drive, and recordings beside them."""

from __future__ import annotations

from io import BytesIO

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cogmap.cli.plots.palette import ESTIMATE, FAINT, PAPER, POSITIONS, TRUE
from cogmap.cli.plots.sheet import describe, new_sheet
from cogmap.experiments.predictions.drive import Drive, Metrics

_UNDATED = {".pdf": {"CreationDate": None}}
LEGEND = {"frameon": False, "fontsize": 8.5}


def encode(figure: Figure, suffix: str) -> bytes:
    """Encode a figure as a file of the kind that `suffix` names, the same bytes each time."""
    file = BytesIO()
    figure.savefig(file, format=suffix[1:], facecolor=PAPER, metadata=_UNDATED.get(suffix))
    return file.getvalue()


def drive_figure(drive: Drive, metrics: Metrics, name: str) -> Figure:
    """Draw the three predictions of a drive, a panel each."""
    title = f"What the drive in {name} predicts of place cells, corrected by {drive.rule}"
    with new_sheet(14.0, 4.8, title) as sheet:
        counts, shifts, synapses = sheet.subplots(1, 3)
        _draw_counts(counts, drive)
        _draw_shifts(shifts, drive)
        _draw_synapses(synapses, drive, metrics)
    return sheet


def _draw_counts(axes: Axes, drive: Drive) -> None:
    places = drive.places
    axes.step(
        places.along_m, places.replays, where="mid", color=POSITIONS, lw=1.8, label="replayed"
    )
    axes.step(places.along_m, places.revisits, where="mid", color=TRUE, lw=1.2, label="revisited")
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(bottom=0)
    axes.legend(**LEGEND)
    title = f"a   {drive.passes} replays, {drive.revisits} revisits"
    describe(axes, title, "place, m along the corrected path", "times")


def _draw_shifts(axes: Axes, drive: Drive) -> None:
    first, *others = drive.corrections
    for number, replayed in enumerate(others):
        label = "later corrections" if number == 0 else None
        axes.plot(replayed.behind_m, replayed.shifts_m, color=FAINT, lw=0.7, label=label)
    axes.plot(first.behind_m, first.shifts_m, color=POSITIONS, lw=1.8, label="first correction")
    axes.set_ylim(bottom=0)
    axes.legend(**LEGEND)
    title = "b   shift of each place field"
    describe(axes, title, "from the closure back along the loop, m", "shift, m")


def _draw_synapses(axes: Axes, drive: Drive, metrics: Metrics) -> None:
    """Plot close pairs, and the mean over all pairs by distance; fields brought together from afar
    would lie far outside.
    """
    first = drive.corrections[0]
    close = first.close
    shown = axes.scatter(
        first.apart_m[close],
        first.strength_changes[close],
        c=first.nearer_m[close],
        s=12,
        cmap="cividis",
        label="published pairs of close fields",
    )
    by_distance = drive.by_distance
    axes.plot(
        by_distance.distance_m,
        by_distance.mean_change,
        "o-",
        color=ESTIMATE,
        lw=1.4,
        ms=4,
        label="all pairs, mean absolute change",
    )
    if close.any():
        axes.figure.colorbar(shown, ax=axes, label="by how much they come nearer, m")
    axes.axhline(0.0, color=FAINT, lw=0.7)
    axes.legend(**LEGEND)
    slope = metrics["strength_change_per_m_close_pairs"]
    r = metrics["strength_and_shift_correlation_close_pairs"]
    title = f"c   synapses, close fields: {slope:.3f} a metre nearer, r = {r:.2f}"
    y = f"change of exp(-{first.decay_per_m:g} d)"
    describe(axes, title, "distance d of two fields before, m", y)
