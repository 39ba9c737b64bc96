// What the operator's page draws: the live signals, and those of a recorded epoch with their spectra.
"use strict";
window.rigTraces = (() => {
  const WINDOW_S = 10, PIECE = 15;  // numbers for each piece of time, see `points` of the server
  const PANES = ["torque [N·m]", "angle [deg]", "velocity command [deg/s]", "perturbation [N·m]", "drive's torque [N·m]"];
  const PERTURBATION = 3, DRIVE = 4;
  const DASHES = [[], [8, 4], [2, 3]];  // lines are told apart by their dashes too
  const EMG_OLD_S = 0.5, GAP_S = 1e-3, MARKS = ["—", "– –", "···"];
  const TITLE_PX = 22, TIME_AXIS_PX = 52, FONT = "14px system-ui", LABEL = { labelFont: FONT, labelSize: 20 };
  const $ = (id) => document.getElementById(id);
  const colour = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
  let data, band, loop, fresh = false, driven = false, plots = [], task = "", muscles = [], envelope = [[]], epoch = null, epochPlots = [], epochWidth = 0;

  function clear() { data = [[], [], [], [], [], []]; band = [[], [], []]; loop = [[], [], []]; envelope = [[], ...muscles.map(() => [])]; fresh = true; }

  function samples(buffer) {
    const numbers = new Float64Array(buffer), number = (at) => (Number.isFinite(numbers[at]) ? numbers[at] : null);
    for (let at = 0; at < numbers.length; at += PIECE) {
      const time = numbers[at];
      data[0].push(time, time);
      for (let k = 1; k < 6; k++) data[k].push(number(at + k), number(at + 5 + k));
      for (let k = 0; k < 3; k++) band[k].push(k ? number(at + 12 + k) : time);
      const reports = number(at + 1 + DRIVE) !== null;
      if (reports && !driven) { driven = true; plot(); }  // only of a drive that measures its torque
      if (number(at + 11) === null || number(at + 12) === null) continue;  // a rest
      if (loop[0].length && time - loop[0][loop[0].length - 1] > 0.5) loop = [[], [], []];  // another epoch
      for (let k = 0; k < 3; k++) loop[k].push(k ? number(at + 10 + k) : time);
    }
    forget([data, band, loop]);
  }

  function forget(all) {
    for (const columns of all) {
      const times = columns[0], from = times[times.length - 1] - WINDOW_S;
      let old = 0;
      while (old < times.length && times[old] < from) old++;
      if (old) for (const one of columns) one.splice(0, old);
    }
    fresh = true;
  }

  // The envelope of each muscle, of points that hold the time and then the muscles.
  function emg(sent) {
    if (sent.muscles.join("\n") !== muscles.join("\n")) {
      muscles = sent.muscles;
      envelope = [[], ...muscles.map(() => [])];
      plot();
    }
    const last = () => envelope[0][envelope[0].length - 1], now = data[0][data[0].length - 1];
    const add = (point) => point.forEach((value, k) => envelope[k].push(value));
    for (const point of sent.points) if (!(point[0] <= last())) add(point);
    // Missing: a gap, and no value. What comes later, as of a source that sends long blocks, is drawn behind it.
    const values = envelope[muscles.length ? 1 : 0];
    if (now - last() > EMG_OLD_S && values[values.length - 1] !== null) add([last() + GAP_S, ...muscles.map(() => null)]);
    forget([envelope]);
  }

  function newest(values) {
    const value = values.length ? values[values.length - 1] : null;
    return value === null ? "" : `: ${value.toFixed(2)}`;
  }

  function axes(x, y, size) {
    const line = colour("--line"), axis = { stroke: colour("--ink"), grid: { stroke: line, width: 0.5 }, ticks: { stroke: line }, font: FONT };
    return [{ ...axis, ...LABEL, size: 32, ...x }, { ...axis, size, space: 22, ...y }];
  }

  function pane(parent, title, className = "pane") {
    const made = document.createElement("div"), name = document.createElement("div");
    made.className = className;
    name.className = "pane-title";
    name.textContent = title;
    made.append(name);
    parent.append(made);
    return made;
  }

  // In a sinusoid there is no perturbation, and one frequency does not tell J from K.
  function plot() {
    for (const one of plots) one.destroy();
    plots = [];
    const cyclic = task === "sinusoid";
    $("panes").replaceChildren();
    $("panes").className = cyclic ? "with-loop" : "";
    const add = (at, columns, series, timed) => {
      const made = new uPlot({
        width: 200, height: 90, padding: [6, 10, 0, 0], cursor: { show: false }, legend: { show: false },
        scales: { x: { time: false, range: (_, low, high) => [Math.max(0, high - WINDOW_S), Math.max(WINDOW_S, high)] } },
        axes: axes(timed ? { label: "time of the session [s]" } : { size: 4, values: () => [] }, {}, 56),
        series: [{}, ...series.map((one) => ({ stroke: colour("--accent"), width: 1.5, points: { show: false }, ...one }))],
      }, columns(), at);
      made.rig = { columns, timed };
      plots.push(made);
    };
    const shown = [0, 1, 2, PERTURBATION, DRIVE].filter((at) => (at === PERTURBATION ? !cyclic : at !== DRIVE || driven));
    const last = shown[shown.length - 1];
    for (const at of shown) {
      const made = pane($("panes"), PANES[at]), torque = at === 0 || at === DRIVE;
      add(made, () => [data[0], data[at + 1]], [{}], cyclic && at === last && !muscles.length);
      if (torque) plots[plots.length - 1].rig.said = () => { made.firstChild.firstChild.data = PANES[at] + newest(data[at + 1]); };
    }
    if (muscles.length) emgPlot(add, cyclic);
    if (cyclic) plots.push(loopPlot(pane($("panes"), "torque [N·m] over angle [deg], last 10 s", "pane loop")));
    else {
      const at = pane($("panes"), "band torque [N·m]: "), said = document.createElement("span");
      said.id = "band-model";
      at.firstChild.append(said);
      add(at, () => band, [{ width: 5, stroke: colour("--measured") }, { width: 1.5, stroke: colour("--ink") }], true);
    }
    resize();
  }

  function emgPlot(add, timed) {
    const made = pane($("panes"), "EMG envelope [µV]:"), colours = ["--accent", "--bad", "--ok"].map(colour);
    const lines = muscles.map((_, k) => ({ stroke: colours[(k + Math.floor(k / 3)) % 3], dash: DASHES[k % 3] }));
    const names = lines.map((line) => {
      const name = document.createElement("span");
      name.style.color = line.stroke;
      made.firstChild.append(" ", name);
      return name;
    });
    add(made, () => envelope, lines, timed);
    plots[plots.length - 1].rig.said = () => names.forEach((name, k) => { name.textContent = `${MARKS[k % 3]} ${muscles[k]}${newest(envelope[k + 1])}`; });
  }

  function loopPlot(at) {
    const line = colour("--accent"), newest = colour("--ink");
    const path = (u, k) => {
      uPlot.orient(u, k, (series, xs, ys, xScale, yScale, toX, toY, left, top, width, height) => {
        const [angles, torques] = u.data[k], context = u.ctx, last = angles.length - 1;
        if (last < 0) return;
        const x = (n) => toX(angles[n], xScale, width, left), y = (n) => toY(torques[n], yScale, height, top);
        context.save();
        context.beginPath();
        angles.forEach((_, n) => context.lineTo(x(n), y(n)));
        context.strokeStyle = line;
        context.lineWidth = 1.5 * devicePixelRatio;
        context.stroke();
        context.beginPath();
        context.arc(x(last), y(last), 6 * devicePixelRatio, 0, 2 * Math.PI);
        context.fillStyle = newest;
        context.fill();
        context.restore();
      });
      return null;
    };
    const range = (k) => () => (loop[k].length ? uPlot.rangeNum(Math.min(...loop[k]), Math.max(...loop[k]), 0.1, true) : [-1, 1]);
    const columns = () => [null, [loop[1], loop[2]]];
    const made = new uPlot({
      mode: 2, width: 200, height: 200, padding: [6, 10, 0, 0], cursor: { show: false }, legend: { show: false },
      scales: { x: { time: false, range: range(1) }, y: { range: range(2) } },
      axes: axes({ label: "angle [deg]" }, {}, 56),
      series: [{}, { paths: path, points: { show: false } }],
    }, columns(), at);
    made.rig = { columns, square: true };
    return made;
  }

  function resize() {
    requestAnimationFrame(() => {
      if ($("epoch-panes").clientWidth !== epochWidth) drawEpoch();
      const narrow = innerWidth <= 1100, timed = plots.filter((one) => !one.rig.square).length;
      const room = innerHeight - $("panes").getBoundingClientRect().top - scrollY - 12;
      for (const one of plots) {
        const width = Math.max(200, one.root.parentNode.clientWidth);
        one.rig.size = one.rig.square
          ? { width, height: Math.min(width, Math.max(260, narrow ? 0.42 * room : room - TITLE_PX)) }
          : { width, height: TIME_AXIS_PX * Boolean(one.rig.timed) };
      }
      const square = plots.find((one) => one.rig.square);
      const left = room - TIME_AXIS_PX - (narrow && square ? square.rig.size.height + TITLE_PX : 0);
      for (const one of plots) {
        if (!one.rig.square) one.rig.size.height += Math.max(64, Math.floor(left / timed) - TITLE_PX);
        one.setSize(one.rig.size);
      }
    });
  }

  function draw() {
    if (fresh && document.body.dataset.view === "during" && !document.hidden) {
      fresh = false;
      for (const one of plots) {
        one.setData(one.rig.columns());
        if (one.rig.said) one.rig.said();
      }
      window.rigDrawnS = data[0].length ? data[0][data[0].length - 1] : null;
    }
    requestAnimationFrame(draw);
  }

  function drawEpoch() {
    epochWidth = $("epoch-panes").clientWidth;
    if (epoch === null || !epochWidth) return;  // it is drawn when it is looked at
    const at = $("epoch-panes"), colours = ["--accent", "--bad", "--ok"].map(colour);
    for (const one of epochPlots) one.destroy();
    epochPlots = [];
    at.replaceChildren(Object.assign(document.createElement("h2"), { textContent: epoch.title }));
    const add = (title, names, data, label, last, log) => {
      const made = pane(at, title), decades = { filter: (_, splits) => splits.map((v) => (Number.isInteger(Math.log10(v)) ? v : null)) };
      const number = { ...decades, values: (_, splits) => splits.map((v) => (v === null ? "" : String(Number(v.toPrecision(6))))) };
      const axis = log ? { ...number, grid: { stroke: colour("--line"), width: 0.5, ...decades }, ticks: { stroke: colour("--line"), ...decades } } : {};
      const scale = log ? { distr: 3 } : {};
      if (data[0].length) epochPlots.push(new uPlot({
        width: made.clientWidth, height: last ? 260 : 180, padding: [6, 14, 0, 0], legend: { show: names.length > 1 },
        scales: { x: { time: false, ...scale, range: (_, low, high) => [low, high] }, y: scale },
        axes: axes({ ...axis, label: last ? label : undefined }, axis, 66),
        series: [{ label }, ...names.map((name, j) => ({ label: name, stroke: colours[j], dash: DASHES[j], width: 1.5, points: { show: false } }))],
      }, data, made));
    };
    epoch.panes.forEach((one, k) => {
      const last = k === epoch.panes.length - 1;
      add(one.title, one.names, one.data, "time of the session [s]", last, false);
      add(one.spectrum.title, one.names, one.spectrum.data, "frequency [Hz]", last, true);
    });
  }

  window.rigEpoch = (title, panes) => {
    epoch = { title, panes };
    drawEpoch();
    $("epoch-panes").scrollIntoView();
  };

  function begin() {
    clear();
    plot();
    addEventListener("resize", resize);
    new MutationObserver(() => { plot(); drawEpoch(); }).observe(document.body, { attributes: true, attributeFilter: ["class"] });
    requestAnimationFrame(draw);
  }

  return { begin, clear, samples, emg, resize, task: (name) => { if (name !== task) { task = name; plot(); } } };
})();
