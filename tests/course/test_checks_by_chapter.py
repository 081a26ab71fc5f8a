"""Checks of every chapter: right answers that look different, and wrong ones that look right."""

import ast
import re
import sys
from functools import cache
from math import comb
from pathlib import Path

import nbformat
import numpy as np
import pytest
from scipy.stats import fisher_exact

from nmpcrl.course import Unsolved
from nmpcrl.course.checks import (
    beyond,
    changing_world,
    expected_sarsa,
    ges,
    mdp_and_nmpc,
    other_problems,
    performance,
    rdes,
    results,
    solver,
    what_the_paper_leaves_open,
    what_to_try_first,
    why_learning_stops,
)
from nmpcrl.course.exercises import exercises
from nmpcrl.course.variants import values
from nmpcrl.study import paper

BOOK = Path(__file__).resolve().parents[2] / "book"
CALLED = re.compile(r"check\.(\w+)")
BY_HAND = ["1.7", "2.7", "3.8", "4.8", "5.8", "6.9", "7.9", "8.8", "9.7", "10.6", "11.6"]
BY_HAND += ["12.7", "13.7"]
FEATURES = np.linspace(100.0, 1100.0, 9)
SQUARED = float(FEATURES @ FEATURES)


def by_stages(theta, states, inputs, target, gamma, later=1.0, last=1.0, factor=2.0):
    sums = np.zeros(8)
    for k, (x, u) in enumerate(zip(states[:-1], inputs, strict=True)):
        sums[:5] += (later * gamma) ** k * np.append((x - target) ** 2, u**2)
    sums[5:] = last * gamma ** len(inputs) * (states[-1] - target) ** 2
    return factor * theta[:8] * sums


def by_row(pairs, values, thetas, first):
    before = [first, *thetas][: len(pairs)]
    return [np.r_[p, t] for p, t in zip(pairs, before, strict=True)], list(values)


def foretold_by_stages(before, now, horizon):
    return np.array([[n + i * (n - b) for n, b in zip(now, before, strict=True)]
                     for i in range(horizon + 1)])  # fmt: skip


def met_by_loops(states, centres):
    pairs = zip(states, centres, strict=True)
    return sum(any(np.hypot(*(s[:2] - c)) < 1.25 for c in at) for s, at in pairs)


def undone(theta, moves, cost, forgets=False):
    least = cost(theta)
    for move in moves:
        found = cost(theta + move)
        theta = theta + move if found <= least else theta
        least = found if forgets else min(least, found)
    return theta


def curved(delta, w, theta, features, step, h=1e-4, sign=1):
    change = (features(theta + h * w) - features(theta - h * w)) / (2 * h)
    return (delta - sign * features(theta) @ w) * change


def descent(phi, phi_next, delta, gamma, sign=1):
    w, *_ = np.linalg.lstsq(phi, delta, rcond=None)
    return np.mean(
        [d * p - sign * gamma * q * (p @ w) for d, p, q in zip(delta, phi, phi_next, strict=True)],
        axis=0,
    )


def descent_by_inverse(phi, phi_next, delta, gamma):
    w = np.linalg.inv(phi.T @ phi) @ phi.T @ delta
    return ((phi - gamma * phi_next).T @ (phi @ w)) / len(delta)


def mcnemar(before, after, sides=2, most=1.0, strictly=0):
    fewer, changed = min((after > before).sum(), (after < before).sum()), (before != after).sum()
    tail = sum(comb(int(changed), k) for k in range(int(fewer) + 1 - strictly))
    return min(most, sides * tail / 2.0**changed)


def mcnemar_by_convolution(before, after):
    law = np.ones(1)
    for _ in range((before ^ after).sum()):
        law = np.convolve(law, [0.5, 0.5])
    return law[law <= law[(after & ~before).sum()] * (1 + 1e-9)].sum()


def fishers(first, second, borders):
    for border in borders:
        a, b = (first > border).sum(), (second > border).sum()
        yield fisher_exact([[a, b], [first.size - a, second.size - b]]).pvalue


def tdc(theta, w, delta, phi, phi_next, hessian, alpha, beta, gamma, sign=1, late=0):
    left = delta - w @ phi
    after = w + beta * left * phi
    u = after if late else w
    h = (delta - u @ phi) * hessian @ u
    return theta + alpha * (delta * phi - gamma * phi_next * (phi @ u) - sign * h), after


def along(features, theta, w, size=1e-5, times=2):
    return (features(theta + size * w) - features(theta - size * w)) / (times * size)


def along_unit(features, theta, w):
    length = np.linalg.norm(w)
    return length * along(features, theta, w / length) if length else np.zeros(len(w))


def unseeded(cost, start, rounds, seed):
    return searched(cost, start, rounds, None)


def searched(cost, start, rounds, seed):
    best, rng = start, np.random.default_rng(seed)
    for _ in range(rounds):
        best = min([best, *(best + 0.2 * rng.normal(size=(9, best.size)))], key=cost)
    return best


def searched_at_once(cost, start, rounds, seed):
    steps = np.random.default_rng(seed).uniform(-0.5, 0.5, (rounds, 10, start.size))
    best, least = start.copy(), cost(start)
    for theta in (best + step for some in steps for step in some):
        if (found := cost(theta)) < least:
            best, least = theta, found
    return best


def drawn_once(cost, start, rounds, seed, around="best", **size):
    """Rounds of eight steps; `size` is for another shape of them."""
    best, rng = start, np.random.default_rng(seed)
    for _ in range(rounds):
        steps = 0.3 * rng.normal(size=size.get("size", (8, best.size)))
        best = min([best, *((best if around == "best" else start) + steps)], key=cost)
    return best


def seeded_by_round(cost, start, rounds, seed):
    best = start
    for k in range(rounds):
        steps = 0.3 * np.random.default_rng([seed, k]).normal(size=(8, best.size))
        best = min([best, *(best + steps)], key=cost)
    return best


def narrowing(cost, start, rounds, seed):
    best, least, rng = start, cost(start), np.random.default_rng(seed)
    for k in range(rounds):
        for theta in best + 0.5 * 0.9**k * rng.normal(size=(8, best.size)):
            if cost(theta) < least:
                best, least = theta, cost(theta)
    return best


def of_last_round(cost, start, rounds, seed):
    last, rng = start, np.random.default_rng(seed)
    for _ in range(rounds):
        last = min(last + 0.3 * rng.normal(size=(8, last.size)), key=cost)
    return min([start, last], key=cost)


def in_turns(first, second, turns):
    return np.exp(np.median([np.log(second()) - np.log(first()) for _ in range(turns)]))


def second_first(first, second, turns):
    return 1 / np.median([1 / second() * first() for _ in range(turns)])  # the inverse twice


def sums(first, second, turns):
    times = np.array([(first(), second()) for _ in range(turns)])
    return times[:, 1].sum() / times[:, 0].sum()


def gain(A, B, Q, R, V, stages, sign=-1):
    for _ in range(stages):
        K = np.linalg.inv(R + B.T @ V @ B) @ B.T @ V @ A
        V = Q + K.T @ R @ K + (A - B @ K).T @ V @ (A - B @ K)
    return sign * K


def gain_by_schur(A, B, Q, R, V, stages):
    for _ in range(stages - 1):
        M = B.T @ V @ A
        V = Q + A.T @ V @ A - M.T @ np.linalg.solve(R + B.T @ V @ B, M)
    return np.linalg.lstsq(R + B.T @ V @ B, -B.T @ V @ A, rcond=None)[0]


def missed(gradient, jacobian, g, multipliers):
    broken = np.maximum(g, 0).sum() + np.maximum(-multipliers, 0).sum()
    return np.abs(gradient + multipliers @ jacobian).sum() + broken + abs(multipliers @ g)


def missed_by_list(gradient, jacobian, g, multipliers):
    balance = [gradient + jacobian.T @ multipliers, multipliers * g]
    return np.linalg.norm(np.concatenate([*balance, g.clip(0), multipliers.clip(None, 0)]))


def by_the_smaller(gradient, jacobian, g, multipliers):
    """Fischer and Burmeister's other form: of a multiplier and -g the smaller one is 0."""
    return np.abs(np.r_[gradient + jacobian.T @ multipliers, np.minimum(multipliers, -g)]).max()


def missed_but(balance, multipliers, g, rows=slice(None)):
    """What is right but for a balance of the gradients, or for rows that are not looked at."""
    mu, g = multipliers[rows], g[rows]
    return max(balance, g.max(), -mu.min(), np.abs(mu * g).max(), 0.0)


def stands(path, cost, value, gamma, steps=10, limit=0.05):
    way = sum(np.hypot(*step) for step in np.diff(path, axis=0)[-steps:])
    return bool(way < limit and value < cost / (1 - gamma))


def in_short_steps(path, cost, value, gamma):
    steps = np.hypot(*np.diff(path[-11:], axis=0).T)
    return bool((steps < 0.005).all() and value < cost / (1 - gamma))


def by_running_minimum(costs):
    known = np.where(np.isnan(costs), np.inf, costs)
    return (known - np.minimum.accumulate(known)).max() / known[0]


def by_loop(costs):
    lowest, rise = costs[0], 0.0
    for cost in costs:
        rise = max(rise, (np.inf if np.isnan(cost) else cost) - lowest)
        lowest = min(lowest, np.inf if np.isnan(cost) else cost)
    return rise / costs[0]


def by_merge(runs, frozen):
    both = runs.merge(frozen, on=["layout", "seed"], how="left", suffixes=("", "_frozen"))
    return both.cost / both.cost_frozen


def by_dictionary(runs, frozen):
    arm = {(row.layout, row.seed): row.cost for row in frozen.itertuples()}
    return [row.cost / arm[row.layout, row.seed] for row in runs.itertuples()]


def upside_down(runs, frozen):
    return 1 / by_merge(runs, frozen)


def letters(right, of="abcd"):
    """The right letter, typed otherwise, and all others."""
    return [right.upper(), f" {right} "], [one for one in of if one != right]


CHECKS = {
    mdp_and_nmpc.distance: ([1.38, "1,375 m"], [1.25, 1.5125, 2.75]),
    mdp_and_nmpc.scale: ([4.0, "2**2"], [2, 16, 1]),
    mdp_and_nmpc.reach: (["0.12*N", "N * 3 / 25"], ["0.6 * N", "0.12 * (N - 1)", "0.12 * (N + 1)"]),
    mdp_and_nmpc.apart: letters("c"),
    mdp_and_nmpc.penalty: (
        [
            lambda overlaps: sum(50 * max(0.0, one + 0.35) for one in overlaps),
            lambda overlaps: 50 * (overlaps[overlaps > -0.35] + 0.35).sum(),
        ],
        [
            lambda overlaps: 50 * max(0, overlaps.max() + 0.35),
            lambda overlaps: 50 * np.maximum(0, overlaps - 0.35).sum(),
            lambda overlaps: 50 * np.maximum(0, overlaps + 0.35).mean(),
            lambda overlaps: 50 * np.maximum(0, np.sort(overlaps)[-2:] + 0.35).sum(),
            lambda overlaps: 50 * np.maximum(0, np.sort(overlaps)[-3:] + 0.35).sum(),
        ],
    ),
    mdp_and_nmpc.discounted: (
        [
            lambda costs, gamma: np.polyval(costs[::-1], gamma),
            lambda costs, gamma: sum(gamma**k * cost for k, cost in enumerate(costs)),
        ],
        [
            lambda costs, gamma: np.polyval(costs, gamma),
            lambda costs, gamma: gamma * np.polyval(costs[::-1], gamma),
            lambda costs, gamma: costs.sum(),
        ],
    ),
    expected_sarsa.multiplier: ([6.0, "2 * 3"], [3, -6, 9]),
    expected_sarsa.alpha: ([f"{1 / SQUARED:.2e}", 1.005 / SQUARED], [SQUARED**-0.5, SQUARED, 1e-7]),
    expected_sarsa.solves: (["2,600", 2600.0], [260, 2340, 1430]),
    expected_sarsa.kink: letters("c"),
    expected_sarsa.weights_gradient: (
        [by_stages, lambda **case: list(by_stages(**case))],
        [
            lambda **case: by_stages(**case, factor=1.0),
            lambda **case: by_stages(**case, later=1 / case["gamma"]),
            lambda **case: by_stages(**case, last=1 / case["gamma"]),
        ],
    ),
    expected_sarsa.saved: (
        [
            lambda training, frozen: np.mean(1 - training[-20:] / frozen[-20:]),
            lambda training, frozen: (frozen - training)[-20:].sum() / frozen[-20:].sum(),
            lambda training, frozen: 1 - np.median(training[-20:] / frozen[-20:]),
        ],
        [
            lambda training, frozen: training[-20:].mean() / frozen[-20:].mean() - 1,
            lambda training, frozen: frozen[-20:].mean() / training[-20:].mean() - 1,
            lambda training, frozen: 1 - training[:20].mean() / frozen[:20].mean(),
            lambda training, frozen: 1 - training[-20:-1].mean() / frozen[-20:-1].mean(),
            lambda training, frozen: 1 - training[-19:].mean() / frozen[-19:].mean(),
            lambda training, frozen: 1 - training[-19:-1].mean() / frozen[-19:-1].mean(),
            lambda training, frozen: 1 - training[-21:].mean() / frozen[-21:].mean(),
            lambda training, frozen: 1 - np.mean(training[-21:] / frozen[-21:]),
            lambda training, frozen: 1 - training[-10:].mean() / frozen[-10:].mean(),
            lambda training, frozen: 1 - training[-20:].mean() / frozen[-40:].mean(),
        ],
    ),
    rdes.floor: ([173, "173.2"], [200, 150, 30000]),
    rdes.astray: ([0.45, "0,454"], [0.468, 0.0035, 0.0398]),
    rdes.share: (["20 %", "1/5"], [1.2, 0.1, 0.6]),
    rdes.tail: (["-L + ell", "ell + gamma * (V - L) / gamma - V"], ["L - ell", "ell", "ell - V"]),
    rdes.split: letters("c"),
    rdes.systematic: (
        [
            lambda error: (
                abs(np.nansum(error)) / np.sqrt(np.isfinite(error).sum() * np.nansum(error**2))
            ),
            lambda error: 1 / np.sqrt(1 + np.nanvar(error) / np.nanmean(error) ** 2),
        ],
        [
            lambda error: abs(np.nan_to_num(error).mean()) / np.sqrt(np.nanmean(error**2)),
            lambda error: abs(np.nanmean(error)) / np.nanstd(error),
            lambda error: np.nanmean(error) ** 2 / np.nanmean(error**2),
        ],
    ),
    rdes.examples: (
        [
            by_row,
            lambda pairs, values, thetas, first: (
                np.c_[pairs, np.r_[first[None], thetas[:-1]]],
                values,
            ),
        ],
        [
            lambda pairs, values, thetas, first: (np.c_[pairs, thetas], values),
            lambda pairs, values, thetas, first: (np.c_[pairs, np.roll(thetas, 1, 0)], values),
            lambda pairs, values, thetas, first: (np.c_[pairs[1:], thetas[:-1]], values[1:]),
        ],
    ),
    ges.factor: ([0.98, "98 %"], [1.02, -0.02, 0.94]),
    ges.ratio: ([0.8, "4/5"], [0.9, 1, -0.8]),
    ges.parallel: ([0.127, "12.7 %"], [0.1, 0.873, 7.87]),
    ges.diagnosis: letters("b"),
    ges.gtd2_step: (
        [
            lambda theta, w, phi, phi_next, alpha, gamma: (
                theta + alpha * np.outer(phi - gamma * phi_next, phi) @ w
            ),
            lambda theta, w, phi, phi_next, alpha, gamma: [
                t + alpha * (w @ phi) * (p - gamma * q)
                for t, p, q in zip(theta, phi, phi_next, strict=True)
            ],
        ],
        [
            lambda theta, w, phi, phi_next, alpha, gamma: (
                theta - alpha * (w @ phi) * (phi - gamma * phi_next)
            ),
            lambda theta, w, phi, phi_next, alpha, gamma: (
                theta + alpha * (w @ phi) * (phi - phi_next)
            ),
            lambda theta, w, phi, phi_next, alpha, gamma: (
                theta + alpha * (w @ phi_next) * (phi - gamma * phi_next)
            ),
        ],
    ),
    ges.correction: (
        [curved, lambda **case: -curved(**{**case, "w": -case["w"]}, sign=-1)],
        [
            lambda **case: -curved(**case),
            lambda **case: 2 * curved(**case),
            lambda **case: curved(**case, sign=-1),
        ],
    ),
    ges.direction: (
        [descent, descent_by_inverse],
        [
            lambda **case: -descent(**case),
            lambda **case: len(case["delta"]) * descent(**case),
            lambda **case: descent(**case, sign=-1),
        ],
    ),
    results.enough: ([np.int64(4), "4.0"], [3, 5, 8]),
    results.missing: ([2.0, "2"], [0, 5, 16]),
    results.mean: ([59 / 20, "2,95"], [1, 2, 40]),
    results.step: ([np.float32(0.831), "0,83 s"], [0.8307 / 60, 2 * 0.8307, 108.0]),
    results.fall: (["C", " c "], ["a", "b", "d"]),
    results.drawdown: (
        [by_running_minimum, by_loop],
        [
            lambda costs: by_loop(costs) * costs[0],
            lambda costs: by_loop(costs[~np.isnan(costs)]),
            lambda costs: costs.max() / costs[0] - 1,
        ],
    ),
    results.pairs: (
        [by_merge, by_dictionary],
        [
            upside_down,
            lambda runs, frozen: runs.cost / frozen.cost,
            lambda runs, frozen: by_merge(runs, frozen).sort_values(),
        ],
    ),
    what_the_paper_leaves_open.gap: (["0,25", 0.2544], [0.12, 1.2544, 4.0176]),
    what_the_paper_leaves_open.metres: ([0.64, "0,638"], [0.28, 0.35, 1.6384]),
    what_the_paper_leaves_open.fisher: (["0.0079", "2 / 252"], [0.00397, 0.0286, 0.0625]),
    what_the_paper_leaves_open.smallest: (["70 %", 0.7], [1.2, 0.3, 0.01]),
    what_the_paper_leaves_open.border: letters("b"),
    what_the_paper_leaves_open.screen: letters("c"),
    what_the_paper_leaves_open.paired: (
        [mcnemar, mcnemar_by_convolution],
        [
            lambda before, after: mcnemar(before, after, sides=1),
            lambda before, after: mcnemar(before, after, most=2.0),
            lambda before, after: mcnemar(before, after, strictly=1),
        ],
    ),
    what_the_paper_leaves_open.best: (
        [
            lambda first, second, borders: min(
                len(borders) * min(fishers(first, second, borders)), 1
            ),
            lambda first, second, borders: np.clip(
                np.array(list(fishers(first, second, borders))) * borders.size, 0, 1
            ).min(),
        ],
        [
            lambda first, second, borders: min(fishers(first, second, borders)),
            lambda first, second, borders: len(borders) * min(fishers(first, second, borders)),
            lambda first, second, borders: max(fishers(first, second, borders)),
        ],
    ),
    beyond.correction: ([0.12, "3/25"], [0.2, -0.12, 0.06]),
    beyond.fast: (["1,3e-7", 1.32e-7], [5.26e-7, 6.6e-8, 3.29e-8]),
    beyond.share: (["75 %", "3/4"], [0.25, 0.075, -0.75]),
    beyond.kappa: (
        ["1 - (1 - kappa)**2", "kappa * (2 - kappa)"],
        ["kappa", "kappa**2", "2 * kappa"],
    ),
    beyond.matched: letters("b"),
    beyond.tdc: (
        [tdc, lambda **case: list(tdc(**case))],
        [
            lambda **case: tdc(**case, sign=-1),
            lambda **case: tdc(**case, sign=0),
            lambda **case: tdc(**case, late=1),
        ],
    ),
    beyond.product: (
        [along_unit, lambda features, theta, w: list(along(features, theta, w, 2e-5))],
        [
            lambda features, theta, w: along(features, theta, w, times=1),
            lambda features, theta, w: -along(features, theta, w),
            lambda features, theta, w: along(features, theta, w, 0.3),
        ],
    ),
    beyond.search: (
        [searched, searched_at_once, drawn_once, seeded_by_round, narrowing],
        [
            unseeded,
            of_last_round,
            lambda *given: drawn_once(*given, size=(8, 1)),
            lambda *given: drawn_once(*given, around="start"),
            lambda cost, start, rounds, seed: start,
            lambda cost, start, rounds, seed: searched(cost, start, rounds, seed) + 0.1,
        ],
    ),
    solver.price: ([40.0, "80 / 2"], [80, 0, 0.5]),
    solver.golden: ([1.618, "1,62"], [1.5, 1.6, -0.618]),
    solver.dense: ([8, "2**3"], [2, 4, 6]),
    solver.exact: (["min(3, W / 2)", "3 - max(0, 3 - W/2)"], ["3", "W / 2", "max(3, W / 2)"]),
    solver.values: letters("c"),
    solver.riccati: (
        [gain, gain_by_schur],
        [
            lambda **case: gain(**case, sign=1),
            lambda **case: gain(**case | {"stages": 1}),
            lambda **case: gain(**case | {"stages": case["stages"] + 1}),
        ],
    ),
    solver.residual: (
        [missed, missed_by_list, by_the_smaller],
        [
            lambda gradient, jacobian, g, multipliers: missed_but(
                (gradient + jacobian.T @ multipliers).max(), multipliers, g
            ),
            lambda gradient, jacobian, g, multipliers: missed_but(
                -(gradient + jacobian.T @ multipliers).min(), multipliers, g
            ),
            lambda gradient, jacobian, g, multipliers: missed_but(
                abs((gradient + jacobian.T @ multipliers).sum()), multipliers, g
            ),
            lambda gradient, jacobian, g, multipliers: missed_but(
                abs((gradient + jacobian.T @ multipliers)[0]), multipliers, g
            ),
            lambda gradient, jacobian, g, multipliers: missed_but(
                np.abs(gradient + jacobian.T @ multipliers).max(), multipliers, g, [0, 2]
            ),
            lambda gradient, jacobian, g, multipliers: np.abs(
                gradient + jacobian.T @ multipliers
            ).max(),
            lambda gradient, jacobian, g, multipliers: missed(
                gradient, jacobian, g.clip(0), multipliers
            ),
            lambda gradient, jacobian, g, multipliers: missed(-gradient, jacobian, g, multipliers),
        ],
    ),
    other_problems.moved: ([0.1, "0.05 * 2"], [0.4, 2, 0.05]),
    other_problems.factor: ([1.17, "10 ** 0.07"], [0.07, 1e5, 1.07]),
    other_problems.single: letters("c"),
    other_problems.gain: (
        [other_problems.riccati_step, lambda **case: [*other_problems.riccati_step(**case)]],
        [
            lambda **case: other_problems.riccati_step(**case | {"gamma": 1.0}),
            lambda **case: other_problems.riccati_step(**case, sign=1.0),
            lambda **case: other_problems.riccati_step(**case)[::-1],
        ],
    ),
    other_problems.newton: (
        [
            other_problems.batch_step,
            lambda **case: other_problems.batch_step(**case) + np.zeros(4),
        ],
        [
            lambda **case: other_problems.batch_step(**case | {"alpha": -case["alpha"]}),
            lambda **case: other_problems.batch_step(
                **case | {"ridge": case["ridge"] / len(case["deltas"])}
            ),
            lambda **case: case["theta"],
        ],
    ),
    what_to_try_first.guarded: ([0.125, "1 / 8"], [8, 0.25, 1]),
    what_to_try_first.middle: ([0.575, "2.3 / 4"], [-3.5, 0.65, 0.517]),
    what_to_try_first.advised: letters("c"),
    what_to_try_first.tdrc: (
        [
            what_to_try_first.tdrc_step,
            lambda **case: [*what_to_try_first.tdrc_step(**case)],
        ],
        [
            lambda **case: what_to_try_first.tdrc_step(**case | {"kappa": -case["kappa"]}),
            lambda **case: what_to_try_first.tdrc_step(**case | {"gamma": 1.0}),
            lambda **case: what_to_try_first.tdrc_step(**case)[::-1],
        ],
    ),
    what_to_try_first.undone: (
        [what_to_try_first.kept, undone],
        [
            lambda theta, moves, cost: undone(theta, moves, cost, forgets=True),
            lambda theta, moves, cost: theta + sum(moves),
            lambda theta, moves, cost: min([theta, *(theta + moves)], key=cost),
        ],
    ),
    why_learning_stops.standing: ([9, "54 - 0.03 * 1500"], [54, 1800, -9]),
    why_learning_stops.growth: ([0.0144, "100 * 1e-7 * 12 * 120"], [0.000144, 0.0012, 1.2e-4]),
    why_learning_stops.evidence: letters("c"),
    why_learning_stops.left: (
        ["1 - step * (1 - f)", "1 - step + step * f"],
        ["1 - step", "1 - step * (1 + f)", "1 - step * f"],
    ),
    why_learning_stops.trapped: (
        [
            why_learning_stops.in_trap,
            stands,
            lambda **case: np.bool_(why_learning_stops.in_trap(**case)),
        ],
        [
            why_learning_stops.ends_only,
            in_short_steps,
            lambda **case: stands(**case, steps=9),
            lambda **case: stands(**case, limit=0.1),
            lambda **case: stands(**case, limit=0.01),
            lambda **case: why_learning_stops.in_trap(**case, steps=11),
            lambda **case: not why_learning_stops.in_trap(**case),
        ],
    ),
    why_learning_stops.feedback: (
        [
            why_learning_stops.fed_back,
            lambda **case: why_learning_stops.fed_back(**case, probe=1e-6),
        ],
        [
            lambda **case: why_learning_stops.fed_back(**case) * np.linalg.norm(case["phi"]),
            lambda **case: why_learning_stops.fed_back(**case | {"gamma": 1.0}),
            lambda **case: -why_learning_stops.fed_back(**case),
        ],
    ),
    changing_world.ahead: (["1.0 + 10 * 0.2", "3 m"], [1.2, -1.0, 2.8]),
    changing_world.lag: (["N * T * v", "v * (N * T)"], ["T * v", "N * v", "(N + 1) * T * v"]),
    changing_world.clocked: ([-26.4, "20 + 0.97 * 880 - 900"], [2.7, 0, 26.4]),
    changing_world.blind: letters("b"),
    changing_world.predictor: (
        [changing_world.foretold, foretold_by_stages],
        [
            lambda before, now, horizon: changing_world.foretold(before, now, horizon)[1:],
            lambda before, now, horizon: changing_world.foretold(now, now, horizon),
            lambda before, now, horizon: changing_world.foretold(now, before, horizon),
        ],
    ),
    changing_world.inside: (
        [changing_world.met, met_by_loops],
        [
            changing_world.met_twice,
            lambda states, centres: changing_world.met(states, centres, 2.5),
            lambda states, centres: len(states) - changing_world.met(states, centres),
        ],
    ),
    performance.ratio: (
        ["0.5 / (r - 0.5)", "-1 / (1 - 2 * r)"],
        ["2 * r - 1", "1 / r", "1 / (2 * r)"],
    ),
    performance.faster: (["90 %", 0.9], [0.7, 0.35, 0.6]),
    performance.amdahl: ([3.6, "1 / 0.28"], [8, 10, 0.28]),
    performance.warm: letters("a"),
    performance.compare: (
        [in_turns, second_first],
        [
            sums,
            lambda first, second, turns: 1 / in_turns(first, second, turns),
            lambda first, second, turns: 1.0,
        ],
    ),
    performance.speed_up: (
        [
            lambda old, new: np.median(old) / np.median(new),
            lambda old, new: np.prod(old / new) ** (1 / len(old)),
            lambda old, new: np.median(old / new),
            lambda old, new: old.sum() / new.sum(),
        ],
        [
            lambda old, new: (old / new).mean(),
            lambda old, new: 1 / (new / old).mean(),
            lambda old, new: np.median(old - new),
            lambda old, new: old[0] / new[0],
            lambda old, new: old[:2].sum() / new[:2].sum(),
            lambda old, new: old.max() / new.max(),
            lambda old, new: old.min() / new.min(),
        ],
    ),
}


@cache
def known(check) -> list:
    """What a check is given besides the answer."""
    if check is expected_sarsa.alpha:
        return [FEATURES]
    nmpc = (mdp_and_nmpc.scale, expected_sarsa.weights_gradient, solver.dense)
    return [paper.nmpc()] if check in nmpc else []


def named(check) -> str:
    return f"{check.__module__.rsplit('.', 1)[1]}.{check.__name__}"


@pytest.mark.parametrize("check", CHECKS, ids=named)
def test_right_answers_are_right_and_wrong_ones_are_met_with_a_sentence(check):
    right, wrong = CHECKS[check]
    for _ in range(2):
        for answer in right:
            assert check.__wrapped__(answer, *known(check)).right, answer
        for answer in wrong:
            with pytest.raises(Unsolved, match=r"\w+ .*[.?]"):
                check.__wrapped__(answer, *known(check))


@cache
def texts() -> dict[str, str]:
    """What each exercise asks, by the name of its check, or by its number if it has none."""
    found = {}
    for path in BOOK.glob("*.ipynb"):
        notebook = nbformat.read(path, 4)
        source = "\n".join(cell.source for cell in notebook.cells)
        module = re.search(r"from nmpcrl\.course\.checks import (\w+) as check", source)
        for one in exercises(notebook):
            calls = [CALLED.search(cell.source)[1] for cell in one.parts["check"]]
            found[f"{module[1]}.{calls[0]}" if calls else one.number] = one.text.source
    return found


PRECISION = re.compile(r"\b(two|three|four) digits( after the point)?|to the centimetre")
DIGITS = {"two": 2, "three": 3, "four": 4}


def rounded(number: float, text: str) -> float:
    """A number as a text asks for it; as it is if that says nothing, or something in percent."""
    found = PRECISION.search(text)
    if not found:
        return number
    digits = DIGITS.get(found[1], 2)
    return float(f"{number:.{digits}g}") if found[1] and not found[2] else round(number, digits)


def exactly(number: float) -> bool:
    """Whether a number has four digits or fewer."""
    return number == pytest.approx(float(f"{number:.4g}"), rel=1e-9, abs=1e-12)


def drawn(check) -> list[dict]:
    """The number that a question prints, by the name of its argument, and those that may be."""
    numbers = getattr(check, "varied", {}).items()
    more = [{name: ast.literal_eval(one)} for name, within in numbers for one in values(within)]
    return [{}, *more]


def asked(check, monkeypatch, **number) -> tuple[float, dict[float, str]]:
    """The right number of a check and the wrong ones that it knows."""
    heard, module = [], sys.modules[check.__module__]
    said = module.number

    def hears(answer, expected, **more):
        heard.append((float(expected), more.get("mistakes", {})))
        return said(answer, expected, **more)

    with monkeypatch.context() as patched:
        patched.setattr(module, "number", hears)
        check(0.0, *known(check), **number)
    return heard[0]


NUMERIC = [check for check in CHECKS if "number" in check.__wrapped__.__code__.co_names]
VARIED = [check for check in CHECKS if hasattr(check, "varied")]


@pytest.mark.parametrize("check", NUMERIC, ids=named)
def test_of_every_number_that_may_be_asked_the_right_one_as_it_is_asked_for_is_right_and_no_mistake(
    check, monkeypatch
):
    text = texts()[named(check)]
    for number in drawn(check):
        expected, mistakes = asked(check, monkeypatch, **number)
        right = rounded(expected, text)
        assert check.__wrapped__(right, *known(check), **number).right, (number, right)
        assert re.search(f"{PRECISION.pattern}|within", text) or exactly(expected), number
        alike = {}  # sentences by what is typed
        for wrong, why in mistakes.items():
            alike.setdefault(rounded(wrong, text), set()).add(why)
        for wrong in mistakes:
            typed = rounded(wrong, text)
            assert typed != right, (number, typed)
            for one in (wrong, typed):
                with pytest.raises(Unsolved) as refused:
                    check.__wrapped__(one, *known(check), **number)
                said = str(refused.value)
                assert said in alike[typed] or (one != wrong and "is not right" in said), number


@pytest.mark.parametrize("check", NUMERIC, ids=named)
def test_a_number_is_accepted_within_half_a_unit_of_the_digit_that_is_asked_for(check, monkeypatch):
    found = PRECISION.search(texts()[named(check)])
    for number in drawn(check) if found else ():
        expected, _ = asked(check, monkeypatch, **number)
        digits = DIGITS.get(found[1], 2)
        if found[1] and not found[2]:
            digits -= int(f"{expected:e}".partition("e")[2]) + 1
        for half in (-0.5, 0.5):
            one = expected + half * 10.0**-digits
            assert check.__wrapped__(one, *known(check), **number).right, (number, one)


def test_the_numbers_that_may_be_asked_are_those_of_the_exercises_that_count():
    assert len(NUMERIC) > 20
    assert len(VARIED) == 24
    assert [named(check) for check in VARIED if check not in NUMERIC] == [
        "expected_sarsa.saved",
        "solver.exact",
    ]


def test_of_every_edge_the_formula_is_right_and_its_parts_are_not():
    for number in drawn(solver.exact):
        edge = number.get("edge", 3)
        assert solver.exact.__wrapped__(f"min({edge}, W / 2)", **number).right
        for wrong in (f"{edge}", "W / 2", f"max({edge}, W / 2)", f"max({edge} - W / 2, 0)"):
            with pytest.raises(Unsolved):
                solver.exact.__wrapped__(wrong, **number)


def saved_in(first, last=None):
    return lambda training, frozen: 1 - training[first:last].mean() / frozen[first:last].mean()


def test_of_every_number_of_late_episodes_these_are_right_and_no_one_more_or_less():
    check = expected_sarsa.saved.__wrapped__
    for number in drawn(expected_sarsa.saved):
        late = number.get("late", 20)
        for right in (
            saved_in(-late),
            lambda training, frozen, late=late: 1 - (training / frozen)[-late:].mean(),
            lambda training, frozen, late=late: 1 - np.median((training / frozen)[-late:]),
        ):
            assert check(right, **number).right
        for wrong in ((-late, -1), (-late + 1, None), (-late + 1, -1), (-late - 1, None)):
            with pytest.raises(Unsolved):
                check(saved_in(*wrong), **number)


def test_the_growth_of_theta_c_is_asked_with_all_its_factors():
    text = texts()["why_learning_stops.growth"]
    for factor in (r"\delta = 12$", r"\phi_c = 120$", r"\alpha = 10^{-7}$", "100 steps"):
        assert factor in text
    assert why_learning_stops.growth.__wrapped__(100 * 1e-7 * 12 * 120).right


def test_every_exercise_is_tried_here_or_marked_by_hand():
    assert set(texts()) == {named(check) for check in CHECKS} | set(BY_HAND)
    assert len(texts()) == 97
    assert all(len(right) >= 2 and len(wrong) >= 3 for right, wrong in CHECKS.values())
