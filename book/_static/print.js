// Paper is white: a page is printed in the light theme, whatever the screen has. Its title goes into the margin.
(() => {
  const root = document.documentElement;
  let theme = root.dataset.theme;
  addEventListener("beforeprint", () => {
    theme = root.dataset.theme;
    root.dataset.theme = "light";
  });
  addEventListener("afterprint", () => {
    root.dataset.theme = theme;
  });
  const [chapter, book] = document.title.split(" \u2014 ");
  root.style.setProperty("--chapter", JSON.stringify(chapter));
  root.style.setProperty("--book", JSON.stringify(book === chapter ? "" : book));
})();
