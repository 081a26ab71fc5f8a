"""`lqr` as csnlp has it: a peer, and an oracle that shares no code."""

from csnlp import Nlp
from csnlp.wrappers import Mpc

from nmpcrl.study.problems import gros_zanon_csnlp as peer
from nmpcrl.study.problems import lqr


def mpc(solver: str) -> Mpc:
    """The plan in csnlp, by multiple shooting.

    Args:
        solver: a name in `gros_zanon_csnlp.SOLVERS`.
    """
    plan = Mpc(Nlp("SX"), lqr.HORIZON)
    th = peer.symbols(plan, lqr.problem())
    x, _ = plan.state("x", 2, bound_initial=False)
    u, _ = plan.action("u", 1)
    plan.set_affine_dynamics(th["A"], th["B"])
    objective = th["V0"] + lqr.GAMMA**lqr.HORIZON * (x[:, -1].T @ th["P"] @ x[:, -1])
    for i in range(lqr.HORIZON):
        stage = x[:, i].T @ th["Q"] @ x[:, i] + u[:, i].T @ th["R"] @ u[:, i]
        objective += lqr.GAMMA**i * stage
    plan.minimize(objective)
    peer.give_solver(plan, solver)
    return plan
