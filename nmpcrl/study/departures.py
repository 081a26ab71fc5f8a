"""Gaps and contradictions of the paper, and their readings.

Each use in the code carries `# departure X`, which a test checks, and the book renders this table.
The texts are Markdown.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Departure:
    """One gap of the paper and its reading."""

    gap: str  # in the paper
    reading: str  # of this library
    why: str  # evidence or reason
    variant: str = ""  # fields of `Experiment` for the other reading, if there are any


DEPARTURES = {
    "A": Departure(
        gap="The target, $x = 8.5$ m, lies outside the printed state space, $[-9, 3]^2$.",
        reading="State space $[-3, 9]^2$: the printed box mirrored, so that both bounds of $x$ and"
        " of $y$ change their sign.",
        why="In $x$, start and target then each lie 0.5 m inside a wall, and 11 m at 0.6 m/s take"
        " 92 of the 129 steps; in $y$, both lie inside the printed box as well. With the printed"
        " box the robot parks at $x = 3$ m and never comes within $d_t$ of the target.",
        variant="box = 'printed'",
    ),
    "B": Departure(
        gap="The centres of the four obstacles are nowhere given.",
        reading="Six named layouts. A, with centres (0.5, 2.2), (3, 0.5), (5.5, 2.8), (7, 0.3) m,"
        " is the default. The other five are the first that a seeded sampler drew and that passed"
        " a screening, before anything was trained in them.",
        why="Every verdict is about the layouts it was measured in, and says so.",
        variant="layout",
    ),
    "C": Departure(
        gap=r"$c_\varepsilon$ is not given, and its exponent $k$ is the time step in Eq. (5) but"
        " the episode in Algorithm 1.",
        reading=r"$c_\varepsilon = 0.99$, and both readings of $k$ in the main study: `step` (the"
        " time step counted through training, the equation as written) and `episode`.",
        why="Verdicts can differ between them: in the first, exploration is over after a few"
        " episodes; in the second, a twentieth of it is left at the end.",
        variant="decay, decay_rate",
    ),
    "D": Departure(
        gap=r"Table I gives $\mathcal{N}(0, 1)$ as the law of $\rho$, the initial state's"
        " distribution.",
        reading=r"It is the law of $\boldsymbol{\varepsilon}$, the exploration noise.",
        why=r"The initial state is said to be fixed, and Eq. (5) draws $\boldsymbol{\varepsilon}$"
        r" from $\mathcal{N}(0, 1)$.",
    ),
    "E": Departure(
        gap="The noise may carry an action out of the action space; nothing says what happens.",
        reading="The action is clipped to the action space.",
        why="The robot cannot apply an input beyond its bounds: its top speed is 0.6 m/s.",
        variant="clipped",
    ),
    "F": Departure(
        gap=r"$Q_{\boldsymbol{\theta}}(\mathbf{s}, \mathbf{a})$ is the value of an OCP whose first"
        r" input is free, so it does not depend on $\mathbf{a}$.",
        reading=r"As written: it is $V_{\boldsymbol{\theta}}(\mathbf{s})$, the value of Eq. (2).",
        why=r"The paper says that on-policy learning need not fix $\mathbf{u}_0 = \mathbf{a}$; but"
        " the applied action is noisy. `Nmpc.solve(state, theta, action=a)` gives the action value"
        " proper.",
        variant="constrained",
    ),
    "G": Departure(
        gap=r"Algorithm 1 moves $\boldsymbol{\theta}$ from the first step on, but fits the network"
        " for the first time when the buffer holds a mini-batch, 127 steps later.",
        reading=r"Gated: $\boldsymbol{\theta}$ waits for the first fit. `gated = False` is"
        " Algorithm 1 read literally.",
        why="An untrained network predicts about 0, so the TD error is about $-Q$, and $\\theta_x$"
        " falls from 1 to about a third within the first episode.",
        variant="gated",
    ),
    "H": Departure(
        gap="The network's activation, initialisation, normalisation, buffer and number of fits a"
        " step are not given.",
        reading="ReLU, torch's default initialisation, no normalisation, an unlimited buffer, one"
        " fit.",
        why="The plainest choices.",
        variant="network",
    ),
    "I": Departure(
        gap="How the baseline DES is configured is hardly given. The introduction calls it “a deep"
        " double Expected Sarsa (ES) RL method” and its network “a target neural network”, “trained"
        " with inputs and outputs of the primary NMPC obtained at previous sampling times”.",
        reading=r"RDES without $\boldsymbol{\theta}$ in the network's input: one network, which is"
        " fitted once a step and then asked, with the second input of the plan as the next action.",
        why="Section III-A names that input as what it adds to the earlier method. By the public"
        " abstract of [Moradimaryamnegari et al."
        " (2023)](references.md#moradimaryamnegari2023data), the MPC estimates the current value,"
        " and the network the next one, which is what is double; the network is fitted within a"
        " sampling time or in parallel to it; and the next action is the second one of the last"
        " plan or the network's minimiser, which made no significant difference. Whether its"
        " “target” network lags behind, as that word often says, is open. So four variants read it"
        " otherwise, in all layouts and both readings of the decay: a copy of the network that is"
        " refreshed once an episode (`lagged`) or follows it slowly (`averaged`, at the rate of"
        " [Fujimoto et al. (2018)](references.md#fujimoto2018addressing)), the network's minimiser"
        " as the next action (`greedy`), and a network that is one fit late (`late`).",
        variant="network = 'lagged'",
    ),
    "J": Departure(
        gap=r"$\beta = 10^{-8}$ is smaller than $\alpha = 10^{-7}$.",
        reading="As printed.",
        why=r"The theory of two time scales asks for the opposite, $\mathbf{w}$ faster than"
        r" $\boldsymbol{\theta}$.",
        variant="alpha, beta",
    ),
    "K": Departure(
        gap=r"Eq. (16) lacks the curvature term"
        r" $h = (\delta - \boldsymbol{\phi}^{\top} \mathbf{w})\,"
        r" \nabla^2_{\boldsymbol{\theta}} Q_{\boldsymbol{\theta}}\, \mathbf{w}$"
        " of nonlinear TDC (Maei et al. 2009).",
        reading="As printed; the size of the term is measured from the Hessian of Eq. (2).",
        why=r"Features that depend on $\boldsymbol{\theta}$ have a derivative of their own.",
        variant="learner = 'TDC'",
    ),
    "L": Departure(
        gap="Where the start of a plan lies exactly on an obstacle's boundary, the derivative of"
        r" the value in $\theta_c$ jumps by $\omega$, through the slack of stage 0.",
        reading="That slack counts as active only where the constraint is violated by more than"
        " $10^{-6}$.",
        why="Without noise the robot slides along boundaries, so this happens at many steps, and"
        " solvers return any number in between unless a side is chosen.",
        variant="ties_active",
    ),
    "M": Departure(
        gap="The state box is hard and the obstacle constraint soft; noise can push the state out"
        " of the box, where Eq. (2) may have no solution.",
        reading="The box holds for the predicted states $1, \\dots, N$. riccati holds it by an"
        " exact penalty: where no plan can keep to the box, it returns one that leaves it least,"
        " and records by how much. CasADi's solvers fail there; a failed solve of theirs is tried"
        " once more from a standing start, as riccati does by itself. Then the episode ends, is"
        " recorded, and the next begins. Ten such episodes in a row end the run.",
        why="The paper does not say; this keeps what was learned and counts what failed.",
        variant="box = 'soft'",
    ),
    "N": Departure(
        gap="$d_o = 0.35$ m is added to an overlap that has no dimension.",
        reading="As printed.",
        why="The penalty then vanishes at a centre distance of 1.452 m, while the NMPC keeps"
        r" $1.25 \sqrt{1 + \theta_c}$ m: $\theta_c$ near 0.35 removes it, which is a prediction to"
        " test.",
    ),
    "O": Departure(
        gap=r"Eq. (2c) runs over $i = 1, \dots, N$, so that nothing ties $\mathbf{x}_1$ to"
        r" $\mathbf{x}_0$, and $\mathbf{x}_{N+1}$ exists.",
        reading=r"$i = 0, \dots, N - 1$.",
        why="A slip of the index.",
    ),
    "P": Departure(
        gap="'Diverges', 'unstable' and 'the same policy' are not defined.",
        reading="The thresholds in `thresholds.py` and the rule in `rule.py`, which"
        " were fixed before any claim was tested.",
        why="A verdict needs them.",
    ),
    "Q": Departure(
        gap="The heading of RDES calls it 'off-policy'. Section II-C calls Expected Sarsa"
        " 'on-policy', because 'the behavioral policy is the same as the target policy', but"
        r" then attributes $\mathbf{a}$ to the behavioural policy and $\mathbf{a}^+$ to the target"
        " policy.",
        reading="One rule for all learners. The behaviour policy is"
        r" $\boldsymbol{\pi}_{\boldsymbol{\theta}}$ plus noise; the target policy, by which"
        r" $\mathbf{s}^+$ is valued, is $\boldsymbol{\pi}_{\boldsymbol{\theta}}$ without noise."
        " They are the same once the noise has decayed. RDES is neither more nor less off-policy"
        " than ES: its replay buffer trains the network alone, and $\\boldsymbol{\\theta}$ moves by"
        " the newest transition.",
        why=r"$V_{\boldsymbol{\theta}}(\mathbf{s})$ does not depend on $\mathbf{a}$"
        " ([departure F](departures.ipynb#departure-F)), so each update moves it towards what the"
        " noisy behaviour costs: on-policy learning of the noisy policy. With $Q_{\\boldsymbol"
        r"{\theta}}(\mathbf{s}, \mathbf{a})$ proper, the cost of the noise is attributed to"
        r" $\mathbf{a}$: off-policy learning of the policy without noise. In neither case does an"
        " update weigh a transition by how likely the behaviour was to make it.",
        variant="constrained",
    ),
    "R": Departure(
        gap=r"The Introduction adds $\boldsymbol{\theta}$ 'at previous time steps' to the"
        " network's training input; Section III-A adds its 'current value'.",
        reading=r"Each stored example keeps the $\boldsymbol{\theta}$ with which its value was"
        r" solved. By the time of most fits that is a $\boldsymbol{\theta}$ of a previous time"
        r" step. The prediction for $\mathbf{s}^+$ takes the current $\boldsymbol{\theta}$, as"
        " Eq. (11) has it.",
        why=r"Algorithm 1 stores $\boldsymbol{\theta}$ with each value, and a value belongs to no"
        r" other $\boldsymbol{\theta}$. Both statements then hold, one of the fit and one of the"
        r" prediction. So the network predicts for a $\boldsymbol{\theta}$ that is newer than"
        " almost all of its examples.",
    ),
}
