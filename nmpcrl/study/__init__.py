"""What is measured: the paper's numbers, runs, metrics, claims and figures."""

from nmpcrl.study import paper
from nmpcrl.study.experiment import Experiment, run
from nmpcrl.study.parameters import ParameterError
from nmpcrl.study.records import DamagedRecords, Records
from nmpcrl.study.store import Study, fetch, fetch_all, stored
from nmpcrl.study.sweeps import main_study, sweep

__all__ = [
    "DamagedRecords",
    "Experiment",
    "ParameterError",
    "Records",
    "Study",
    "fetch",
    "fetch_all",
    "main_study",
    "paper",
    "run",
    "stored",
    "sweep",
]
