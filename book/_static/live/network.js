// The network that imitates the NMPC's value, as nmpcrl/learning/network.py begins it: torch's first weights, and
// arrays in a module's memory.
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

  // The arguments that `learn` takes of a network. `filled` puts numbers in the memory of a module. `hidden` neurons
  // in each of two layers, `batch` examples a fit, `capacity` examples in all; `generator` draws the seeds of weights
  // and mini-batches.
  function network(filled, { inputs, hidden, batch, capacity, rate }, generator) {
    const first = firstWeights([inputs, hidden, hidden, 1], generator.integer63());
    const weights = filled(Float32Array, new Float32Array(4 * first.length)); // gradient and moments, too
    weights.set(first);
    const examples = filled(Float32Array, new Float32Array(capacity * (inputs + 1)));
    const order = filled(Int32Array, new Int32Array(capacity));
    const counts = filled(BigInt64Array, [0n, 0n]), draw = filled(BigUint64Array, [generator.integer63()]);
    const scales = filled(Float64Array, new Float64Array(inputs + 1).fill(1));
    const sizes = filled(BigInt64Array, [hidden, batch, capacity, 0].map(BigInt)); // 0: ReLU
    const arrays = [weights, examples, order, counts, draw, scales].map(({ byteOffset }) => byteOffset);
    return [...arrays, rate, sizes.byteOffset, inputs, capacity];
  }

  self.nmpcrl = {
    ...self.nmpcrl, firstWeights, network, sources: [...(self.nmpcrl?.sources ?? []), imitating],
  };
})();
