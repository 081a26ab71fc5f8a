// Every word that a reader of the introduction's figure sees or hears.
(() => {
  "use strict";

  const { words } = window.nmpcrl;
  const { fixed } = words.parts;
  const SAME = 5e-4; // a share of the cost that is called none

  const percent = (share) => `${fixed(100 * Math.abs(share), 1)} %`;

  function change(before, now) {
    const share = 1 - now / before;
    if (!Number.isFinite(share)) return "";
    return Math.abs(share) < SAME ? "as much as" : `${percent(share)} ${share > 0 ? "less" : "more"} than`;
  }

  words.intro = {
    map: "The robot, its trajectory among obstacles that can be moved, and a learner",
    handles: "What can be moved on the map",
    title: "Drag an obstacle, or press Learn; then narrow a gap, and learn again.",
    legend: "Line: the robot’s trajectory without noise; dotted: before learning. Dashed circles: the distance from an "
      + "obstacle that its plans keep, which learning changes; where two overlap, the gap between them is closed. "
      + "By keyboard: Tab to an obstacle, to the robot or to its arrow, then arrow keys, with Shift for larger steps.",
    learn: "Learn",
    stop: "Stop",
    narrow: "Narrow a gap",
    widen: "Widen it again",
    progress: "Episodes learned",
    // Lines of words and numbers in turn.
    now: ({ episode, episodes, learning, rollout, first, moved }) => {
      const does = words.intro.does(rollout);
      const cost = rollout.failed ? [] : ["; cost:", fixed(rollout.cost, 0)];
      if (!episode && !learning) return [["Before learning, the robot", does, ...cost]];
      const when = learning ? `Episode ${episode} of ${episodes}` : `After ${episode} episodes`;
      const where = moved ? ", and moved since: the robot" : ": the robot";
      const than = change(first.cost, rollout.cost);
      const beside = than ? [`; ${than} before learning`, `(${fixed(first.cost, 0)})`] : [];
      return [[`${when}${where}`, does, ...cost, ...beside]];
    },
    does: ({ failed, arrived, states }) => {
      if (failed) return `has no plan at step ${states.length}`;
      return arrived ? "arrives" : "is stuck before the target";
    },
    failed: (why) => `This browser could not train: ${why}.`,
    diverged: "Learning diverged.",
  };
})();
