// The solver of a `Problem`, whose data are of each stage; nmpcrl/control/solvers/rows_entries.py and BEGIN of
// nmpcrl/control/browser.py describe the functions.
(() => {
  "use strict";

  const { instance } = window.nmpcrl;
  const FREE = 0, SOLVED = 0; // as in solver.js

  // What comes back plans for { state, theta, data }, and starts from the plan before unless this is the `first`; null
  // if there is no plan.
  async function planner(packed, tolerance) {
    const wasm = await instance(packed);
    const room = (count) => new Float64Array(wasm.memory.buffer, wasm.reserve(8 * count), count);
    const sizes = room(8);
    wasm.nmpc_sizes(sizes.byteOffset);
    const [n, m, d, N, rows, size, z, lam] = sizes;
    const data = room((N + 1) * size), state = room(n), theta = room(d), action = room(m);
    const found = room(2 * z + lam + d), report = room(5);
    const read = (at, count) => Array.from(found.subarray(at, at + count));

    function plan(given, first) {
      data.set(given.data.flat(2));
      state.set(given.state);
      theta.set(given.theta);
      const asked = [data, state, theta].map((array) => array.byteOffset);
      const end = first ? wasm.nmpc_begin(...asked, tolerance, found.byteOffset, report.byteOffset) : wasm.nmpc_solve(
        ...asked, action.byteOffset, FREE, FREE, found.byteOffset, tolerance, found.byteOffset, report.byteOffset,
      );
      if (end !== SOLVED) return null;
      const states = Array.from({ length: N + 1 }, (_, i) => read(i * (n + m + rows), n));
      return { action: read(n, m), states };
    }
    return { plan, horizon: N };
  }

  window.nmpcrl = { ...window.nmpcrl, planner };
})();
