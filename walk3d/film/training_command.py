"""Command `model`, which trains a model of walkers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.cli.options import filled
from pipeline.cli.output import tell
from pipeline.clips.kinds import WALKS, Walks
from pipeline.storage.sealed_folders import require_replaceable
from pipeline.validation import InvalidInput, Options
from walk3d.film.reconstruct import model_file
from walk3d.film.reconstruct.own_laboratory import calibrate
from walk3d.film.reconstruct.training import Training, train


class _Named(Options):
    training: Training = Training()


def train_model(arguments: Sequence[str]) -> int:
    """Train the model of walkers on a data set, and write the model with its manifest.

    If the data have at most twice as many people as eigenwalkers, the shipped model is calibrated instead.
    """
    training_items = [item for item in arguments if item.startswith(("training.", "output="))]
    rest = [item for item in arguments if item not in training_items]
    if "output=" in training_items:
        raise InvalidInput("must name a folder", "output", received="nothing", code="none_named")
    folder = Path(
        next((item[7:] for item in training_items if item.startswith("output=")), str(model_file.SHIPPED))
    )
    require_replaceable(folder, having=model_file.ENTRY)  # before the long training
    training = filled(_Named, [item for item in training_items if item.startswith("training.")]).training
    from pipeline.cli.compose import compose  # loads Hydra, which takes a while

    if not any(item.startswith("data=") for item in rest):
        rest = ["data=many", *rest]
    experiment = compose(["experiment=zhang2007_fig2", "dataset.walks=all", *rest])
    request = experiment.data.request(WALKS, experiment.skeleton, experiment.seed, experiment.workers)
    walks = request.make()
    assert isinstance(walks, Walks)
    people = len(set(walks.person.tolist()))
    if people > 2 * training.components:
        trained = train(walks, training, lambda words: tell(words, "dim"))
        sentence = f"{people} people"
    elif folder.resolve() == model_file.SHIPPED:
        raise InvalidInput(
            "must name a folder: the data have too few people to train a model that replaces the shipped model",
            "output",
            f"output=… or more than {2 * training.components} people",
            people,
            code="few_people",
            needed=2 * training.components + 1,
            people=people,
        )
    else:
        trained = calibrate(model_file.load(), walks)
        sentence = (
            f"the model of {trained.compact.walkers} people, calibrated on {people} of another laboratory"
        )
    model_file.save(trained, folder)
    tell(f"{sentence}; written to {folder}")
    return 0
