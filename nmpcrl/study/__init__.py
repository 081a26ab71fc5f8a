"""The paper's numbers, layouts and experiments, their runs, and the store of records."""

from nmpcrl.study import paper
from nmpcrl.study.design import sweep
from nmpcrl.study.experiment import Experiment
from nmpcrl.study.files import StoreError
from nmpcrl.study.parameters import ParameterError
from nmpcrl.study.records import DamagedRecords, Records
from nmpcrl.study.run import run
from nmpcrl.study.store import Runs, fetch, fetch_all, stored
from nmpcrl.study.trial import Trial

__all__ = [
    "DamagedRecords",
    "Experiment",
    "ParameterError",
    "Records",
    "Runs",
    "StoreError",
    "Trial",
    "fetch",
    "fetch_all",
    "paper",
    "run",
    "stored",
    "sweep",
]
