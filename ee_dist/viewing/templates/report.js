// Draws what comes into sight, follows light and dark, narrow and wide, and saves tables; asks nobody for anything.
(() => {
  "use strict";
  const root = document.documentElement;
  const system = window.matchMedia("(prefers-color-scheme: dark)");
  let printing = false;
  const dark = () => !printing && (root.dataset.theme ? root.dataset.theme === "dark" : system.matches);
  const ink = () => (printing ? "#000" : getComputedStyle(root).getPropertyValue("--ink").trim());
  const paper = () => (printing ? "#fff" : getComputedStyle(root).getPropertyValue("--paper").trim());
  const grid = () => (dark() ? "#35404c" : "#e3e8ee");
  const narrow = (box) => box.clientWidth < 520;

  // What a figure looks like here and now: colours of the theme, and on a narrow page less beside the data.
  function looks(box, layout) {
    const changed = {
      "font.color": ink(), "hoverlabel.bgcolor": paper(), "hoverlabel.font.color": ink(), "hoverlabel.bordercolor": grid(),
      "font.size": narrow(box) ? 10 : 12,
    };
    for (const key of Object.keys(layout)) {
      if (/^[xy]axis\d*$/.test(key)) {
        changed[key + ".gridcolor"] = grid();
        changed[key + ".zerolinecolor"] = dark() ? "#566473" : "#b9c4cf";
      }
    }
    const meta = layout.meta || {};
    return Object.assign(changed, meta[dark() ? "dark" : "light"], meta[narrow(box) ? "narrow" : "wide"]);
  }
  const drawn = new Set();
  function draw(box) {
    if (drawn.has(box)) return;
    drawn.add(box);
    const spec = JSON.parse(box.querySelector("script").textContent);
    Plotly.newPlot(box, spec.data, spec.layout, CONFIG).then(() => Plotly.relayout(box, looks(box, spec.layout)));
  }
  function again() {
    for (const box of drawn) if (box.layout) Plotly.relayout(box, looks(box, box.layout));
  }

  // Measured over predicted, and their distance below, for any channel and trial.
  const COLOURS = ["#4a90d9", "#e08a00", "#2e9e62"];
  function browse(part) {
    const all = JSON.parse(part.querySelector("script").textContent);
    const [channel, trial] = [part.querySelector(".channel"), part.querySelector(".trial")];
    const [box, said] = [part.querySelector(".picked"), part.querySelector("output")];
    const option = (k, name) => new Option(name, k);
    const channels = [...new Set(all.cells.map((cell) => cell.c))];
    channel.replaceChildren(...channels.map((k) => option(k, all.channels[k])));
    let at = 0;
    function show() {
      const cell = all.cells[at];
      const unit = cell.u === "1" ? "" : cell.u;
      const own = all.cells.filter((other) => other.c === cell.c).map((other) => other.t);
      trial.replaceChildren(...own.sort((a, b) => a - b).map((k) => option(k, all.trials[k])));
      channel.value = cell.c;
      trial.value = cell.t;
      said.textContent = `${at + 1} of ${all.cells.length}, ordered by error`;
      const data = [];
      cell.y.forEach((values, k) => {
        const name = k ? all.names[k - 1] : "measured";
        data.push({ x: cell.x, y: values, name, mode: "lines", legendgroup: name, opacity: k ? 1 : 0.7,
          line: { color: COLOURS[k], width: k ? 1.5 : 3 } });
        if (!k) return;
        const rest = values.map((v, i) => (v === null || cell.y[0][i] === null ? null : cell.y[0][i] - v));
        data.push({ x: cell.x, y: rest, name: "measured - " + name, mode: "lines", legendgroup: name, showlegend: false,
          yaxis: "y2", line: { color: COLOURS[k], width: 1 } });
      });
      const layout = { height: 460, margin: { l: 60, r: 14, t: 34, b: 40 }, paper_bgcolor: "rgba(0,0,0,0)",
        plot_bgcolor: "rgba(0,0,0,0)", modebar: { bgcolor: "rgba(0,0,0,0)", color: "#8899aa" }, hovermode: "x unified", showlegend: true,
        legend: { orientation: "h", y: 1, yanchor: "bottom", x: 0 },
        xaxis: { title: { text: "s" }, anchor: "y2" }, yaxis: { domain: [0.42, 1], title: { text: unit } },
        yaxis2: { domain: [0, 0.34], title: { text: unit ? "residual, " + unit : "residual" } } };
      Plotly.react(box, data, layout, CONFIG).then(() => Plotly.relayout(box, looks(box, layout)));
      drawn.add(box);
    }
    function pick() {
      const wanted = all.cells.findIndex((cell) => cell.c === +channel.value && cell.t === +trial.value);
      at = wanted >= 0 ? wanted : all.cells.findIndex((cell) => cell.c === +channel.value);
      show();
    }
    channel.addEventListener("change", pick);
    trial.addEventListener("change", pick);
    const step = (by) => () => { at = (at + by + all.cells.length) % all.cells.length; show(); };
    part.querySelector(".back").addEventListener("click", step(-1));
    part.querySelector(".on").addEventListener("click", step(1));
    if (all.cells.length) show();
  }

  function quoted(text) {
    const plain = text.trim();
    return /[",;\n]/.test(plain) ? '"' + plain.replaceAll('"', '""') + '"' : plain;
  }
  function save(table) {
    const lines = [...table.rows].map((row) => [...row.cells].map((cell) => quoted(cell.textContent)).join(","));
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob(["\ufeff" + lines.join("\r\n") + "\r\n"], { type: "text/csv" }));
    link.download = table.dataset.name + ".csv";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  for (const button of document.querySelectorAll("button.csv")) {
    button.addEventListener("click", () => save(button.previousElementSibling.querySelector("table")));
  }

  const started = new Set();
  function start(box) {
    if (started.has(box)) return;
    started.add(box);
    if (box.classList.contains("browser")) browse(box); else draw(box);
  }
  const boxes = [...document.querySelectorAll(".plot, .browser")];
  const sight = new IntersectionObserver(
    (seen) => { for (const entry of seen) if (entry.isIntersecting) start(entry.target); }, { rootMargin: "600px" });
  boxes.forEach((box) => sight.observe(box));

  document.getElementById("theme").addEventListener("click", () => {
    root.dataset.theme = dark() ? "light" : "dark";
    again();
  });
  system.addEventListener("change", again);
  let width = window.innerWidth;
  window.addEventListener("resize", () => {
    if (window.innerWidth !== width) { width = window.innerWidth; again(); }
  });
  const closed = [];
  window.addEventListener("beforeprint", () => {
    printing = true;
    for (const part of document.querySelectorAll("details:not([open])")) { part.open = true; closed.push(part); }
    boxes.forEach(start);
    again();
  });
  window.addEventListener("afterprint", () => {
    printing = false;
    for (const part of closed.splice(0)) part.open = false;
    again();
  });
})();
