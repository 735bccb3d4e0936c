"""The command `model`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.cli.compose import compose
from pipeline.cli.options import filled
from pipeline.cli.output import tell
from pipeline.clips.kinds import WALKS, Walks
from pipeline.reconstruct import model_file
from pipeline.reconstruct.training import Training, train
from pipeline.storage.sealed_folders import require_replaceable
from pipeline.validation import InvalidInput


def train_model(arguments: Sequence[str]) -> int:
    """Train the model of walkers from a data set and write it with its manifest."""
    own = [item for item in arguments if item.startswith(("training.", "output="))]
    rest = [item for item in arguments if item not in own]
    if "output=" in own:
        raise InvalidInput("must name a folder", where="output", received="nothing")
    folder = Path(next((item[7:] for item in own if item.startswith("output=")), str(model_file.SHIPPED)))
    require_replaceable(folder, having=model_file.ENTRY)  # before the work, not after it
    training = filled(Training, [item[9:] for item in own if item.startswith("training.")])
    if not any(item.startswith("data=") for item in rest):
        rest = ["data=many", *rest]
    experiment = compose(["experiment=zhang2007_fig2", "dataset.walks=all", *rest])
    request = experiment.data.request(WALKS, experiment.skeleton, experiment.seed, experiment.workers)
    walks = request.make()
    assert isinstance(walks, Walks)
    trained = train(walks, training, lambda words: tell(words, "dim"))
    model_file.save(trained, folder)
    tell(f"{trained.compact.rest.walkers} people; written to {folder}")
    return 0
