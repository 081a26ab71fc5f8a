"""A run, with a bar while it is trained."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nmpcrl.study import Experiment, Records


def fetched(experiment: "Experiment") -> "Records":
    """The run, with a bar while it is trained."""
    from tqdm import tqdm

    from nmpcrl.study import fetch
    from nmpcrl.study.records import Stopped

    with tqdm(total=experiment.episodes, unit="ep", desc=experiment.learner) as bar:

        def on_episode(done: int, cost: float) -> None:
            bar.set_postfix_str(f"cost {cost:.0f}", refresh=False)
            bar.update(done - bar.n)

        records = fetch(experiment, on_episode=on_episode)
        finished = records.facts["stopped"] == Stopped.FINISHED
        bar.update(experiment.episodes - bar.n if finished else 0)
    return records
