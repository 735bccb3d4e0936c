"""Wall time, processor time and peak memory of each figure, computed alternately with this commit and another commit.

Options: `reference` (a checkout of the other commit; without it only our own times are taken), `figures` (names with
commas between; all by default), `scale`, `data`, `rounds`, `workers`.  A ratio is reference over ours, the median of
the rounds.  Each figure begins with an empty store, so it also pays for the stages that it shares with others.
"""

from __future__ import annotations

import statistics
import tempfile
from pathlib import Path

from pipeline import plugins
from tests.benchmarks import children, pictures
from tests.benchmarks.tables import Row

HERE = Path(__file__).resolve().parents[2]


def run(
    reference: str = "", figures: str = "", scale: str = "full", data: str = "synthetic", rounds: str = "1",
    workers: str = "1",
) -> list[Row]:  # fmt: skip
    """Return one row for each figure that both commits have."""
    checkouts = {"ours": HERE} | ({"reference": Path(reference).resolve()} if reference else {})
    for checkout in checkouts.values():
        if not (checkout / "pipeline" / "__main__.py").is_file():
            raise SystemExit("the option reference must name a checkout of this project")
    target = figures.split(",") if figures else list(plugins.conf_files("experiment"))
    rows = []
    for figure in target:
        if not all(
            any(c.glob(f"*/experiment/{figure}.yaml")) or any(c.glob(f"*/conf/experiment/{figure}.yaml"))
            for c in checkouts.values()
        ):
            continue
        used: dict[str, list[children.Used]] = {name: [] for name in checkouts}
        for _ in range(int(rounds)):
            for name, checkout in checkouts.items():
                used[name].append(
                    _made(checkout, figure, [f"scale={scale}", f"data={data}", f"workers={workers}"])
                )
        rows.append(_row(figure, used))
        print(f"  {figure}", flush=True)
    return rows


def _made(checkout: Path, figure: str, options: list[str]) -> children.Used:
    """Compute one figure with a checkout, without its recording; return its time and memory."""
    # Before the code was cut by study, the options of figures were those of the report.
    group = "report" if (checkout / "conf" / "report").is_dir() else "figure"
    with tempfile.TemporaryDirectory() as folder:
        arguments = [
            "figures",
            f"experiment={figure}",
            *options,
            f"{group}.recording=false",
            f"results={folder}",
        ]
        return children.run(["-m", "pipeline", *arguments], checkout)


def _row(figure: str, used: dict[str, list[children.Used]]) -> Row:
    row: Row = {"figure": figure}
    for name, runs in used.items():
        row[f"{name}_cpu_s"] = round(statistics.median(u.cpu_s for u in runs), 2)
        row[f"{name}_wall_s"] = round(statistics.median(u.wall_s for u in runs), 2)
        row[f"{name}_peak_mb"] = round(max(u.peak_mb for u in runs))
    if "reference" in used:
        for what in ("cpu_s", "wall_s"):
            ratios = [
                getattr(theirs, what) / getattr(ours, what)
                for ours, theirs in zip(used["ours"], used["reference"], strict=True)
            ]
            row[f"times_ours_{what.removesuffix('_s')}"] = statistics.median(ratios)
    return row


def draw(rows: list[Row], stem: Path) -> None:
    """Draw the time of the reference relative to ours, or our own seconds, against the number of the figure."""
    columns = [c for c in rows[0] if c.startswith("times_ours")] or ["ours_cpu_s", "ours_wall_s"]
    names = ", ".join(f"{n} {row['figure']}" for n, row in enumerate(rows, 1))
    pictures.draw_columns(stem, rows, columns, xlabel="Figure", caption=f"{names}.")
