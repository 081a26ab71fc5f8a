// numpy's numbers: default_rng(SeedSequence(seed).spawn(...)[child]), its normal() and integers(2**63).
//
// SeedSequence: O'Neill's seed_seq; PCG64: XSL-RR on 128 bits (O'Neill 2014); the normal law: the ziggurat of
// Marsaglia and Tsang (2000) with 256 strips, as in numpy/random/src/distributions.
(function drawing() {
  "use strict";

  // ---- SeedSequence: 32-bit words are mixed into a pool of four
  const POOL = 4;
  const word = (x) => x >>> 0;
  const times = (x, y) => word(Math.imul(x, y));

  function hasher(start, factor) {
    let constant = start;
    return (value) => {
      const mixed = word(value ^ constant);
      constant = times(constant, factor);
      const product = times(mixed, constant);
      return word(product ^ (product >>> 16));
    };
  }

  function mix(x, y) {
    const result = word(times(0xca01f9dd, x) - times(0x4973f715, y));
    return word(result ^ (result >>> 16));
  }

  // The first words of a child of SeedSequence(seed), for a seed below 2^32.
  function words(seed, child, count) {
    const entropy = [seed, 0, 0, 0, child], hash = hasher(0x43b0d7e5, 0x931e8875);
    const pool = entropy.slice(0, POOL).map(hash);
    for (let from = 0; from < POOL; from++) {
      for (let to = 0; to < POOL; to++) if (from !== to) pool[to] = mix(pool[to], hash(pool[from]));
    }
    for (const more of entropy.slice(POOL)) {
      for (let to = 0; to < POOL; to++) pool[to] = mix(pool[to], hash(more));
    }
    const out = hasher(0x8b51f9dd, 0x58f38ded);
    return Array.from({ length: count }, (_, k) => out(pool[k % POOL]));
  }

  // ---- PCG64
  const MULTIPLIER = 0x2360ed051fc65da44385df649fccf645n;
  const low = (bits, x) => BigInt.asUintN(bits, x);

  // Draws 64 bits at a time.
  function pcg64(seed, child) {
    const [a, b, c, d, e, f, g, h] = words(seed, child, 8).map(BigInt);
    const wide = (w0, w1, w2, w3) => (w1 << 96n) | (w0 << 64n) | (w3 << 32n) | w2; // halves: high, low
    const increment = low(128, (wide(e, f, g, h) << 1n) | 1n);
    const next = (state) => low(128, state * MULTIPLIER + increment);
    let state = next(low(128, next(0n) + wide(a, b, c, d)));
    return () => {
      state = next(state);
      const turn = state >> 122n, folded = low(64, (state >> 64n) ^ state);
      return low(64, (folded >> turn) | (folded << (64n - turn)));
    };
  }

  const uniform = (bits) => Number(bits >> 11n) / 2 ** 53; // in [0, 1)

  // ---- The ziggurat: strips of equal area under the density, the last of which has the tail
  const MANTISSA = 2 ** 52;

  // `widths` are those of numpy's strips, divided by 2^52; 64 bits at a time come from `draw`.
  function ziggurat(widths, draw) {
    const ends = widths.map((width) => width * MANTISSA), tail = ends.at(-1);
    const density = (x) => Math.exp(-0.5 * x * x);
    const heights = ends.map((end, k) => (k ? density(end) : 1));
    const inside = ends.map((end, k) => Math.floor((k ? (k > 1 ? ends[k - 1] : 0) : tail) / end * MANTISSA));

    function beyond(negative) {
      for (;;) {
        const x = -Math.log1p(-uniform(draw())) / tail, y = -Math.log1p(-uniform(draw()));
        if (2 * y > x * x) return negative ? -(tail + x) : tail + x;
      }
    }

    return () => {
      for (;;) {
        const bits = draw(), strip = Number(bits & 0xffn);
        const rest = (bits >> 9n) & 0xfffffffffffffn, place = Number(rest);
        const x = (bits & 0x100n ? -place : place) * widths[strip];
        if (place < inside[strip]) return x;
        if (strip === 0) return beyond(Boolean((rest >> 8n) & 1n));
        const height = (heights[strip - 1] - heights[strip]) * uniform(draw()) + heights[strip];
        if (height < density(x)) return x;
      }
    };
  }

  // `count` numbers of the standard normal law from the first child of SeedSequence(seed).
  function normal(seed, count, widths) {
    const draw = ziggurat(widths, pcg64(seed, 0));
    return Float64Array.from({ length: count }, draw);
  }

  // The second child of SeedSequence(seed), which is the network's: integer63() is rng.integers(2**63).
  function generator(seed) {
    const draw = pcg64(seed, 1);
    return { integer63: () => draw() >> 1n };
  }

  self.nmpcrl = { ...self.nmpcrl, normal, generator, sources: [...(self.nmpcrl?.sources ?? []), drawing] };
})();
