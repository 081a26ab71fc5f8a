// The solver that trains every run, in this page: arrays in, plans and the closed loop out.
// module.js has its WebAssembly; nmpcrl/control/solvers/entries.py describes the functions.
(() => {
  "use strict";

  const GIVEN = { sin: Math.sin, cos: Math.cos, log: Math.log, pow: Math.pow };
  const FREE = 0; // u_0 is not fixed
  const NOTHING = -1; // no earlier solution
  const SOLVED = 0;

  // Everything that is solved among `problem.discs.length` obstacles with up to `longest` planned inputs.
  async function solver(base64, problem) {
    const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
    const { instance } = await WebAssembly.instantiate(bytes, { env: GIVEN });
    const wasm = instance.exports;

    const room = (count) => new Float64Array(wasm.memory.buffer, wasm.reserve(8 * count), count);
    const filled = (numbers) => {
      const array = room(numbers.length);
      array.set(numbers);
      return array;
    };
    const n = problem.target.length, m = problem.lower.length, d = problem.theta;
    const count = problem.discs.length, stride = n + m + count;
    const sizes = (N) => ({ z: N * stride + n + count, lam: (N + 1) * (n + count) });
    const numbers = ({ z, lam }) => 2 * z + lam + d;

    const target = filled(problem.target), lower = filled(problem.lower), upper = filled(problem.upper);
    const discs = filled(problem.discs.flat()), sides = filled(problem.sides.flat());
    const discount = filled(problem.discount);
    const state = room(n), next = room(n), theta = room(d), action = room(m), report = room(5);
    const plan = room(numbers(sizes(problem.discount.length - 1)));

    const solve = (N, warm) => wasm.nmpc_solve(
      N, count, problem.sides.length,
      target.byteOffset, lower.byteOffset, upper.byteOffset,
      discs.byteOffset, sides.byteOffset, discount.byteOffset,
      problem.slack_weight, problem.soft_box, problem.tie,
      state.byteOffset, theta.byteOffset, action.byteOffset, FREE,
      warm ? FREE : NOTHING, plan.byteOffset, problem.tolerance, plan.byteOffset, report.byteOffset,
    ) === SOLVED;

    // The last plan, in JavaScript's own arrays.
    function read(N) {
      const size = sizes(N), from = (at, length) => Array.from(plan.subarray(at, at + length));
      const stages = Array.from({ length: N + 1 }, (_, i) => i * stride);
      const slacks = stages.map((at, i) => from(at + n + (i < N ? m : 0), count));
      return {
        value: report[0],
        states: stages.map((at) => from(at, n)),
        action: from(n, m),
        slack: Math.max(...slacks.flat()),
        features: from(numbers(size) - d, d),
      };
    }

    // The closed loop of a policy from `given.start` without noise, and the first of its plans.
    // A failed solve ends it, as in `evaluate`.
    function rollout(given, steps) {
      state.set(given.start);
      theta.set(given.theta);
      discs.set(given.discs.flat());
      const found = { states: [], cost: 0, plan: null, failed: false };
      for (let k = 0; k < steps; k++) {
        if (!solve(given.horizon, k > 0)) return { ...found, failed: true };
        found.plan ??= read(given.horizon);
        action.set(plan.subarray(n, n + m));
        found.states.push(Array.from(state));
        found.cost += wasm.stage_cost(
          count, discs.byteOffset, target.byteOffset, state.byteOffset, action.byteOffset,
        );
        wasm.plant_step(state.byteOffset, action.byteOffset, next.byteOffset);
        state.set(next);
      }
      return found;
    }

    return { rollout };
  }

  window.nmpcrl = { ...window.nmpcrl, solver };
})();
