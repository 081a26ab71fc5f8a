// The solver that trains every run, in this page: arrays in, plans and the closed loop out.
// module.js has its WebAssembly; nmpcrl/control/solvers/entries.py describes its functions.
//
// A function with a name, so that a worker can be given its text.
(function solving() {
  "use strict";

  const FREE = 0, FIXED = 1; // u_0
  const NOTHING = -1; // no earlier solution
  const SOLVED = 0;

  // The bytes that were packed: gzip, then base64.
  async function unpack(packed) {
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(unpacked).arrayBuffer();
  }

  async function instance(packed) {
    const made = await WebAssembly.instantiate(await unpack(packed), { env: Math });
    return made.instance.exports;
  }

  // The numbers of a problem in the order of `packed` in nmpcrl/control/browser.py. `data` are of N + 1 stages, with
  // any number of lines (obstacles), of which `problem` has the first, as it has the stages of the longest horizon.
  function packed(problem, data) {
    const { fixed, per, own, width, sides, lower, upper } = problem;
    const N = data.length - 1, last = problem.discount.length - 1, lines = width ? (data[0].length - own) / width : 0;
    const rows = (of) => [
      ...of.slice(0, fixed), ...Array.from({ length: lines }, () => of.slice(fixed, fixed + per)).flat(),
    ];
    const all = (of) => [...rows(of), ...of.slice(of.length - sides.length)];
    const kind = problem.kind.map((of) => data.map((_, i) => all(of[i < N ? i : last])));
    const weights = rows(problem.weights).map((one) => one ?? Infinity);
    const starts = [...problem.others, ...problem.drawn].map((inputs) => inputs.slice(0, N));
    const head = [N, lines, sides.length, problem.others.length, problem.drawn.length, problem.tie];
    return [head, data, lower, upper, sides, kind, problem.discount.slice(0, N + 1), weights, starts].flat(Infinity);
  }

  const times = (numbers, units) => Array.from(numbers, (each, k) => each * units[k]);
  const over = (numbers, units) => numbers.map((each, k) => each / units[k]);

  // Everything that is solved. `problem` is what `problem` in nmpcrl/control/browser.py says, and of a task also its
  // `target`, `discs`, and `most_discs` of what is asked. That is { state, theta, discs, horizon }, and a `target` if
  // it is not the problem's; of a problem without a task { state, theta, data }, where `data` are of each stage.
  async function solver(module, problem) {
    const wasm = await instance(module);
    const room = (count) => new Float64Array(wasm.memory.buffer, wasm.reserve(8 * count), count);
    const { states: n, inputs: m, theta: d, units, input_units: inputUnits, own, width, most_discs: most } = problem;
    const stage = (row, length = problem.data.length) => Array.from({ length }, () => row);
    const largest = most ? stage(Array(own + width * most).fill(0)) : problem.data;

    const numbers = room(packed(problem, largest).length);
    const state = room(n), next = room(n), theta = room(d), action = room(m), report = room(5);
    let known = null, N = 0, slacks = 0; // of what was asked last
    const hard = problem.fixed - problem.soft;
    const size = (fixed) => (N + 1) * (3 * (n + slacks) + hard) + 2 * N * m + fixed * m + d; // of a plan's numbers

    function write({ data, discs, target, horizon }) {
      const row = discs && [...(target ?? problem.target), ...discs.flat()];
      const all = data ?? (row ? stage(row, (horizon ?? problem.data.length - 1) + 1) : problem.data);
      numbers.set(packed(problem, all));
      N = numbers[0];
      slacks = problem.soft + problem.per * numbers[1];
    }

    function ask(given) {
      const about = [given.data, given.discs, given.target, given.horizon];
      if (!known?.every((one, k) => one === about[k])) write(given);
      known = about;
      if (given.theta) theta.set(given.theta);
      if (given.state) state.set(over(given.state, units));
    }

    ask({ data: largest });
    const plan = room(size(FIXED));
    const places = (...arrays) => arrays.map(({ byteOffset }) => byteOffset);
    const asked = places(numbers, state, theta, action);

    // From the solution that `plan` holds to the one that it then holds; `warm` is its u_0, FREE or FIXED.
    const solveThere = (warm, fixed = FREE) => wasm.nmpc_solve(
      ...asked, fixed, warm, plan.byteOffset, problem.tolerance, ...places(plan, report),
    ) === SOLVED;

    // What `plan` holds, in JavaScript's own arrays.
    function read(fixed = FREE) {
      const all = size(fixed), stride = n + m + slacks;
      const from = (at, length) => Array.from(plan.subarray(at, at + length));
      const stages = Array.from({ length: N + 1 }, (_, i) => i * stride);
      const beyond = stages.flatMap((at, i) => from(at + n + (i < N ? m : 0), slacks));
      return {
        value: report[0],
        features: from(all - d, d),
        states: stages.map((at) => times(from(at, n), units)),
        action: times(from(n, m), inputUnits),
        nextAction: times(from((N > 1 ? stride : 0) + n, m), inputUnits),
        slack: Math.max(0, ...beyond),
        iterations: report[1],
        restarts: report[2],
        numbers: plan.slice(0, all),
        fixed,
      };
    }

    // The plan for `given`, with u_0 = `action` if that is given; null if there is none. `warm` is an
    // earlier plan to start from, of the same horizon and as many obstacles.
    function solve(given, { action: fixed = null, warm = null } = {}) {
      ask(given);
      if (fixed) action.set(over(fixed, inputUnits));
      const same = warm?.numbers.length === size(warm?.fixed);
      if (same) plan.set(warm.numbers);
      const which = fixed ? FIXED : FREE;
      return solveThere(same ? warm.fixed : NOTHING, which) ? read(which) : null;
    }

    const stepThere = () => wasm.model_step(...asked, next.byteOffset);
    const chargeThere = () => wasm.task_cost(...places(numbers, state, action));

    // The state one period later.
    function step(from, input) {
      state.set(over(from, units));
      action.set(over(input, inputUnits));
      stepThere();
      return times(next, units);
    }

    // The stage cost of a task that learning minimises.
    function cost(given, from, input) {
      ask({ ...given, state: from });
      action.set(input);
      return chargeThere();
    }

    // The closed loop of a task's policy from `given.start` without noise, its cost, discounted too, and the first of
    // its plans. A failed solve ends it, as in `evaluate`.
    function rollout(given, steps) {
      ask({ ...given, state: given.start });
      const found = { states: [], cost: 0, discounted: 0, plan: null, failed: false };
      for (let k = 0; k < steps; k++) {
        if (!solveThere(k > 0 ? FREE : NOTHING)) return { ...found, failed: true };
        found.plan ??= read();
        action.set(plan.subarray(n, n + m));
        found.states.push(times(state, units));
        const charged = chargeThere();
        found.cost += charged;
        found.discounted += problem.discount[1] ** k * charged;
        stepThere();
        state.set(next);
      }
      return found;
    }

    // Where the problem of `given` lies, and how long a plan's numbers are without the gradient.
    function at(given) {
      ask(given);
      return numbers.byteOffset;
    }
    const planLength = () => size(FREE) - d;

    return { problem, wasm, solve, rollout, step, cost, at, planLength, rules: rules(wasm, room, d) };
  }

  // The update rules, as nmpcrl/learning/browser.py describes them, of vectors no longer than theta.
  function rules(wasm, room, longest) {
    const SEMI_GRADIENT = 0, GRADIENT_TD = 1; // as in loop.py
    const places = Array.from({ length: 4 }, () => room(longest));

    // { theta, w } after a step.
    function moved(rule, { theta, w, delta, phi, phiNext, alpha, beta, gamma }) {
      [theta, w, phi, phiNext].forEach((vector, k) => places[k].set(vector));
      const [atTheta, atW, ...others] = places.map(({ byteOffset }) => byteOffset);
      wasm.moved(rule, theta.length, atTheta, atW, delta, ...others, alpha, beta, gamma);
      return { theta: Array.from(places[0].subarray(0, theta.length)), w: Array.from(places[1].subarray(0, w.length)) };
    }
    return {
      tdError: wasm.td_error, // (cost, gamma, q, qNext)
      semiGradient: (theta, delta, phi, alpha) => (
        moved(SEMI_GRADIENT, { theta, w: theta, delta, phi, phiNext: phi, alpha, beta: 0, gamma: 0 }).theta
      ),
      gradientTd: (given) => moved(GRADIENT_TD, given),
    };
  }

  self.nmpcrl = { ...self.nmpcrl, solver, instance, unpack, sources: [...(self.nmpcrl?.sources ?? []), solving] };
})();
