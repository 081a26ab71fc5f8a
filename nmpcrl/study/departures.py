"""Where the paper is silent or contradicts itself, and how it is read here.

Each use in the code carries `# departure X`; a test holds both sides together, and the book renders
this table.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Departure:
    """One gap of the paper and its reading."""

    gap: str  # what the paper says or leaves out
    reading: str  # what is done here
    why: str  # the evidence for it, or the reason
    variant: str = ""  # how to run the other reading, where one can be run


DEPARTURES = {
    "A": Departure(
        gap="The target, x = 8.5 m, lies outside the printed state space, [-9, 3]^2.",
        reading="State space [-3, 9]^2.",
        why="One changed sign repairs everything: start and target then each lie 0.5 m inside a"
        " wall, and 11 m at 0.6 m/s take 92 of the 129 steps. With the printed box the robot parks"
        " at x = 3 m and never comes within d_t of the target.",
        variant="box = 'printed'",
    ),
    "B": Departure(
        gap="The centres of the four obstacles are nowhere given.",
        reading="Six named layouts; A, with centres (0.5, 2.2), (3, 0.5), (5.5, 2.8), (7, 0.3) m,"
        " is the default, and the others are the first that a seeded sampler drew and a screening"
        " let through, before anything was trained in them.",
        why="Every verdict is about the layouts it was measured in, and says so.",
        variant="layout",
    ),
    "C": Departure(
        gap="c_epsilon is not given, and its exponent k is the time step in Eq. (5) but the"
        " episode in Algorithm 1.",
        reading="c_epsilon = 0.99, and both readings of k in the main study: `step` (the time step"
        " counted through training, the equation as written) and `episode`.",
        why="Verdicts can differ between them: in the first, exploration is over after a few"
        " episodes; in the second, a twentieth of it is left at the end.",
        variant="decay, decay_rate",
    ),
    "D": Departure(
        gap="Table I gives N(0, 1) as the law of rho, the initial state's distribution.",
        reading="It is the law of epsilon, the exploration noise.",
        why="The initial state is said to be fixed, and Eq. (5) draws epsilon from N(0, 1).",
    ),
    "E": Departure(
        gap="The noise may carry an action out of the action space; nothing says what happens.",
        reading="The action is clipped to the action space.",
        why="No input of a robot that can do 0.6 m/s makes it do 1.6 m/s.",
        variant="clipped",
    ),
    "F": Departure(
        gap="Q(s, a) is the value of an OCP whose first input is free, so it does not depend on a.",
        reading="As written: it is V_theta(s), the value of Eq. (2).",
        why="The paper says that on-policy learning need not fix u_0 = a; but the applied action"
        " is noisy. `Nmpc.solve(state, theta, action=a)` gives the action value proper.",
        variant="constrained",
    ),
    "G": Departure(
        gap="Algorithm 1 moves theta from the first step on, but first fits the network when the"
        " buffer holds a mini-batch, 127 steps later.",
        reading="Gated: theta waits for the first fit. `gated = False` is Algorithm 1 literally.",
        why="An untrained network predicts about 0, so the TD error is about -Q, and theta_x falls"
        " from 1 to about a third within the first episode.",
        variant="gated",
    ),
    "H": Departure(
        gap="The network's activation, initialisation, normalisation, buffer and number of fits a"
        " step are not given.",
        reading="ReLU, torch's default initialisation, none, unlimited, one.",
        why="The plainest choices.",
        variant="network",
    ),
    "I": Departure(
        gap="How the baseline DES is configured is not given.",
        reading="RDES without theta in the network's input.",
        why="The only difference the paper names between the two.",
    ),
    "J": Departure(
        gap="beta = 1e-8 is smaller than alpha = 1e-7.",
        reading="As printed.",
        why="The theory of two time scales wants the opposite, w faster than theta.",
        variant="alpha, beta",
    ),
    "K": Departure(
        gap="Eq. (16) lacks the curvature term h = (delta - phi'w) (Hessian of Q) w of nonlinear"
        " TDC (Maei et al. 2009).",
        reading="As printed; its size is measured from the Hessian of Eq. (2).",
        why="Features that depend on theta have a derivative of their own.",
        variant="learner = 'TDC'",
    ),
    "L": Departure(
        gap="Where the start of a plan lies exactly on an obstacle's boundary, the derivative of"
        " the value in theta_c jumps by omega, through the slack of stage 0.",
        reading="That slack counts as active only where the constraint is violated by more than"
        " 1e-6.",
        why="Without noise the robot slides along boundaries, so this happens at many steps, and"
        " solvers return any number in between unless a side is chosen.",
        variant="ties_active",
    ),
    "M": Departure(
        gap="The state box is hard and the obstacle constraint soft; noise can push the state out"
        " of the box, where Eq. (2) may have no solution.",
        reading="The box holds for the predicted states 1, ..., N. riccati holds it by an exact"
        " penalty: where no plan can keep to the box, it returns one that leaves it least, and"
        " records by how much. A solve that fails, as CasADi's solvers do there, is tried once more"
        " from a standing start; then the episode ends, is recorded, and the next begins. Ten such"
        " episodes in a row end the run.",
        why="The paper does not say; this keeps what was learned and counts what failed.",
        variant="box = 'soft'",
    ),
    "N": Departure(
        gap="d_o = 0.35 'm' is added to an overlap that has no dimension.",
        reading="As printed.",
        why="The penalty then vanishes at a centre distance of 1.452 m, while the NMPC keeps"
        " 1.25 sqrt(1 + theta_c) m: theta_c near 0.35 removes it, which is a prediction to test.",
    ),
    "O": Departure(
        gap="Eq. (2c) runs over i = 1, ..., N, so that nothing ties x_1 to x_0 and x_{N+1} exists.",
        reading="i = 0, ..., N - 1.",
        why="A slip of the index.",
    ),
    "P": Departure(
        gap="'Diverges', 'unstable' and 'the same policy' are not defined.",
        reading="The thresholds at the top of `paper_claims.py` and the rule in `rule.py`, which"
        " were fixed before any claim was put to the study.",
        why="A verdict needs them.",
    ),
}
