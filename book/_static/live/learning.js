// Algorithm 1 in this page: nmpcrl/learning/loop.py makes each step, compiled with the solver; a worker runs it.
//
// `settings`: { learner, alpha, beta, zeta, decay, decayRate, seed, episodes, steps, theta, w, thetaSet, evaluateEvery,
// start, target, discs, horizon, limits: { absurd, far, patience }, network: { hidden, batch }, deviation }.
(function learning() {
  "use strict";

  // ---- Random numbers: a seed draws the same ones in every browser, and others than in Python

  // Numbers in [0, 1), of 32 bits (mulberry32).
  function uniform(seed, stream) {
    let state = Math.imul(seed + 1, 0x9e3779b1) ^ Math.imul(stream + 1, 0x85ebca6b);
    return () => {
      state = (state + 0x6d2b79f5) | 0;
      let bits = Math.imul(state ^ (state >>> 15), state | 1);
      bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
      return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
    };
  }

  // Numbers of the standard normal law (Box and Muller).
  function normal(seed, count) {
    const draw = uniform(seed, 0);
    return Float64Array.from({ length: count }, () => (
      Math.sqrt(-2 * Math.log(1 - draw())) * Math.cos(2 * Math.PI * draw())
    ));
  }

  // The arguments that `learn` takes of a network, as nmpcrl/learning/network.py begins it: `hidden` neurons in each of
  // two layers, `batch` examples a fit, `capacity` examples in all. `filled` puts numbers in the memory of a module.
  function network(filled, { inputs, hidden, batch, capacity, rate, seed }) {
    const draw = uniform(seed, 1), within = (bound) => bound * (2 * draw() - 1), widths = [inputs, hidden, hidden, 1];
    const first = widths.slice(1).flatMap((out, k) => { // a matrix of (in + 1, out), within torch's bound of a linear layer
      const bound = 1 / Math.sqrt(widths[k]);
      return Array.from({ length: (widths[k] + 1) * out }, () => within(bound));
    });
    const weights = filled(Float32Array, new Float32Array(4 * first.length)); // gradient and moments, too
    weights.set(first);
    const examples = filled(Float32Array, new Float32Array(capacity * (inputs + 1)));
    const order = filled(Int32Array, new Int32Array(capacity));
    const counts = filled(BigInt64Array, [0n, 0n]), batches = filled(BigUint64Array, [BigInt(Math.floor(draw() * 2 ** 32))]);
    const scales = filled(Float64Array, new Float64Array(inputs + 1).fill(1));
    const sizes = filled(BigInt64Array, [hidden, batch, capacity, 0].map(BigInt)); // 0: ReLU
    const arrays = [weights, examples, order, counts, batches, scales].map(({ byteOffset }) => byteOffset);
    return [...arrays, rate, sizes.byteOffset, inputs, capacity];
  }

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
    const net = bootstrap !== NETWORK ? [...Array(6).fill(none), 0, none, 0, 0] : network(filled, {
      ...settings.network, seed: settings.seed, inputs: n + m + (withTheta ? d : 0), rate: settings.zeta,
      capacity: settings.episodes * settings.steps,
    });
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

  // ---- A run

  const COUNTS = { step: (episode, t, steps) => episode * steps + t, episode: (episode) => episode };
  const absurd = ({ theta, w }, limits) => ![...theta, ...w].every((each) => Math.abs(each) <= limits.absurd);

  // What a policy does without noise: { cost, states, value, discounted }, the last two of the start.
  function judge(nmpc, { start, target, discs, horizon, steps: count }, theta) {
    const { states, cost, discounted, plan, failed } = nmpc.rollout({ start, target, discs, horizon, theta }, count);
    const end = failed ? { cost: Infinity, discounted: Infinity } : { cost, discounted };
    return { ...end, states, value: plan?.value ?? NaN };
  }

  // A row an episode, as nmpcrl/study/run.py has it, and one before them: { episode, cost, delta (root mean square),
  // alphaPhi2 (the largest), theta, diverged, judged or null }. `noise` is of all steps, (episodes, steps, m).
  function* run(nmpc, settings, noise) {
    const { alpha, episodes, evaluateEvery, limits, steps, decayRate, start } = settings;
    const step = runIn(nmpc, settings), m = nmpc.problem.lower.length, count = COUNTS[settings.decay];
    let { theta } = settings, failures = 0, left = false, diverged = false;
    yield { episode: 0, cost: NaN, delta: NaN, alphaPhi2: NaN, theta, diverged, judged: judge(nmpc, settings, theta) };
    for (let episode = 1; episode <= episodes && !diverged; episode++) {
      let cost = 0, phi2 = 0, squares = 0, known = 0, failed = false;
      for (let time = 0; time < steps && !failed && !diverged; time++) {
        const scale = decayRate ** count(episode - 1, time, steps), at = ((episode - 1) * steps + time) * m;
        const found = step(time ? null : start, noise.slice(at, at + m).map((each) => scale * each));
        ({ theta, failed } = found);
        cost += found.cost;
        phi2 = Math.max(phi2, found.features?.reduce((sum, each) => sum + each * each, 0) ?? 0);
        if (Number.isFinite(found.delta)) [squares, known] = [squares + found.delta ** 2, known + 1];
        failures = failed ? failures + 1 : failures;
        left = absurd(found, limits);
        diverged = left || failures === limits.patience;
      }
      if (!failed) failures = 0;
      const due = !left && (episode % evaluateEvery === 0 || episode === episodes);
      yield {
        episode, cost, delta: Math.sqrt(squares / known), alphaPhi2: alpha * phi2, theta, diverged,
        judged: due ? judge(nmpc, settings, theta) : null,
      };
    }
  }

  // Runs in the worker, which is given { module, problem, settings }.
  async function work({ module, problem, settings }) {
    const nmpc = await self.nmpcrl.solver(module, problem);
    const noise = normal(settings.seed, settings.episodes * settings.steps * problem.lower.length);
    for (const row of run(nmpc, settings, noise.map((each) => settings.deviation * each))) self.postMessage({ row });
  }

  // Trains in a worker, which has the text of the two scripts, so that the page stays at hand. `on.row` is called after
  // each episode, `on.end` once, with an error's sentence or "". What comes back stops it.
  function trainer(given, on) {
    const listen = `self.onmessage = ({ data }) => self.nmpcrl.work(data)
      .then(() => self.postMessage({ end: "" }), (error) => self.postMessage({ end: String(error) }));`;
    const text = [...self.nmpcrl.sources.map((script) => `(${script})();`), listen].join("\n");
    const place = URL.createObjectURL(new Blob([text], { type: "text/javascript" })), worker = new Worker(place);
    URL.revokeObjectURL(place);
    const end = (why) => {
      worker.terminate();
      on.end(why);
    };
    worker.onmessage = ({ data }) => (data.row ? on.row(data.row) : end(data.end));
    worker.onerror = ({ message }) => end(message || "it did not start a worker"); // it does not even begin
    worker.postMessage(given);
    return () => worker.terminate();
  }

  self.nmpcrl = { ...self.nmpcrl, run, normal, work, trainer, sources: [...(self.nmpcrl?.sources ?? []), learning] };
})();
