// Learners that meet the same noise, an episode beside the other's: the training of learning.js, step by step.
(() => {
  "use strict";

  const { train, account } = window.nmpcrl;

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
    const { learner: name, theta: first, w } = settings;
    const training = train(nmpc, settings, noise), accounted = account(settings, judge);
    const now = {
      learner: name, theta: first, w, episode: 0, step: null, over: false,
      gauge: NaN, gauges: [], errors: [], diverged: false, costs: [{ episode: 0, theta: first, ...judge(first) }],
    };
    let before = null, errors = []; // the step before; of this episode

    function advance() {
      const step = training.next().value, { theta: given } = now;
      const error = predictionError(before, step, given);
      if (Number.isFinite(error)) errors.push(error);
      before = { ...step, given };
      const { episode, theta, diverged, alphaPhi2: gauge, ended, judged } = accounted(step);
      Object.assign(now, { step, theta, w: step.w, diverged, gauge });
      if (!ended) return;
      now.episode = episode;
      now.gauges.push(gauge);
      now.errors.push(rootMeanSquare(errors));
      errors = [];
      now.over = diverged || episode === settings.episodes;
      if (judged) now.costs.push({ episode, theta, ...judged });
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
