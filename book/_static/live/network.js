// The network that imitates the NMPC's value, as nmpcrl/learning/network.py has it: torch's first weights, and
// fits and predictions by the functions of nmpcrl/learning/network_rules.py.
(function imitating() {
  "use strict";

  // ---- torch's generator: MT19937 (Matsumoto and Nishimura 1998)
  const SIZE = 624, MIDDLE = 397, UPPER = 0x80000000, LOWER = 0x7fffffff;

  // Draws 32 bits at a time, after torch.manual_seed(seed), of which only the lowest 32 bits count.
  function mersenneTwister(seed) {
    const state = new Uint32Array(SIZE);
    state[0] = Number(BigInt.asUintN(32, seed));
    for (let k = 1; k < SIZE; k++) {
      const before = state[k - 1] ^ (state[k - 1] >>> 30);
      state[k] = Math.imul(1812433253, before) + k;
    }
    let at = SIZE;

    function twist() {
      for (let k = 0; k < SIZE; k++) {
        const bits = (state[k] & UPPER) | (state[(k + 1) % SIZE] & LOWER);
        state[k] = state[(k + MIDDLE) % SIZE] ^ (bits >>> 1) ^ (bits & 1 ? 0x9908b0df : 0);
      }
      at = 0;
    }

    return () => {
      if (at === SIZE) twist();
      let bits = state[at++];
      bits ^= bits >>> 11;
      bits ^= (bits << 7) & 0x9d2c5680;
      bits ^= (bits << 15) & 0xefc60000;
      return (bits ^ (bits >>> 18)) >>> 0;
    };
  }

  // What torch draws for linear layers of these widths, in the order of `QNetwork`: a matrix (in + 1, out) each.
  function firstWeights(widths, seed) {
    const draw = mersenneTwister(seed), { fround, sqrt } = Math;
    const uniform = (bound) => {
      const least = fround(-bound), range = fround(fround(bound) - least);
      return fround(((draw() & 0xffffff) / 2 ** 24) * range + least);
    };
    return Float32Array.from(widths.slice(1).flatMap((out, k) => {
      const count = widths[k], matrix = new Array((count + 1) * out);
      const bound = sqrt(3) * (sqrt(2 / (1 + sqrt(5) ** 2)) / sqrt(count)); // Kaiming's, as torch computes it
      for (let j = 0; j < out; j++) for (let i = 0; i < count; i++) matrix[i * out + j] = uniform(bound);
      for (let j = 0; j < out; j++) matrix[count * out + j] = uniform(1 / sqrt(count));
      return matrix;
    }));
  }

  // ---- The network of a run

  // Learns in place. `hidden` neurons in each of two layers, `batch` examples a fit; `generator` draws first weights and mini-batches; the arithmetic is that of `wasm`.
  function network(wasm, { inputs, hidden, batch, rate }, generator) {
    const weights = firstWeights([inputs, hidden, hidden, 1], generator.integer63());
    const mean = new Float32Array(weights.length), square = new Float32Array(weights.length);
    const examples = []; // rows of input, 1, target
    let fits = 0;

    // Call with arrays in the module's memory, read back what it wrote, and give the memory back.
    function called(arrays, call) {
      const from = wasm.reserve(0);
      const rooms = arrays.map((array) => {
        const room = new Float32Array(wasm.memory.buffer, wasm.reserve(array.byteLength), array.length);
        room.set(array);
        return room;
      });
      const result = call(rooms.map(({ byteOffset }) => byteOffset));
      arrays.forEach((array, k) => array.set(rooms[k]));
      wasm.release(from);
      return result;
    }

    // One Adam step on a mini-batch; its loss before the step.
    function fit() {
      const rows = new Float32Array(batch * (inputs + 2));
      generator.choice(examples.length, batch).forEach((row, k) => rows.set(examples[row], k * (inputs + 2)));
      fits += 1;
      return called([rows, weights, mean, square], (places) => (
        wasm.network_fit(inputs, hidden, batch, ...places, rate, fits)
      ));
    }

    const predict = (input) => called([Float32Array.of(...input, 1), weights], (places) => (
      wasm.network_predict(inputs, hidden, ...places)
    ));

    return {
      weights, // now
      remember: (input, target) => examples.push(Float32Array.of(...input, 1, target)),
      ready: () => examples.length >= batch,
      fit,
      predict,
    };
  }

  self.nmpcrl = {
    ...self.nmpcrl, firstWeights, network, sources: [...(self.nmpcrl?.sources ?? []), imitating],
  };
})();
