// Algorithm 1 in this page: nmpcrl/learning/loop.py makes each step, compiled with the solver.
//
// `settings`: { learner, alpha, beta, zeta, decay, decayRate, seed, episodes, steps, theta, w, thetaSet,
// evaluateEvery, start, target, discs, horizon, limits: { absurd, far, patience }, network: { hidden, batch } }; `noise` holds epsilon, shape (episodes, steps, m).
(function learning() {
  "use strict";

  // ---- The learners, in the numbers of loop.py

  const [SEMI_GRADIENT, GRADIENT_TD, EXACT] = [0, 1, 2]; // how theta moves
  const [NOTHING, SECOND_SOLVE, NETWORK] = [0, 1, 2]; // what values the next state
  const LEARNERS = {
    ES: { rule: SEMI_GRADIENT, bootstrap: SECOND_SOLVE },
    DES: { rule: SEMI_GRADIENT, bootstrap: NETWORK },
    RDES: { rule: SEMI_GRADIENT, bootstrap: NETWORK, withTheta: true },
    GES: { rule: GRADIENT_TD, bootstrap: SECOND_SOLVE },
    TDC: { rule: EXACT, bootstrap: SECOND_SOLVE },
    QL: { rule: SEMI_GRADIENT, bootstrap: SECOND_SOLVE, constrained: true },
    frozen: { rule: SEMI_GRADIENT, bootstrap: NOTHING },
  };
  // What a row begins with; state, action, features, theta and w follow.
  const NUMBERS = ["cost", "value", "nextValue", "delta", "loss", "restarts", "violation", "iterations", "solves"];

  const begins = new WeakMap(); // where the arrays of a module's run lie

  // The run of a learner in the memory of `nmpc`, where it replaces the run before it.
  function runIn(nmpc, settings) {
    const { wasm, problem } = nmpc, { theta: first, w: firstW, limits, target, discs, horizon } = settings;
    const { rule, bootstrap, withTheta = false, constrained = false } = LEARNERS[settings.learner];
    if (begins.has(wasm)) wasm.release(begins.get(wasm));
    begins.set(wasm, wasm.reserve(0));
    const filled = (Kind, numbers) => {
      const room = new Kind(wasm.memory.buffer, wasm.reserve(numbers.length * Kind.BYTES_PER_ELEMENT), numbers.length);
      room.set(numbers);
      return room;
    };
    const numbers = (values) => filled(Float64Array, values), zeros = (length) => numbers(new Float64Array(length));
    const n = settings.start.length, m = problem.lower.length, d = first.length;
    const [least, most] = rule === EXACT ? settings.thetaSet : [-Infinity, Infinity];
    const how = numbers([
      rule, settings.alpha, settings.beta, bootstrap, withTheta, constrained, problem.tolerance, limits.far,
      limits.absurd, ...first.map(() => least), ...first.map(() => most),
    ]);
    const none = zeros(4).byteOffset; // of a learner without a network
    const net = bootstrap !== NETWORK ? [...Array(6).fill(none), 0, none, 0, 0] : self.nmpcrl.network(filled, {
      ...settings.network, inputs: n + m + (withTheta ? d : 0), rate: settings.zeta,
      capacity: settings.episodes * settings.steps,
    }, self.nmpcrl.generator(settings.seed));
    const given = { target, discs, horizon }, problemAt = () => nmpc.at(given);
    problemAt();
    const state = zeros(n), theta = numbers(first), w = numbers(firstW), warm = zeros(nmpc.planLength());
    const noise = zeros(m), row = zeros(NUMBERS.length + n + m + 3 * d);
    const [learner, ...places] = [how, state, theta, w, warm].map(({ byteOffset }) => byteOffset);

    // The next step, the first of an episode in the state that it begins in: what the row holds, or { failed: true }.
    function step(begin, scaled) {
      if (begin) state.set(begin);
      noise.set(scaled);
      const last = [noise.byteOffset, row.byteOffset];
      const made = wasm.learn(problemAt(), learner, ...net, ...places, begin ? 1 : 0, ...last);
      const found = Object.fromEntries(NUMBERS.map((name, k) => [name, made ? row[k] : NaN]));
      let at = NUMBERS.length;
      const part = (length) => Array.from(row.subarray(at, at += length));
      if (!made) {
        const parts = { state: Array.from(state), action: null, features: null };
        return { ...found, ...parts, theta: Array.from(theta), w: Array.from(w), failed: true };
      }
      return { ...found, state: part(n), action: part(m), features: part(d), theta: part(d), w: part(d), failed: false };
    }
    return step;
  }

  // ---- Training

  const COUNTS = { step: (episode, t, steps) => episode * steps + t, episode: (episode) => episode };
  const squared = (vector) => vector?.reduce((sum, each) => sum + each * each, 0);
  const absurd = ({ theta, w }, limits) => ![...theta, ...w].every((each) => Math.abs(each) <= limits.absurd);

  // Algorithm 1, step by step: { episode, time, state, action, cost, value, features, nextValue, delta, phi2, theta,
  // w, failed, diverged }, theta and w after the step. What is diverged is the last.
  function* train(nmpc, settings, noise) {
    const { limits, steps, decayRate, start } = settings, m = nmpc.problem.lower.length;
    const step = runIn(nmpc, settings), count = COUNTS[settings.decay];
    let failures = 0;
    for (let episode = 0; episode < settings.episodes; episode++) {
      let failed = false;
      for (let time = 0; time < steps && !failed; time++) {
        const scale = decayRate ** count(episode, time, steps), at = (episode * steps + time) * m;
        const found = step(time ? null : start, noise.slice(at, at + m).map((each) => scale * each));
        ({ failed } = found);
        const diverged = absurd(found, limits) || (failed && failures + 1 === limits.patience);
        yield { episode, time, ...found, phi2: squared(found.features), diverged };
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
