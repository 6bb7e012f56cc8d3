"use strict";
const chooser = document.getElementById("run");
const panels = [...document.querySelectorAll("#overlays svg")];

function show() {
  panels.forEach((panel, k) => panel.classList.toggle("shown", k === chooser.selectedIndex));
}

if (chooser) {
  const step = (by) => {
    chooser.selectedIndex = (chooser.selectedIndex + by + panels.length) % panels.length;
    show();
  };
  chooser.addEventListener("change", show);
  document.getElementById("earlier").addEventListener("click", () => step(-1));
  document.getElementById("later").addEventListener("click", () => step(1));
  show(); // a page that is loaded again keeps what was chosen
  for (const row of document.querySelectorAll("tr[data-run]")) {
    row.addEventListener("click", () => {
      const words = [...chooser.options].map((o) => o.text.split(/[\s,]+/));
      const k = words.findIndex((w) => w.includes(row.dataset.run) && w.includes(row.dataset.signal));
      if (k < 0) return;
      chooser.selectedIndex = k;
      show();
      document.getElementById("error").scrollIntoView({ behavior: "smooth" });
    });
  }
}

window.addEventListener("beforeprint", () => {
  for (const fold of document.querySelectorAll("details")) fold.open = true;
});
