/* A figure whose link ends in #play is an SVG that plays at that address: a click plays it where it stands, and
   the next click stops it. Without this script the link opens the SVG, which plays there. */
(() => {
  const PLAY = "#play";
  const words = { play: "▶ Play", stop: "■ Stop" };

  function prepare(link) {
    const shown = [...link.querySelectorAll("source")].map((one) => [one, one.getAttribute("srcset")]);
    const button = document.createElement("button");
    let playing = false;

    function turn(event) {
      event.preventDefault();
      playing = !playing;
      for (const [one, address] of shown) one.setAttribute("srcset", address + (playing ? PLAY : ""));
      button.textContent = playing ? words.stop : words.play;
      link.classList.toggle("playing", playing);
    }

    button.type = "button";
    button.className = "plays";
    button.textContent = words.play;
    button.addEventListener("click", turn);
    link.addEventListener("click", turn);
    link.tabIndex = -1; // the button does the same
    link.after(button);
  }

  document.addEventListener("DOMContentLoaded", () => {
    document.querySelectorAll(`a[href$=".svg${PLAY}"]`).forEach(prepare);
  });
})();
