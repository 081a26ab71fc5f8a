// Learners that meet the same noise, an episode beside the other's: the training of learning.js, step by step.
(() => {
  "use strict";

  const { train } = window.nmpcrl;

  // What a step took for the value of the next state, minus what it was: as `online_error` of analysis/metrics.py.
  // `step` solved in that state, with `theta`; its value is carried back to the theta of the step `before`.
  function predictionError(before, step, theta) {
    if (!before || before.time + 1 !== step.time || !step.features) return NaN;
    const carried = step.features.reduce((sum, phi, i) => sum + phi * (theta[i] - before.given[i]), 0);
    return before.nextValue - (step.value - carried);
  }

  const rootMeanSquare = (numbers) => Math.sqrt(numbers.reduce((sum, each) => sum + each * each, 0) / numbers.length);

  // What a learner has done so far. `costs` are those without noise: { episode, cost, states }; `gauge` is the
  // largest alpha ||phi||^2 of the episode; `errors` are of the next value, the root mean square of each episode.
  function learner(nmpc, settings, noise, judge) {
    const { episodes, steps, evaluateEvery, alpha } = settings;
    const training = train(nmpc, settings, noise);
    const now = {
      learner: settings.learner, theta: settings.theta, w: settings.w, episode: 0, step: null, over: false,
      gauge: NaN, gauges: [], errors: [], diverged: false, costs: [{ episode: 0, ...judge(settings.theta) }],
    };
    let highest = 0; // as `gauge`, and 0 where an episode begins
    let before = null, errors = []; // the step before; of this episode

    function ended() {
      now.episode += 1;
      now.gauges.push(highest);
      highest = 0;
      now.errors.push(rootMeanSquare(errors));
      errors = [];
      now.over = now.diverged || now.episode === episodes;
      const due = now.episode % evaluateEvery === 0 || now.episode === episodes;
      if (due && !now.diverged) now.costs.push({ episode: now.episode, ...judge(now.theta) });
    }

    function advance() {
      const step = training.next().value, { theta: given } = now;
      const error = predictionError(before, step, given);
      if (Number.isFinite(error)) errors.push(error);
      before = { ...step, given };
      Object.assign(now, { step, theta: step.theta, w: step.w, diverged: step.diverged });
      highest = now.gauge = Math.max(highest, alpha * step.phi2 || 0);
      if (step.failed || step.diverged || step.time === steps - 1) ended();
    }
    return { now, advance };
  }

  // All learners, none of which begins an episode before the others have ended theirs.
  function sideBySide(learners) {
    const working = () => learners.filter(({ now }) => !now.over);
    const episode = () => Math.min(...working().map(({ now }) => now.episode));
    function step() {
      const least = episode();
      for (const one of working()) if (one.now.episode === least) one.advance();
      return working().length > 0;
    }
    function wholeEpisode() {
      const first = episode();
      while (working().length && episode() === first) step();
    }
    return { all: learners.map(({ now }) => now), over: () => !working().length, step, wholeEpisode };
  }

  window.nmpcrl = { ...window.nmpcrl, learner, sideBySide };
})();
