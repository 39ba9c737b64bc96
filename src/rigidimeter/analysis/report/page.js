"use strict";
// The words of a point beside the pointer, and the traces of its epoch in a dialog.
(() => {
  const tip = document.getElementById("tip");
  const dialog = document.getElementById("epoch");
  const PANELS = [["torque", "Torque (N·m)", 220], ["residual", "Measured less model (N·m)", 130],
    ["angle", "Angle (deg)", 130]];
  let epochs = null;
  let shown = 0;
  let plots = [];

  for (const point of document.querySelectorAll(".canvas use:has(title)")) {
    // The browser's own tip would cover this one.
    point.dataset.words = point.querySelector("title").textContent;
    point.replaceChildren();
  }

  addEventListener("pointerover", (event) => {
    const words = event.target.dataset?.words;
    tip.hidden = !words;
    if (!words) return;
    tip.textContent = words + (event.target.dataset.epoch ? " – click for its traces" : "");
    const box = tip.getBoundingClientRect();
    tip.style.left = `${Math.max(4, Math.min(event.clientX + 12, innerWidth - box.width - 4))}px`;
    tip.style.top = `${event.clientY > innerHeight / 2 ? event.clientY - box.height - 10 : event.clientY + 14}px`;
  });

  function numbers([unit, text]) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Array.from({ length: bytes.length / 2 }, (_, k) => unit * view.getInt16(2 * k, true));
  }

  function draw(place) {
    epochs ??= JSON.parse(document.getElementById("traces").textContent);
    shown = (place + epochs.length) % epochs.length;
    const epoch = epochs[shown];
    dialog.querySelector(".title").textContent = epoch.title;
    dialog.querySelector(".remark").textContent = epoch.words;
    for (const plot of plots) plot.destroy();
    plots = [];
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const into = dialog.querySelector(".plots");
    const axis = { stroke: colour("ink"), grid: { stroke: colour("line"), width: 1 },
      ticks: { stroke: colour("line") }, font: "11px system-ui, sans-serif" };
    const line = (label, name, width, alpha = "") => ({ label, stroke: colour(name) + alpha, width, points: { show: false },
      value: (_, value) => value == null ? "–" : value.toPrecision(3) });
    const shade = (plot) => {
      plot.ctx.fillStyle = colour("line");
      for (const [start, stop] of epoch.active ?? []) {
        const [left, right] = [start, stop].map((time) => Math.min(Math.max(plot.valToPos(time, "x", true),
          plot.bbox.left), plot.bbox.left + plot.bbox.width));
        plot.ctx.fillRect(left, plot.bbox.top, right - left, plot.bbox.height);
      }
    };
    for (const [name, title, height] of PANELS) {
      if (!epoch[name]) continue;
      const values = numbers(epoch[name]);
      const time = values.map((_, k) => epoch.start + k * epoch.step);
      const data = [time, values];
      const series = [{ label: "time of the epoch (s)", value: (_, value) => value == null ? "–" : value.toFixed(3) }];
      if (name === "torque" && epoch.residual) {
        const residual = numbers(epoch.residual);
        data.push(values.map((value, k) => value - residual[k]));
        series.push(line("measured", "soft", 4, "66"), line("model", "dbs", 1.2));
      } else {
        series.push(line(name === "torque" ? "measured" : name, "soft", 1.5));
      }
      plots.push(new uPlot({ title, width: into.clientWidth - 4, height, series,
        hooks: { drawClear: [shade] }, scales: { x: { time: false } }, cursor: { sync: { key: "epoch", setSeries: false } },
        axes: [{ ...axis, size: 30 }, { ...axis, size: 60, space: 25 }] }, data, into));
    }
  }

  addEventListener("click", (event) => {
    const place = event.target.closest?.("[data-epoch]")?.dataset.epoch;
    if (place === undefined) return;
    tip.hidden = true;
    dialog.showModal();
    draw(Number(place));
  });
  for (const button of dialog.querySelectorAll("[data-step]")) {
    button.addEventListener("click", () => draw(shown + Number(button.dataset.step)));
  }
})();
