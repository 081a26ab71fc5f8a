"""What numba makes of CasADi's expressions equals CasADi, for every operation and every layout."""

from itertools import product

import casadi as ca
import numpy as np
import pytest

from nmpcrl.control import Hard, Obstacle, Problem, Soft, Task, differential_drive
from nmpcrl.control.codegen.jit import callable_of, compiled, load
from nmpcrl.control.codegen.source import BINARY, INNER, UNARY, CannotCompile, source
from nmpcrl.control.solvers.stages import MATRICES, functions, write

SPECIAL = [0.0, 1.0, -1.0, 0.5, -0.5, 2.0, -3.5, 7.0, 1e-300, 1e19, -1e19, 1e300]
NUMBERS = [*SPECIAL, np.inf, -np.inf, np.nan, *np.random.default_rng(0).normal(scale=3, size=25)]
x, y, many = ca.SX.sym("x"), ca.SX.sym("y"), ca.SX.sym("many", 2)


def same(found, exact, of=""):
    np.testing.assert_allclose(found, exact, rtol=2e-15, atol=0, err_msg=of)  # nan equals nan


@pytest.mark.parametrize(
    ("of", "results"),
    [
        ([x], [ca.SX.unary(code, x) for code in UNARY]),
        ([x, y], [ca.SX.binary(code, x, y) for code in BINARY]),
    ],
    ids=["unary", "binary"],
)
def test_every_operation_is_casadis(of, results):
    function = ca.Function("operations", of, [ca.vertcat(*results)])
    code = callable_of(function)
    for given in product(NUMBERS, repeat=len(of)):
        same(code(*([number] for number in given)), function(*given).full().ravel(), str(given))


@pytest.mark.parametrize(
    ("function", "reason"),
    [
        (ca.Function("f", [x], [ca.erfinv(x)]), "f holds CasADi's OP_ERFINV, which is not known"),
        (ca.Function("f", [ca.MX.sym("z")], [ca.MX(1)]), "f is not an SX function"),
    ],
)
def test_what_is_not_known_is_named(function, reason):
    with pytest.raises(CannotCompile, match=reason):
        source(function)


def test_matrices_vectors_scalars_zeros_and_sparse_arguments_are_laid_out_right():
    a, b = ca.SX.sym("a", 3), ca.SX.sym("b", 2, 3)
    results = {
        "matrix": b @ ca.diag(a),
        "vector": b @ a,
        "scalar": ca.dot(a, a),
        "sparse": ca.diag(a),
        "zeros": ca.SX(2, 2),
        "constant": ca.SX([1.5, -np.inf, 3]),
    }
    function = ca.Function("layout", [a, b], [*results.values()], ["a", "b"], [*results])
    rng = np.random.default_rng(1)
    one, other = rng.normal(size=3), rng.normal(size=(2, 3))
    shapes = [r.shape if r.shape[1] > 1 else (r.shape[0],) for r in results.values()]
    out = [np.full(shape, np.nan) for shape in shapes]
    compiled(function)(one, other, *out)
    for found, exact in zip(out, function(one, other), strict=True):
        same(found, exact.full().reshape(found.shape))
    lower = ca.SX.sym("z", ca.Sparsity.lower(2))
    function = ca.Function("corner", [lower], [2 * lower[1, 1]], ["z"], ["r"])
    assert compiled(function, returned=True)(np.array([[1.0, 0.0], [3.0, 4.0]])) == 8.0
    assert callable_of(ca.Function("product", [x, y], [x * y]), scalar=True)([3], [4]) == 12.0


@pytest.fixture(params=["robot", "mass"])
def problem(request):
    """The robot among two obstacles in a box, and a mass with rows of its own."""
    if request.param == "robot":
        task = Task(start=np.zeros(3), target=np.ones(3), lower=-np.ones(3), upper=np.ones(3),
                    obstacles=(Obstacle(0.5, 2.2), Obstacle(3.0, 0.5)))  # fmt: skip
        return task.problem(differential_drive(), 3, 0.97, 100.0)
    return Problem(
        states=4, inputs=2, horizon=3, theta={"gain": np.ones(2)},
        model=lambda x, u, th: x + 0.1 * ca.vertcat(x[2:], u * th["gain"]),
        stage=lambda x, u, th: th["gain"][0] * ca.sumsqr(x) + u[0] ** 4,
        soft=Soft(lambda x, u, th: ca.vertcat(x[0] * u[1] * th["gain"], x[2] ** 2), weight=10.0),
        hard=Hard(lambda x, u, th: x[1] - th["gain"][1]),
    )  # fmt: skip


@pytest.mark.slow
def test_the_compiled_stages_are_casadis(problem):
    called = write(problem).replace(INNER, '@njit(error_model="numpy", cache=True)\n')
    package = load("stages", {"__init__": "from . import model\n", "model": called})
    module, rng = package.model, np.random.default_rng(2)
    assert (problem.states, problem.inputs) == (module.NX, module.NU)
    for function in functions(problem):
        matrix = [name in MATRICES for name in function.name_in()]
        shapes = [function.size_in(i) if m else function.size1_in(i) for i, m in enumerate(matrix)]
        arguments = [rng.uniform(0.1, 1.0, size=shape) for shape in shapes]
        exact = [r.full() for r in function.call([ca.DM(a) for a in arguments])]
        code, names = getattr(module, function.name()), function.name_out()
        if names == ["cost"]:
            assert code(*arguments) == pytest.approx(exact[0].item(), rel=1e-14)
            continue
        out = [np.zeros(r.shape if name in MATRICES else r.shape[0])
               for r, name in zip(exact, names, strict=True)]  # fmt: skip
        begins = [0] * (code.py_func.__code__.co_argcount - len(arguments) - len(out))
        code(*arguments, *out, *begins)
        for found, right in zip(out, exact, strict=True):
            np.testing.assert_allclose(found, right.reshape(found.shape), rtol=1e-13, atol=1e-14)
