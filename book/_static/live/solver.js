// The solver that trains every run, in this page: arrays in, plans and the closed loop out.
// module.js has its WebAssembly; nmpcrl/control/solvers/entries.py describes the functions.
//
// A function with a name, so that a worker can be given its text.
(function solving() {
  "use strict";

  const FREE = 0, FIXED = 1; // u_0
  const NOTHING = -1; // no earlier solution
  const SOLVED = 0, FORMED = 1;

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

  // Everything that is solved, with up to `problem.most_discs` obstacles and as many planned inputs as
  // `problem.discount` has room for. What is asked is { state, theta, discs, horizon }, and a `target`
  // if it is not the problem's.
  async function solver(packed, problem) {
    const wasm = await instance(packed);
    const room = (count) => new Float64Array(wasm.memory.buffer, wasm.reserve(8 * count), count);
    const filled = (numbers) => {
      const array = room(numbers.length);
      array.set(numbers);
      return array;
    };
    const n = problem.target.length, m = problem.lower.length, d = problem.theta;
    const size = (fixed) => 2 * N * m + 3 * (N + 1) * (n + count) + fixed * m + d; // of a plan's numbers

    const target = filled(problem.target), lower = filled(problem.lower), upper = filled(problem.upper);
    const discs = room(3 * problem.most_discs), sides = filled(problem.sides.flat());
    const discount = filled(problem.discount);
    const state = room(n), next = room(n), theta = room(d), action = room(m), report = room(5);
    const vector = room(d), product = room(d);
    let N = problem.discount.length - 1, count = problem.most_discs; // of what is asked; at most so many
    const plan = room(size(FIXED));

    function ask(given) {
      N = given.horizon ?? N;
      count = given.discs.length;
      target.set(given.target ?? problem.target);
      given.discs.forEach((disc, k) => discs.set(disc, 3 * k));
      if (given.theta) theta.set(given.theta);
      if (given.state) state.set(given.state);
    }

    const asked = (fixed) => [
      N, count, problem.sides.length,
      target.byteOffset, lower.byteOffset, upper.byteOffset,
      discs.byteOffset, sides.byteOffset, discount.byteOffset,
      problem.slack_weight, problem.soft_box, problem.tie,
      state.byteOffset, theta.byteOffset, action.byteOffset, fixed,
    ];

    // From the solution that `plan` holds to the one that it then holds; `warm` is its u_0, FREE or FIXED.
    const solveThere = (warm, fixed = FREE) => wasm.nmpc_solve(
      ...asked(fixed), warm, plan.byteOffset, problem.tolerance, plan.byteOffset, report.byteOffset,
    ) === SOLVED;

    // What `plan` holds, in JavaScript's own arrays.
    function read(fixed = FREE) {
      const all = size(fixed), stride = n + m + count;
      const from = (at, length) => Array.from(plan.subarray(at, at + length));
      const stages = Array.from({ length: N + 1 }, (_, i) => i * stride);
      const slacks = stages.flatMap((at, i) => from(at + n + (i < N ? m : 0), count));
      return {
        value: report[0],
        features: from(all - d, d),
        states: stages.map((at) => from(at, n)),
        action: from(n, m),
        nextAction: from((N > 1 ? stride : 0) + n, m),
        slack: Math.max(0, ...slacks),
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
      if (fixed) action.set(fixed);
      const known = warm?.numbers.length === size(warm?.fixed);
      if (known) plan.set(warm.numbers);
      const which = fixed ? FIXED : FREE;
      return solveThere(known ? warm.fixed : NOTHING, which) ? read(which) : null;
    }

    // The state one period later.
    function step(from, input) {
      state.set(from);
      action.set(input);
      wasm.plant_step(state.byteOffset, action.byteOffset, next.byteOffset);
      return Array.from(next);
    }

    const charge = () => wasm.stage_cost(
      count, discs.byteOffset, target.byteOffset, state.byteOffset, action.byteOffset,
    );

    // The stage cost that learning minimises.
    function cost(given, from, input) {
      ask({ ...given, state: from });
      action.set(input);
      return charge();
    }

    // The Hessian of a plan's value in theta, times a vector; null at no strict minimum.
    function hessianTimes(given, solution, by) {
      ask(given);
      action.set(solution.action);
      plan.set(solution.numbers);
      vector.set(by);
      const formed = wasm.nmpc_hessian_times(
        ...asked(solution.fixed), plan.byteOffset, vector.byteOffset, product.byteOffset,
      );
      return formed === FORMED ? Array.from(product) : null;
    }

    // The closed loop of a policy from `given.start` without noise, its cost, discounted too, and the first of its plans.
    // A failed solve ends it, as in `evaluate`.
    function rollout(given, steps) {
      ask({ ...given, state: given.start });
      const found = { states: [], cost: 0, discounted: 0, plan: null, failed: false };
      for (let k = 0; k < steps; k++) {
        if (!solveThere(k > 0 ? FREE : NOTHING)) return { ...found, failed: true };
        found.plan ??= read();
        action.set(plan.subarray(n, n + m));
        found.states.push(Array.from(state));
        const charged = charge();
        found.cost += charged;
        found.discounted += problem.discount[1] ** k * charged;
        wasm.plant_step(state.byteOffset, action.byteOffset, next.byteOffset);
        state.set(next);
      }
      return found;
    }

    return { problem, wasm, solve, rollout, step, cost, hessianTimes, rules: rules(wasm, room, d) };
  }

  // The update rules, as nmpcrl/learning/rules.py describes them: vectors in, vectors out, no longer than theta.
  function rules(wasm, room, longest) {
    const given = Array.from({ length: 4 }, () => room(longest)), out = room(longest);
    const rule = (name) => (...values) => {
      let vectors = 0, d = 0;
      const placed = values.map((value) => {
        if (typeof value === "number") return value;
        d = value.length;
        given[vectors].set(value);
        return given[vectors++].byteOffset;
      });
      name(d, ...placed, out.byteOffset);
      return Array.from(out.subarray(0, d));
    };
    return {
      tdError: wasm.rule_td_error, // (cost, gamma, q, qNext)
      semiGradient: rule(wasm.rule_semi_gradient), // (theta, delta, phi, alpha)
      gradientTd: rule(wasm.rule_gradient_td), // (theta, w, delta, phi, phiNext, alpha, gamma)
      auxiliary: rule(wasm.rule_auxiliary), // (w, delta, phi, beta)
      curvature: rule(wasm.rule_curvature), // (delta, phi, w, hessianW)
      project: rule(wasm.rule_project), // (theta, least, most)
    };
  }

  self.nmpcrl = { ...self.nmpcrl, solver, instance, unpack, sources: [...(self.nmpcrl?.sources ?? []), solving] };
})();
