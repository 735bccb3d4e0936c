"""The commands `reconstruct` and `model`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import hydra
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf
from rich.text import Text

from pipeline.cli.overrides import quoted
from pipeline.cli.presets import CONF
from pipeline.cli.summary import open_console
from pipeline.reconstruct import model_file, words
from pipeline.reconstruct.writing import Reconstruct, run
from pipeline.validation import InvalidInput

Options = TypeVar("Options")


def _options(kind: type[Options], overrides: Sequence[str]) -> Options:
    """Options of a command from overrides, refused with the full key as those of an experiment are."""
    for item in overrides:
        if "=" not in item or item.startswith("+"):
            raise InvalidInput("this is not an override", expected="option=value", received=repr(item))
    ConfigStore.instance().store(name="command", node=kind)
    GlobalHydra.instance().clear()
    with hydra.initialize_config_dir(version_base="1.3", config_dir=str(CONF), job_name="pipeline"):
        composed = hydra.compose("command", overrides=quoted(overrides))
    found: Options = OmegaConf.to_object(composed)  # type: ignore[assignment]
    return found


def reconstruct(arguments: Sequence[str]) -> int:
    """Reconstruct a walk from keypoints; return 0 also if it was none, which the summary says."""
    if arguments and "=" not in arguments[0]:  # a file or folder alone, as other commands take it
        arguments = [f"input.path={arguments[0]}", *arguments[1:]]
    _, summary, folder = run(_options(Reconstruct, arguments))
    out = open_console()

    def tell(text: str, style: str = "") -> None:
        out.print(Text(text, style=style), soft_wrap=True)

    tell(f"{summary['verdict']}{''.join(f': {why}' for why in summary['why'])}", "bold")
    if "view_angle_deg" in summary:
        view, cadence = summary["view_angle_deg"], summary["cadence"]
        low, high = view["interval_95"]
        tell(f"  walks {view['words']}; view angle {view['value']}° ({low} to {high}°)")
        for other in view["alternatives"]:
            tell(f"  {words.alternative(other)}")
        tell(f"  {cadence['steps_per_min']} steps a minute, {summary['locomotion']}")
        for name in ("left_knee", "right_knee"):
            knee = summary["angles_deg"][name]
            tell(f"  {name.replace('_', ' ')} {knee['least']} to {knee['most']}°, ±{knee['half_width_95']}°")
    tell(f"  {summary['recognised']['layout']}")
    for note in summary["notes"]:
        tell(f"  {note}", "dim")
    for sentence in summary.get("next_time", ()):
        tell(f"  next time: {sentence}", "dim")
    tell(f"written to {folder}")
    return 0


def train_model(arguments: Sequence[str]) -> int:
    """Train the model of walkers from a data set and write it with its manifest."""
    # Imported here: a reconstruction takes less time than these to load.
    from pipeline.cli.compose import compose
    from pipeline.clips.kinds import WALKS, Walks
    from pipeline.reconstruct.training import Training, train

    own = [item for item in arguments if item.startswith(("training.", "output="))]
    rest = [item for item in arguments if item not in own]
    output = next((item[7:] for item in own if item.startswith("output=")), "")
    training = _options(Training, [item[9:] for item in own if item.startswith("training.")])
    if not any(item.startswith("data=") for item in rest):
        rest = ["data=optical", *rest]
    experiment = compose(["experiment=zhang2007_fig2", "dataset.walks=all", *rest])
    request = experiment.data.request(WALKS, experiment.skeleton, experiment.seed, experiment.workers)
    walks = request.make()
    assert isinstance(walks, Walks)
    out = open_console()
    trained = train(walks, training, lambda words: out.print(Text(words, style="dim"), soft_wrap=True))
    folder = Path(output) if output else model_file.SHIPPED
    model_file.save(trained, folder)
    out.print(f"{trained.compact.rest.walkers} people; written to {folder}")
    return 0
