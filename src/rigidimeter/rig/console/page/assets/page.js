// The operator's page: beats, orders and state, over one socket to the server; traces.js draws.
// The server takes no beat from anybody else, so a page that is closed, frozen or cut off is silent.
"use strict";
(() => {
  const BEAT_MS = 50, STATE_OLD_MS = 1500, traces = window.rigTraces, tones = window.rigTones;
  const $ = (id) => document.getElementById(id);
  const random = () => Array.from(crypto.getRandomValues(new Uint8Array(18)), (b) => b.toString(16).padStart(2, "0")).join("");
  const tab = sessionStorage.getItem("rig-tab") || random();
  sessionStorage.setItem("rig-tab", tab);
  let page = "", socket = null, control = false, away = false, heard = 0, rated = null, seen = null, asked = null;
  let led = false, runs = false, silent = false, alarmed = null;

  const say = (message) => { if (socket && socket.readyState === 1) socket.send(JSON.stringify(message)); };
  const node = (name, className, text) => { const made = document.createElement(name); made.className = className; if (text) made.textContent = text; return made; };
  // What changes ten times a second is written into nodes that stay: Chromium's memory rises with each one that is replaced.
  const write = (at, text) => { if (!at.firstChild) at.append(text); else if (at.firstChild.data !== text) at.firstChild.data = text; };
  const named = (at, className) => { if (at.className !== className) at.className = className; };
  const show = (id, text) => { const at = $(id); if (at) write(at, text); };
  const fill = (at, rows, make, tell) => {
    while (at.children.length > rows.length) at.lastChild.remove();
    rows.forEach((one, k) => tell(at.children[k] || at.appendChild(make(one)), one));
  };
  const connected = () => socket && socket.readyState === 1 && performance.now() - heard < STATE_OLD_MS;

  function connect() {
    const at = "ws://";
    socket = new WebSocket(at + location.host + "/live");
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { heard = performance.now(); say({ kind: "hello", page, tab }); };
    socket.onmessage = (event) => typeof event.data === "string" ? told(JSON.parse(event.data)) : traces.samples(event.data);
    socket.onclose = () => { control = false; alarmed = null; noted(false); setTimeout(connect, 200); };
  }

  function view(name) {
    document.body.dataset.view = name;
    for (const one of document.querySelectorAll(".tab")) {
      if (one.dataset.view === name) one.setAttribute("aria-current", "page"); else one.removeAttribute("aria-current");
    }
    traces.resize();
  }

  // A view that comes by itself takes the keyboard's place with it, to where Enter does no harm.
  function come(name) {
    view(name);
    const at = document.activeElement;
    if (!at || at === document.body || at.offsetParent === null) document.querySelector(`.tab[data-view=${name}]`).focus({ preventScroll: true });
  }

  function told(message) {
    heard = performance.now();
    if (message.noted !== undefined) noted(message.noted);
    if (message.say) return remark(message.say);
    if (!message.state) return;
    control = led = message.control;
    const { session, finished, starting, checking, alarms } = message.state;
    runs = !!(session || checking || starting);
    $("take").hidden = control;
    show("role", control ? "" : "watching: it can only stop");
    $("emergency").disabled = !runs;
    hear(alarms);
    if (!session) hush(false);
    $("silence").hidden = !session;
    $("save-form").hidden = !(control && session && session.save);
    const can = session ? session.orders : [];
    for (const one of document.querySelectorAll("[data-order]")) one.disabled = !control || !can.includes(one.dataset.order);
    for (const one of document.querySelectorAll("#note-form *, #rating-form *")) one.disabled = !control || !session;
    if (session) return during(session);
    noted(false);
    show("state", starting ? `starting ${starting} …` : checking ? checking : finished ? `ended: ${finished.outcome}` : "no session runs");
    const key = finished ? `ended ${finished.number}` : starting ? `starting ${starting}` : "";
    if (seen !== key) {
      if (finished && seen !== null) come("after");
      if (starting) { come("during"); clear(); }
      seen = key;
    }
    banner(finished ? finished.sentences.join("\n") : "", finished && finished.outcome === "success");
  }

  function during(session) {
    if (seen !== `runs ${session.number}`) { seen = `runs ${session.number}`; clear(); hush(false); come("during"); }
    show("state", session.state);
    show("condition", session.condition);
    show("epoch", session.epoch);
    show("epoch-label", session.epoch_of);
    show("countdown", session.countdown);
    show("countdown-label", session.countdown_of);
    for (const id of ["counts", "live"]) fill($(id), session[id], () => node("div", ""), write);
    show("live-of", session.live_of ? `of ${session.live_of}` : "");
    traces.task(session.task);
    traces.emg(session.emg || { muscles: [], points: [] });
    show("band-model", session.modelled ? "thick measured, thin modelled" : "measured, no model yet");
    banner(session.alert);
    const lamp = () => { const made = node("div", "lamp"); made.append(node("b", ""), node("span", "")); return made; };
    fill($("lamps"), session.lamps, lamp, (row, { level, sign, text }) => {
      named(row, `lamp ${level}`);
      write(row.firstChild, sign);
      write(row.lastChild, text);
    });
    const limit = ({ name }) => {
      const row = node("div", "limit"), track = node("div", "track");
      track.append(document.createElement("i"));
      row.append(node("span", "", name), track, node("span", ""));
      return row;
    };
    fill($("limits"), session.limits, limit, (row, { sign, text, part, near }) => {
      named(row, near ? "limit near" : "limit");
      row.children[1].firstChild.style.width = `${Math.min(100, 100 * part)}%`;
      write(row.lastChild, `${sign} ${text}`);
    });
    const raters = session.raters || [];
    fill($("raters"), raters, () => document.createElement("option"), (row, name) => { row.value = name; });
    $("examiner").placeholder = raters.length ? `planned: ${raters.join(", ")}` : "examiner";
    rated = session.rate;
    show("rated", rated === null ? "no epoch yet" : `epoch ${rated.place}`);
  }

  function banner(text, good) { const at = $("banner"); at.hidden = !text; at.classList.toggle("good", !!good); write(at, text); }
  function remark(text) { const at = $("said"); at.prepend(node("div", "", text)); while (at.children.length > 4) at.lastChild.remove(); }
  function clear() { traces.clear(); rated = null; show("rated", "–"); $("said").replaceChildren(); $("limits").replaceChildren(); }

  // What began since the last message; of a page that was just opened, nothing.
  function hear(alarms) {
    if (alarmed && alarms.stop > alarmed.stop) tones.stop();
    else if (alarmed && alarms.caution > alarmed.caution && !silent) tones.caution();
    alarmed = alarms;
    show("tones", !tones.allowed ? "no tones yet: click" : silent ? "cautions are silent" : "");
  }
  function hush(on) {
    silent = on;
    $("silence").setAttribute("aria-pressed", on);
    write($("silence"), on ? "Hear cautions" : "Silence cautions");
  }
  // A page that cannot reach the program offers no stop.
  function lost() {
    if (runs && performance.now() - heard > STATE_OLD_MS) {
      tones.stop();
      runs = false;
    }
    $("emergency").disabled = true;
    banner(led ? "The connection to the program is lost. The arm is stopped without it; check the arm, then reload this page."
      : "The connection to the program is lost. This page shows nothing new and cannot stop the arm: use the stop of the rig, or the page in control.");
  }

  function leave() { away = true; say({ kind: "leave" }); }
  // What the server took is shown as noted, and only then is its field emptied.
  function note(said, text, field) {
    if (asked) return;
    if (!connected()) return remark(`not noted, there is no connection: ${text}`);
    asked = { text, field, value: field && field.value };
    say({ kind: "note", ...said });
  }
  function noted(taken) {
    if (!asked) return;
    const { text, field, value } = asked;
    asked = null;
    remark(taken ? text : `not noted: ${text}`);
    if (taken && field && field.value === value) field.value = "";
  }
  function emergency() { say({ kind: "emergency" }); if (!$("emergency").disabled) remark("emergency stop"); }

  function score(text) {
    const plain = text.trim().replace("−", "-");
    if (!/^[-+]?\d+([.,]\d{1,2})?$/.test(plain)) return null;
    return Number(plain.replace(",", "."));
  }

  function begin() {
    page = document.querySelector("meta[name=rig-page]").content;
    for (const one of document.querySelectorAll(".tab")) one.onclick = () => view(one.dataset.view);
    for (const one of document.querySelectorAll("[data-order]")) {
      one.onclick = () => say({ kind: "order", command: one.dataset.order });
      // A key that is held down repeats: on Resume it would end each hold at once.
      one.onkeydown = (event) => { if (event.repeat) event.preventDefault(); };
    }
    $("emergency").onpointerdown = emergency;
    $("emergency").onclick = (event) => { if (event.detail === 0) emergency(); };
    addEventListener("keydown", (event) => { if (event.key === "Escape") emergency(); }, true);
    $("silence").onclick = () => hush(!silent);
    $("take").onclick = () => socket.close();
    $("note-form").onsubmit = (event) => { event.preventDefault(); const text = $("note").value; if (text.trim()) note({ what: "note", text, by: "" }, `note: ${text}`, $("note")); };
    $("save-form").onsubmit = (event) => { event.preventDefault(); say({ kind: "save", folder: $("save-folder").value }); };
    $("mark").onclick = () => note({ what: "mark", text: "moment marked", by: "" }, "mark: moment marked");
    $("rating-form").onsubmit = (event) => {
      event.preventDefault();
      const value = score($("score").value), by = $("examiner").value.trim();
      if (rated === null) return remark("there is no epoch to rate yet");
      if (value === null) return remark(`${$("score").value || "an empty score"} is no score: write a number like 1.5 or 1,5`);
      if (!by) return remark("a rating needs the examiner's name or code");
      note({ what: "rating", text: "", by, epoch: rated.number, score: value }, `rating of epoch ${rated.place}: ${value} by ${by}`, $("score"));
    };
    addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", () => { if (document.hidden) leave(); else away = false; });
    addEventListener("pageshow", () => { away = false; });
    setInterval(() => {
      const fine = connected();
      if (fine && !away) say({ kind: "beat" });
      if (!fine) lost();
    }, BEAT_MS);
    traces.begin();
    view("before");
    connect();
  }

  const waiting = setInterval(() => {
    if (!$("view-during") || !$("view-before") || !$("view-after")) return;
    clearInterval(waiting);
    begin();
  }, 20);
})();
