// The operator's page: beats, orders, samples and state, over one socket to the server.
// The server takes no beat from anybody else, so a page that is closed, frozen or cut off is silent.
"use strict";
(() => {
  const BEAT_MS = 50, STATE_OLD_MS = 1500, WINDOW_S = 10;
  const PANES = [["torque", "N·m"], ["angle", "deg"], ["velocity command", "deg/s"], ["perturbation", "N·m"]];
  const SIGNS = { ok: "✓", warn: "!", bad: "✗", off: "–" };
  const $ = (id) => document.getElementById(id);
  const random = () => Array.from(crypto.getRandomValues(new Uint8Array(18)), (b) => b.toString(16).padStart(2, "0")).join("");
  const tab = sessionStorage.getItem("rig-tab") || random();
  sessionStorage.setItem("rig-tab", tab);
  let page = "", socket = null, control = false, away = false, heard = 0, rated = null, seen = null, plots = [];
  let data = [[], [], [], [], []], fresh = false;

  const say = (message) => { if (socket && socket.readyState === 1) socket.send(JSON.stringify(message)); };
  const show = (id, text) => { const at = $(id); if (at && at.textContent !== text) at.textContent = text; };
  const node = (name, className, text) => { const made = document.createElement(name); made.className = className; if (text) made.textContent = text; return made; };
  const connected = () => socket && socket.readyState === 1 && performance.now() - heard < STATE_OLD_MS;

  function connect() {
    const at = location.protocol === "https:" ? "wss://" : "ws://";
    socket = new WebSocket(at + location.host + "/live");
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { heard = performance.now(); say({ kind: "hello", page, tab }); };
    socket.onmessage = (event) => typeof event.data === "string" ? told(JSON.parse(event.data)) : samples(event.data);
    socket.onclose = () => { control = false; setTimeout(connect, 200); };
  }

  function view(name) {
    document.body.dataset.view = name;
    for (const one of document.querySelectorAll(".tab")) {
      if (one.dataset.view === name) one.setAttribute("aria-current", "page"); else one.removeAttribute("aria-current");
    }
    if (name === "during") resize();
  }

  function told(message) {
    heard = performance.now();
    if (message.say) return remark(message.say);
    control = message.control;
    const { session, finished, starting } = message.state;
    $("take").hidden = control;
    show("role", control ? "" : "this page can only look");
    $("emergency").disabled = !(control && session);
    $("save-form").hidden = !(control && session && session.save);
    const can = session ? session.orders : [];
    for (const one of document.querySelectorAll("[data-order]")) one.disabled = !control || !can.includes(one.dataset.order);
    for (const one of document.querySelectorAll("#note-form *, #rating-form *")) one.disabled = !control || !session;
    if (session) return during(session);
    show("state", starting ? `starting ${starting} …` : finished ? `ended: ${finished.outcome}` : "no session runs");
    const key = finished ? `ended ${finished.number}` : starting ? `starting ${starting}` : "";
    if (seen !== key) {
      if (finished && seen !== null) view("after");
      if (starting) { view("during"); clear(); }
      seen = key;
    }
    banner(finished ? finished.sentences.join(" ") : "");
  }

  function during(session) {
    if (seen !== `runs ${session.number}`) { seen = `runs ${session.number}`; clear(); view("during"); }
    show("state", session.state);
    show("condition", session.condition);
    show("epoch", session.epoch);
    show("epoch-label", session.epoch_of);
    show("countdown", session.countdown);
    show("countdown-label", session.countdown_of);
    lines("counts", session.counts.map((text) => ["", text]));
    lines("live", session.live.map((text) => ["", text]));
    show("live-of", session.live_of && `of ${session.live_of}`);
    banner(session.alert);
    const lamps = $("lamps");
    while (lamps.children.length > session.lamps.length) lamps.lastChild.remove();
    session.lamps.forEach(({ level, text }, at) => {
      let lamp = lamps.children[at];
      if (!lamp) { lamp = node("div", "lamp"); lamp.append(node("b", ""), node("span", "")); lamps.append(lamp); }
      lamp.className = `lamp ${level}`;
      lamp.firstChild.textContent = SIGNS[level];
      lamp.lastChild.textContent = text;
    });
    const limits = $("limits");
    session.limits.forEach(({ name, text, part, near }, at) => {
      let row = limits.children[at];
      if (!row) {
        row = node("div", "limit");
        const track = node("div", "track");
        track.append(document.createElement("i"));
        row.append(node("span", "", name), track, node("span", ""));
        limits.append(row);
      }
      row.className = near ? "limit near" : "limit";
      row.children[1].firstChild.style.width = `${Math.min(100, 100 * part)}%`;
      row.lastChild.textContent = (near ? "! " : "") + text;
    });
    rated = session.rate;
    show("rated", rated === null ? "after the first epoch" : `epoch ${rated.place}`);
  }

  function lines(id, rows) {
    const at = $(id), text = JSON.stringify(rows);
    if (at.dataset.text === text) return;
    at.dataset.text = text;
    at.replaceChildren(...rows.map(([className, one]) => node("div", className, one)));
  }

  function banner(text) { const at = $("banner"); at.hidden = !text; if (at.textContent !== text) at.textContent = text; }
  function remark(text) { const at = $("said"); at.prepend(node("div", "", text)); while (at.children.length > 4) at.lastChild.remove(); }
  function clear() { data = [[], [], [], [], []]; fresh = true; $("said").replaceChildren(); $("limits").replaceChildren(); }

  function samples(buffer) {
    const points = new Float64Array(buffer);
    for (let at = 0; at < points.length; at += 5) for (let k = 0; k < 5; k++) data[k].push(points[at + k]);
    const times = data[0], from = times[times.length - 1] - WINDOW_S;
    let old = 0;
    while (old < times.length && times[old] < from) old++;
    if (old) for (const one of data) one.splice(0, old);
    fresh = true;
  }

  function plot() {
    const ink = getComputedStyle(document.body).getPropertyValue("--ink").trim();
    const line = getComputedStyle(document.body).getPropertyValue("--line").trim();
    const accent = getComputedStyle(document.body).getPropertyValue("--accent").trim();
    for (const one of plots) one.destroy();
    $("panes").replaceChildren();
    plots = PANES.map(([name, unit], at) => {
      const axis = { stroke: ink, grid: { stroke: line, width: 0.5 }, ticks: { stroke: line }, font: "14px system-ui" };
      const pane = node("div", "pane");
      pane.append(node("div", "pane-title", `${name} [${unit}]`));
      $("panes").append(pane);
      const last = at === PANES.length - 1;
      return new uPlot({
        ...size(last), cursor: { show: false }, legend: { show: false },
        scales: { x: { time: false, range: (_, low, high) => [Math.max(0, high - WINDOW_S), Math.max(WINDOW_S, high)] } },
        axes: [last ? { ...axis, label: "time of the session [s]", labelSize: 18, size: 26 } : { ...axis, size: 4, values: () => [] },
               { ...axis, size: 56 }],
        series: [{}, { stroke: accent, width: 1.5, points: { show: false } }],
      }, [data[0], data[at + 1]], pane);
    });
  }
  function size(last) {
    const room = innerHeight - $("panes").getBoundingClientRect().top - scrollY - 16 - 40 - PANES.length * 22;
    return { width: Math.max(200, $("panes").clientWidth), height: Math.max(90, Math.floor(room / PANES.length)) + (last ? 40 : 0) };
  }
  function resize() { requestAnimationFrame(() => plots.forEach((one, at) => one.setSize(size(at === PANES.length - 1)))); }

  function draw() {
    if (fresh && document.body.dataset.view === "during" && !document.hidden) {
      fresh = false;
      plots.forEach((one, at) => one.setData([data[0], data[at + 1]]));
      window.rigDrawnS = data[0].length ? data[0][data[0].length - 1] : null;
    }
    requestAnimationFrame(draw);
  }

  // Lines are told apart by their dashes too.
  const DASHES = [[], [8, 4], [2, 3]];
  window.rigEpoch = (title, panes) => {
    const style = getComputedStyle(document.body), ink = style.getPropertyValue("--ink").trim();
    const colours = ["--accent", "--bad", "--ok"].map((name) => style.getPropertyValue(name).trim());
    const at = $("epoch-panes");
    at.replaceChildren(node("h2", "", title));
    panes.forEach((one, k) => {
      at.append(node("div", "pane-title", one.title));
      const axis = { stroke: ink, grid: { stroke: style.getPropertyValue("--line").trim(), width: 0.5 }, font: "14px system-ui" };
      new uPlot({
        width: at.clientWidth, height: k === panes.length - 1 ? 240 : 150, scales: { x: { time: false } },
        legend: { show: one.names.length > 1 },
        axes: [{ ...axis, label: k === panes.length - 1 ? "time of the session [s]" : undefined }, { ...axis, size: 60 }],
        series: [{ label: "time [s]" }, ...one.names.map((label, j) => ({ label, stroke: colours[j], dash: DASHES[j], width: 1.5, points: { show: false } }))],
      }, one.data, at);
    });
    at.scrollIntoView();
  };

  function leave() { away = true; say({ kind: "leave" }); }
  function note(what, text) { say({ kind: "note", what, text, by: "" }); remark(`${what}: ${text}`); }
  function emergency() { say({ kind: "emergency" }); if (control) remark("emergency stop"); }

  function score(text) {
    const plain = text.trim().replace("−", "-");
    if (!/^[-+]?\d+([.,]\d{1,2})?$/.test(plain)) return null;
    return Number(plain.replace(",", "."));
  }

  function begin() {
    page = document.querySelector("meta[name=rig-page]").content;
    for (const one of document.querySelectorAll(".tab")) one.onclick = () => view(one.dataset.view);
    for (const one of document.querySelectorAll("[data-order]")) one.onclick = () => say({ kind: "order", command: one.dataset.order });
    $("emergency").onpointerdown = emergency;
    $("emergency").onclick = (event) => { if (event.detail === 0) emergency(); };
    addEventListener("keydown", (event) => { if (event.key === "Escape") emergency(); }, true);
    $("take").onclick = () => socket.close();
    $("note-form").onsubmit = (event) => { event.preventDefault(); if ($("note").value.trim()) note("note", $("note").value); $("note").value = ""; };
    $("save-form").onsubmit = (event) => { event.preventDefault(); say({ kind: "save", folder: $("save-folder").value }); };
    $("mark").onclick = () => note("mark", "moment marked");
    $("rating-form").onsubmit = (event) => {
      event.preventDefault();
      const value = score($("score").value), by = $("examiner").value.trim();
      if (rated === null) return remark("there is no epoch to rate yet");
      if (value === null) return remark(`${$("score").value || "an empty score"} is no score: write a number like 1.5 or 1,5`);
      if (!by) return remark("a rating needs the examiner's name or code");
      say({ kind: "note", what: "rating", text: "", by, epoch: rated.number, score: value });
      remark(`rating of epoch ${rated.place}: ${value} by ${by}`);
      $("score").value = "";
    };
    addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", () => { if (document.hidden) leave(); else away = false; });
    addEventListener("pageshow", () => { away = false; });
    addEventListener("resize", resize);
    new MutationObserver(plot).observe(document.body, { attributes: true, attributeFilter: ["class"] });
    setInterval(() => {
      const fine = connected();
      if (fine && !away) say({ kind: "beat" });
      if (!fine) banner("The connection to the program is lost. The arm is stopped without it; look at the arm, then reload this page.");
    }, BEAT_MS);
    view("before");
    plot();
    connect();
    requestAnimationFrame(draw);
  }

  const waiting = setInterval(() => {
    if (!$("view-during") || !$("view-before") || !$("view-after")) return;
    clearInterval(waiting);
    begin();
  }, 20);
})();
