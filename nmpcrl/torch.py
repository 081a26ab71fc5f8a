"""An NMPC as a layer of PyTorch: nothing else of the library imports this module.

It belongs to no room, because all of it is `control` with torch's names.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from nmpcrl.control import Nmpc


class Layer(torch.nn.Module):
    """The value, the action and the plan of an NMPC, differentiable in all that it is given.

    It has no weights of its own: theta, states and data may each come out of a network. Numbers
    are solved in double precision on the CPU, whatever they come in, and the results are of double
    precision. Second derivatives are not available.
    """

    def __init__(self, nmpc: Nmpc, threads: int | None = None) -> None:
        """Take a controller, and the number of threads as in `Nmpc.solve_many`."""
        super().__init__()
        self.nmpc, self.threads = nmpc, threads

    def forward(
        self,
        states: Tensor,
        theta: Tensor,
        data: Mapping[str, Tensor] | None = None,
        *,
        action: Tensor | None = None,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """V(s), u_0 and u_0, ..., u_{N-1} of B states; Q(s, a) where an action is given.

        Where a solve fails, all three are nan and have no gradient: `mask = value.isfinite()` says
        where they may be used, as in `(value[mask] - target[mask]).square().mean()`. Where a plan
        has no derivative, as at a point without curvature, the value alone has a gradient.

        Args:
            states: shape (B, n).
            theta: shape (B, d), or (d,) for all.
            data: by name, shape (B, N + 1, ...); (N + 1, ...) for all states, or (...) for all
                stages, too.
            action: u_0, shape (B, m), or (m,) for all; free if absent.

        Returns:
            Shapes (B,), (B, m) and (B, N, m).

        Raises:
            ValueError: a shape is another.
        """
        of, names, states = self.nmpc.problem, tuple(data or ()), _tensor(states)
        count = len(states) if states.ndim else 0
        given = [_spread("states", states, (count, of.states), 0)]
        given.append(_spread("theta", theta, (count, of.theta.size), 1))
        if action is not None:
            given.append(_spread("action", action, (count, of.inputs), 1))
        for name, one in (data or {}).items():
            given.append(_spread(name, one, (count, of.horizon + 1, *of.data_names[name]), 2))
        value, plan = _Solve.apply(self, names, *given)  # type: ignore[no-untyped-call]
        value, plan = value.to(states.device), plan.to(states.device)
        return value, plan[:, 0], plan


def _tensor(numbers: Any) -> Tensor:
    return numbers if isinstance(numbers, Tensor) else torch.as_tensor(np.array(numbers, float))


def _spread(name: str, numbers: Any, shape: tuple[int, ...], free: int) -> Tensor:
    """Numbers in this shape, in double precision; so many axes in front may be left out."""
    tensor = _tensor(numbers)
    if tuple(tensor.shape) not in [shape[k:] for k in range(free + 1)]:
        raise ValueError(f"{name} has shape {tuple(tensor.shape)}; it must be {shape}")
    return tensor.to("cpu", torch.float64).expand(shape)


class _Solve(torch.autograd.Function):
    """Value and plan, and their derivatives by `Nmpc.gradient`."""

    @staticmethod
    def forward(
        ctx: Any, layer: Layer, names: tuple[str, ...], *given: Tensor
    ) -> tuple[Tensor, ...]:
        """Solve for states, theta, actions where there are some, and data of these names."""
        arrays = [tensor.detach().numpy() for tensor in given]
        asked, data = arrays[: len(arrays) - len(names)], arrays[len(arrays) - len(names) :]
        batch = layer.nmpc.solve_many(
            asked[0],
            asked[1],
            actions=asked[2] if len(asked) > 2 else None,
            data=dict(zip(names, data, strict=True)),
            threads=layer.threads,
        )
        ctx.nmpc, ctx.batch, ctx.names, ctx.fixed = layer.nmpc, batch, names, len(asked) > 2
        return torch.tensor(batch.value), torch.tensor(batch.inputs)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, of_value: Tensor, of_plan: Tensor) -> tuple[Any, ...]:
        """One backward sweep for all states that were solved."""
        rates = ctx.nmpc.gradient(ctx.batch, of_value.numpy(), of_plan.numpy())
        given = [rates.state, rates.theta, *[rates.action] * ctx.fixed]
        found = (*given, *map(rates.data.get, ctx.names))
        return None, None, *map(torch.from_numpy, found)
