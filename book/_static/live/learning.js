// Algorithm 1 in this page, as nmpcrl/learning/training.py has it, on the compiled solver and update rules.
//
// `settings`: { learner, alpha, beta, zeta, decay, decayRate, seed, episodes, steps, theta, w, thetaSet,
// evaluateEvery, start, target, discs, horizon, limits: { absurd, patience }, network: { hidden, batch } }; `noise` holds epsilon, shape (episodes, steps, m).
(function learning() {
  "use strict";

  // ---- Where the value of the next state comes from: { value, features, warm }, of which `warm` is what the next
  // solve starts from, and `value` null if there is nothing to go by yet; null where a solve failed

  const secondSolve = (nmpc) => ({ here, solution, next }) => {
    const solved = nmpc.solve({ ...here, state: next }, { warm: solution });
    return solved && { value: solved.value, features: solved.features, warm: solved };
  };

  // A network imitates the NMPC's value: remember, fit, predict.
  const imitation = (withTheta) => ({ problem, wasm }, { seed, zeta, episodes, steps, network: sizes }) => {
    const { network, generator } = self.nmpcrl;
    const inputs = problem.target.length + problem.lower.length + (withTheta ? problem.theta : 0);
    const all = { inputs, ...sizes, capacity: episodes * steps, rate: zeta };
    const imitator = network(wasm, all, generator(seed));
    const input = (state, action, theta) => [...state, ...action, ...(withTheta ? theta : [])];
    return ({ here: { state, theta }, action, solution, next }) => {
      imitator.remember(input(state, action, theta), solution.value);
      if (!imitator.ready()) return { value: null, warm: solution };
      imitator.fit();
      return { value: imitator.predict(input(next, solution.nextAction, theta)), warm: solution };
    };
  };

  // ---- The learners: a rule takes { theta, w }, delta, the solution in s and what is known of s+

  const semiGradient = ({ rules }, { alpha }) => ({ theta, w }, delta, { features }) => ({
    theta: rules.semiGradient(theta, delta, features, alpha), w,
  });

  const gradientTd = ({ rules, problem }, { alpha, beta }) => ({ theta, w }, delta, solution, successor) => ({
    theta: rules.gradientTd(
      theta, w, delta, solution.features, successor.features, alpha, problem.discount[1],
    ),
    w: rules.auxiliary(w, delta, solution.features, beta),
  });

  function exactGradientTd(nmpc, settings) {
    const printed = gradientTd(nmpc, settings), { rules } = nmpc, { alpha, thetaSet } = settings;
    return (weights, delta, solution, successor, given) => {
      const { theta, w } = printed(weights, delta, solution, successor);
      const product = nmpc.hessianTimes(given, solution, weights.w);
      if (!product) return null; // no strict minimum: Python then uses dense algebra
      const h = rules.curvature(delta, solution.features, weights.w, product);
      return { theta: rules.project(theta.map((each, k) => each - alpha * h[k]), ...thetaSet), w };
    };
  }

  const LEARNERS = {
    ES: { rule: semiGradient },
    DES: { rule: semiGradient, bootstrap: imitation(false) },
    RDES: { rule: semiGradient, bootstrap: imitation(true) },
    GES: { rule: gradientTd },
    TDC: { rule: exactGradientTd },
    QL: { rule: semiGradient, constrained: true },
    frozen: { rule: null }, // values no successor
  };

  // ---- Exploration

  const COUNTS = { step: (episode, t, steps) => episode * steps + t, episode: (episode) => episode };

  // Noise that decays is added to the policy, and what leaves the action space is clipped.
  function explorer({ problem: { lower, upper } }, { decay, decayRate, steps }, noise) {
    const m = lower.length, count = COUNTS[decay];
    return (policy, episode, t) => {
      const scale = decayRate ** count(episode, t, steps), at = (episode * steps + t) * m;
      return policy.map((u, i) => Math.min(Math.max(u + scale * noise[at + i], lower[i]), upper[i]));
    };
  }

  // ---- Training

  const squared = (vector) => vector.reduce((sum, each) => sum + each * each, 0);
  const absurd = ({ theta, w }, limits) => ![...theta, ...w].every((each) => Math.abs(each) <= limits.absurd);

  function learnerOf(nmpc, settings) {
    const { rule, bootstrap = secondSolve, constrained = false } = LEARNERS[settings.learner];
    return { move: rule?.(nmpc, settings), valued: bootstrap(nmpc, settings), constrained };
  }

  // The steps of one episode; the last one says so if a solve failed.
  function* steps(nmpc, settings, { move, valued, constrained }, explore, episode, weights) {
    const gamma = nmpc.problem.discount[1];
    const given = { discs: settings.discs, target: settings.target, horizon: settings.horizon };
    let state = settings.start, warm = null;
    for (let time = 0; time < settings.steps; time++) {
      const here = { ...given, state, theta: weights.theta };
      const step = {
        episode, time, state, ...weights,
        action: null, cost: NaN, value: NaN, features: null, nextValue: NaN, delta: NaN, phi2: NaN,
      };
      const plan = nmpc.solve(here, { warm });
      if (!plan) return yield { ...step, failed: true };
      step.action = explore(plan.action, episode, time);
      step.cost = nmpc.cost(given, state, step.action);
      state = nmpc.step(state, step.action);
      const solution = constrained ? nmpc.solve(here, { warm: plan, action: step.action }) : plan;
      if (!solution) return yield { ...step, failed: true };
      step.value = solution.value;
      step.features = solution.features;
      step.phi2 = squared(solution.features);
      warm = solution;
      if (move) {
        const successor = valued({ here, action: step.action, solution, next: state });
        if (!successor) return yield { ...step, failed: true };
        ({ warm } = successor);
        if (successor.value !== null) {
          step.nextValue = successor.value;
          step.delta = nmpc.rules.tdError(step.cost, gamma, solution.value, successor.value);
          const moved = move(weights, step.delta, solution, successor, here);
          if (!moved) return yield { ...step, failed: true };
          weights = moved;
        }
      }
      yield { ...step, ...weights, failed: false };
    }
  }

  // Algorithm 1, step by step: { episode, time, state, action, cost, value, features, nextValue, delta, phi2, theta,
  // w, failed, diverged }, theta and w after the step. What is diverged is the last.
  function* train(nmpc, settings, noise) {
    const explore = explorer(nmpc, settings, noise), learner = learnerOf(nmpc, settings), { limits } = settings;
    let weights = { theta: settings.theta, w: settings.w }, failures = 0;
    for (let episode = 0; episode < settings.episodes; episode++) {
      let failed = false;
      for (const step of steps(nmpc, settings, learner, explore, episode, weights)) {
        ({ failed } = step);
        weights = { theta: step.theta, w: step.w };
        const diverged = absurd(weights, limits) || (failed && failures + 1 === limits.patience);
        yield { ...step, diverged };
        if (diverged) return;
      }
      failures = failed ? failures + 1 : 0;
    }
  }

  // What a policy does without noise: (theta) => { cost, states, value, discounted }, the value and the discounted cost of the start.
  const judgeOf = (nmpc, { start, target, discs, horizon, steps: count }) => (theta) => {
    const { states, cost, discounted, plan, failed } = nmpc.rollout({ start, target, discs, horizon, theta }, count);
    const end = failed ? { cost: Infinity, discounted: Infinity } : { cost, discounted };
    return { ...end, states, value: plan?.value ?? NaN };
  };

  // The account of a run, as nmpcrl/study/run.py has it, fed step by step: what the episode did so far.
  // { episode, cost, delta (root mean square), alphaPhi2 (the largest), theta, diverged, ended, judged or null }
  function account(settings, judge) {
    const { alpha, episodes, evaluateEvery, limits } = settings;
    let cost = 0, phi2 = 0, squares = 0, count = 0;
    return (step) => {
      const { theta, diverged } = step, episode = step.episode + 1;
      cost += step.cost;
      phi2 = Math.max(phi2, step.phi2 || 0);
      if (Number.isFinite(step.delta)) {
        squares += step.delta ** 2;
        count += 1;
      }
      const row = { episode, cost, delta: Math.sqrt(squares / count), alphaPhi2: alpha * phi2, theta, diverged };
      const ended = step.failed || diverged || step.time === settings.steps - 1;
      const due = ended && (episode % evaluateEvery === 0 || episode === episodes);
      if (ended) cost = phi2 = squares = count = 0;
      return { ...row, ended, judged: due && !absurd(step, limits) ? judge(theta) : null };
    };
  }

  // A run: the account of each episode, and before them what theta does at first.
  function* run(nmpc, settings, noise) {
    const judge = judgeOf(nmpc, settings), accounted = account(settings, judge), { theta } = settings;
    yield { episode: 0, cost: NaN, delta: NaN, alphaPhi2: NaN, theta, diverged: false, judged: judge(theta) };
    for (const step of train(nmpc, settings, noise)) {
      const row = accounted(step);
      if (row.ended) yield row;
    }
  }

  // As nmpcrl/study/records.py has it: the mean of the last rollouts, of which theta's first is never one.
  function finalCost(costs, last) {
    const learned = costs.slice(1).slice(-last);
    return learned.length ? learned.reduce((sum, each) => sum + each, 0) / learned.length : Infinity;
  }

  self.nmpcrl = {
    ...self.nmpcrl, train, run, account, judgeOf, finalCost, sources: [...(self.nmpcrl?.sources ?? []), learning],
  };
})();
