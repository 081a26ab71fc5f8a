"""Wrong numbers that tests must notice: `python tests/mutants.py [claims studies/shifts.py ...]`.

A mutant is one line of the library with a mistake that would put a wrong number before a reader. In
a copy of the project each is made in turn, and the tests that are named for its file must fail.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import traceback
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FAST = "not (slow or weekly or browser or network or built)"
SLOW_TO_IMPORT = "casadi cma matplotlib.pyplot numba pandas scipy.stats torch"

MUTANTS = (  # a file, a part of one of its lines, and the mistake in its place
    ("control/task.py", "1 - 4 * ((x", "1 - 2 * ((x"),
    ("control/task.py", "clearance) + self.margin)", "clearance))"),
    ("control/task.py", "ca.norm_2(action), far", "ca.sumsqr(action), far"),
    ("control/plant.py", "(k1 + 2 * k2 + 2 * k3 + k4)", "(k1 + 2 * k2 + k3 + 2 * k4)"),
    ("control/plant.py", "speed * ca.cos(heading), speed * ca.sin",
     "speed * ca.sin(heading), speed * ca.cos"),
    ("control/ocp.py", "objective += discount * cost", "objective += cost"),
    ("control/ocp.py", "objective += discount * ca.dot(", "objective += ca.dot("),
    ("control/sensitivity.py", "return -self._moved", "return self._moved"),
    ("control/sensitivity.py", "l_tt - right.T @ moved", "l_tt + right.T @ moved"),
    ("control/sensitivity.py", "((-nu, np.abs(z - ocp.lower)), (nu,",
     "((nu, np.abs(z - ocp.lower)), (-nu,"),
    ("learning/updates.py", "cost + gamma * q_next - q", "cost + q_next - q"),
    ("learning/updates.py", "- gamma * dot(w, phi)", "- dot(w, phi)"),
    ("learning/updates.py", "beta * (delta - dot(phi, w)) * phi", "beta * delta * phi"),
    ("learning/learners.py", "theta - alpha * curvature_correction",
     "theta + alpha * curvature_correction"),
    ("learning/bootstrap.py", "transition.next_state, transition.solution.next_action",
     "transition.next_state, transition.action"),
    ("learning/bootstrap.py", "0.0 if transition.end else value", "value"),
    ("learning/bootstrap.py", "if transition.end:", "if transition.last:"),
    ("learning/batches.py", "total / count for", "total for"),
    ("learning/batches.py", "return -delta * phi", "return delta * phi"),
    ("learning/policy_gradient.py", "(transition.action - solution.action)",
     "(solution.action - transition.action)"),
    ("learning/policy_gradient.py", "means.fisher @ w, means", "-means.fisher @ w, means"),
    ("learning/gauss_newton.py", "memory.curvature + y.T", "y.T"),
    ("learning/optimisers.py", "return theta - self.alpha * gradient",
     "return theta + self.alpha * gradient"),
    ("learning/optimisers.py", "(values + low)) <= self.radius",
     "(values + low)) >= self.radius"),
    ("learning/training.py", "np.repeat(np.arange(episodes), steps)",
     "np.repeat(np.arange(episodes) + 1, steps)"),
    ("learning/training.py", "(0, first + e)", "(0, e)"),
    ("learning/remedies.py", "min(alpha, 1 / square)", "min(alpha, 2 / square)"),
    ("learning/loop.py", "td_error(cost, gamma, value, next_value)",
     "td_error(cost, gamma, next_value, value)"),
    ("study/setup.py", "SeedSequence(experiment.seed)", "SeedSequence(0)"),
    ("study/setup.py", "    weights = Weights(theta, np.full(theta.size, paper.W_INIT))",
     "    weights = Weights(theta)"),
    ("study/setup.py", "count=DECAYS[experiment.decay]", 'count=DECAYS["step"]'),
    ("study/learners.py", "            e.beta_tdc,", "            e.beta,"),
    ("study/learners.py", "gradient_expected_sarsa(nmpc, e.alpha, e.beta)",
     "gradient_expected_sarsa(nmpc, e.beta, e.alpha)"),
    ("study/provenance.py", "if value != ORIGINAL[name]",
     'if value != ORIGINAL[name] and name != "gated"'),
    ("study/provenance.py", "{room: EPOCHS[room] for", "{room: 1 for"),
    ("study/provenance.py", "versions(experiment), EPOCHS])", "versions(experiment), 0])"),
    ("study/records.py", "cost[1:][-LAST:]", "cost[-LAST:]"),
    ("study/store.py", 'if facts.get("key") != key(named):', "if False:"),
    ("study/store.py", 'if not lock.is_accepted(facts.get("sources")):', "if False:"),
    ("study/faults.py", "right - left", "left - right"),
    ("study/faults.py", "-robot().period / self.lag", "-self.lag / robot().period"),
    ("study/layouts.py", "- 2 * keep_out", "- keep_out"),
    ("study/moving.py", "outer(STAGES, now", "outer(STAGES + 1, now"),
    ("study/run.py", "done = episode.number + 1", "done = episode.number"),
    ("study/run.py", '(found["features"] ** 2).sum(axis=1)', 'abs(found["features"]).sum(axis=1)'),
    ("analysis/metrics.py", "min(LATE, max(1, len(cost) // 2))", "min(LATE, len(cost))"),
    ("analysis/metrics.py", 'episode >= run.experiment["episodes"] / 2',
     'episode > run.experiment["episodes"] / 2'),
    ("analysis/metrics.py", 'steps["value"][1:] - np.sum(', 'steps["value"][1:] + np.sum('),
    ("analysis/metrics.py", 'np.vstack([records.experiment["theta"], records.steps["theta"][:-1]])',
     'records.steps["theta"]'),
    ("analysis/summary.py", "np.sqrt(run.mean(run.wrong**2))", "np.sqrt(run.mean(run.wrong) ** 2)"),
    ("analysis/summary.py", "(overlap > low) & (overlap <= high)", "(overlap > low)"),
    ("analysis/statistics.py", "((1 - CONFIDENCE) / 2, 1 - (1 - CONFIDENCE) / 2)",
     "(1 - CONFIDENCE, 1.0)"),
    ("analysis/statistics.py", "(one < other) + 0.5 * (one == other)", "(one < other)"),
    ("analysis/statistics.py", "binomtest(gained, changed)",
     'binomtest(gained, changed, alternative="greater")'),
    ("analysis/imitation.py", "zip(inputs[~held_out], value[~held_out]", "zip(inputs, value"),
    ("analysis/encounters.py", " & ~there[:-1]", ""),
    ("analysis/trap.py", "(1 - controller.gamma) / cost", "controller.gamma / cost"),
    ("analysis/two_state.py", "(delta * PHI[:, 0])", "delta"),
    ("analysis/trajectory.py", "- clearance / 2", "- clearance"),
    ("analysis/extrapolation.py", "/ (2 * PROBE * (phi", "/ (PROBE * (phi"),
    ("analysis/suite.py", "bool(solved(each).all())", "bool(solved(each).any())"),
    ("analysis/suite.py", "MOST_SEEDS * [*names].index(place) + k\n",
     "[*names].index(place) + k\n"),
    ("claims/rule.py", "share.value >= NEARLY_ALL", "share.value > NEARLY_ALL"),
    ("claims/rule.py", "read(self.yes + self.missing, asked)", "read(self.yes, asked)"),
    ("claims/rule.py", "asked = answered + self.missing", "asked = answered"),
    ("claims/rule.py", "final_cost=full.final_cost.where(full.stopped == Stopped.FINISHED, np.inf)",
     "final_cost=full.final_cost"),
    ("claims/rule.py", " & (runs.episodes >= paper.EPISODES)", ""),
    ("claims/thresholds.py", "(ratio > DIVERGED).", "(ratio >= DIVERGED)."),
    ("claims/thresholds.py", "initial_cost).mask(was_stopped(runs), -np.inf)", "initial_cost)"),
    ("claims/thresholds.py", "float(np.max(np.linalg.norm(first",
     "float(np.mean(np.linalg.norm(first"),
    ("claims/by_runs.py", "(first > border) & (second <= border)", "(second <= border)"),
    ("claims/by_runs.py", "int((second & ~first).sum())", "int((first & ~second).sum())"),
    ("claims/timing.py", " or ratio.waited > WAITED", ""),
    ("claims/paper_claims.py", "np.maximum(path, cost)", "np.minimum(path, cost)"),
    ("claims/own_claims.py", "better = costs_less(runs, *learners)",
     "better = costs_less(runs, *learners[::-1])"),
    ("claims/assumptions.py", "faster\": a < b", "faster\": a > b"),
    ("claims/robustness.py", "(all_yes - yes, all_of - of)", "(all_yes, all_of)"),
    ("claims/failure_modes.py", "paper.GAMMA * bias / delta", "bias / delta"),
    ("claims/finding.py", "runs[THETA[-1]] >=", "runs[THETA[0]] >="),
    ("studies/reproduce.py", "- 1) > EXACT", "- 1) > 1e3 * EXACT"),
    ("studies/difficulty.py", "b[1] ** 2 / 2", "b[1] ** 2"),
    ("studies/worlds.py", "there[0] + 1 - first", "there[0] - first"),
    ("studies/worlds.py", "series[first - 1] + BACK", "series[first - 1]"),
    ("studies/shifts.py", "else order[e - 1], e", "else order[e], e"),
    ("studies/difficulty.py", "(raised.cost - first.cost) / RAISED", "raised.cost - first.cost"),
    ("studies/population.py", "(yes / of > MAJORITY", "(yes / of >= MAJORITY"),
    ("studies/population.py", "SEEDS * [*LAYOUTS]", "[*LAYOUTS]"),
    ("studies/population.py", '"found by search" if found else ""', '"found by search"'),
    ("studies/population.py", '"found by search" if', '"" if'),
    ("studies/interventions.py", "(by[than] - by[arm])", "(by[arm] - by[than])"),
    ("studies/remedies.py", "/ (there.initial - there.best)", "/ there.initial"),
    ("studies/remedies.py", "sort=False).all()", "sort=False).any()"),
    ("bench/paired.py", "float(work.sum() / reference.sum())",
     "float(np.median(work / reference))"),
    ("bench/paired.py", "ppf((1 + CONFIDENCE) / 2", "ppf(CONFIDENCE"),
    ("bench/learners.py", "(share * solving).sum() / solves.sum()", "(share * solving).mean()"),
    ("bench/solves.py", "solves[solves.warm].assign", "solves.assign"),
    ("bench/saving.py", "(2 * u * solve + self", "(u * solve + self"),
)  # fmt: skip
TESTS = {  # of a file, where they are not in the file of its name
    "control/ocp.py": "control/test_ocp.py control/test_closed_form.py",
    "control/sensitivity.py": "control/test_closed_form.py control/test_sensitivity.py",
    "learning/learners.py": "learning/test_tdc.py learning/test_learners.py",
    "learning/bootstrap.py": "learning/test_bootstrap.py learning/test_environment.py",
    "learning/training.py": "learning/test_training.py learning/test_learn.py",
    "learning/loop.py": "learning/test_episode.py",
    "study/setup.py": "study/test_setup.py study/test_experiment.py",
    "study/learners.py": "study/test_setup.py study/test_experiment.py",
    "study/run.py": "study/test_experiment.py analysis/test_trials.py",
    "analysis/metrics.py": "analysis/test_metrics.py analysis/test_summary.py",
    "claims/thresholds.py": "claims/test_claims.py claims/test_failure_modes.py",
    "claims/by_runs.py": "claims/test_claims.py",
    "claims/timing.py": "claims/test_claims.py",
    "claims/paper_claims.py": "claims/test_claims.py",
    "claims/own_claims.py": "claims/test_claims.py",
    "claims/assumptions.py": "claims/test_claims.py",
    "bench/paired.py": "bench/test_paired.py bench/test_learners.py",
}


class Mutant(NamedTuple):
    """One line with a mistake."""

    file: str
    old: str
    new: str
    tests: str


def mutants(*places: str) -> list[Mutant]:
    """Those of some packages or files, or all."""
    return [
        Mutant(file, old, new, TESTS.get(file, file.replace("/", "/test_", 1)))
        for file, old, new in MUTANTS
        if file.startswith(places or "")
    ]


def fails(project: Path, tests: str) -> bool:
    """Whether one of the fast tests in some files fails, in a process that imports nothing anew."""
    child = os.fork()
    if not child:
        code = 99
        try:
            os.chdir(project)
            os.environ["PYTHONPATH"] = sys.path[0] = str(project)
            with Path("said.txt").open("w") as said:
                os.dup2(said.fileno(), 1), os.dup2(said.fileno(), 2)
            paths = [f"tests/{one}" for one in tests.split()]
            code = import_module("pytest").main(["-xq", "-pno:cacheprovider", "-m", FAST, *paths])
        except BaseException:
            traceback.print_exc()  # into the file that the error below shows
        finally:
            os._exit(code)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code not in (0, 1, 2):  # passed, failed, or could not even import the library
        raise RuntimeError(f"pytest ends with {code}:\n{(project / 'said.txt').read_text()}")
    return code > 0


def caught(project: Path, one: Mutant) -> bool:
    """Whether the tests of a mutant fail; the project is left as it was."""
    path = project / "nmpcrl" / one.file
    text = path.read_text("utf-8")
    try:
        path.write_text(text.replace(one.old, one.new), "utf-8")
        return fails(project, one.tests)
    finally:
        path.write_text(text, "utf-8")


def copied(project: Path) -> Path:
    """A copy of the project, without what Git ignores."""
    asked = ["git", "ls-files", "-co", "--exclude-standard"]
    listed = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in listed.splitlines():
        if (ROOT / name).is_file():
            (project / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, project / name)
    return project


def main(*places: str) -> int:
    """Print a line a mutant; the number of those that survive."""
    for name in SLOW_TO_IMPORT.split():
        import_module(name)
    chosen, survived = mutants(*places), 0
    with tempfile.TemporaryDirectory() as folder:
        project = copied(Path(folder))
        for tests in {one.tests: "" for one in chosen}:
            if fails(project, tests):
                raise SystemExit(f"without a mutant:\n{(project / 'said.txt').read_text()}")
        for one in chosen:
            fell = caught(project, one)
            survived += not fell
            print("caught  " if fell else "SURVIVED", one.file, one.old.strip(), flush=True)
    print(f"{len(chosen) - survived} of {len(chosen)} mutants are caught")
    return survived


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
