"""Summaries of runs: made from stored or trained runs, here or on any executor, and stored here."""

from nmpcrl.analysis.summary import RunSummary, summarise
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.provenance import summary_key
from nmpcrl.study.refusal import Refusal
from nmpcrl.study.store import RUNS, Store, refused, train


def make(experiment: Experiment, *, afresh: bool = False) -> RunSummary:
    """The summary of a run, which is trained if it is not stored, or if `afresh` holds.

    A run that needs another solver than its experiment names is refused.
    """
    records = (None if afresh else RUNS.read(experiment)) or train(experiment)
    if why := refused(experiment, records.facts):
        raise Refusal(f"it is {why}")
    return summarise(records)


SUMMARIES = Store(RunSummary, make, summary_key, "summaries")
fetch_summaries = SUMMARIES.fetch_all
