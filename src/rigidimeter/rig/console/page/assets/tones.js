// The two tones of the page, made by the browser itself: a long high one for a stop, two short low ones for a caution.
// A browser plays nothing before somebody has clicked or pressed a key on the page.
"use strict";
(() => {
  const context = new AudioContext(), out = context.createGain();
  out.connect(context.destination);
  const tone = (hz, from, seconds, shape, size) => {
    const source = context.createOscillator(), gain = context.createGain(), begin = context.currentTime + from;
    source.type = shape;
    source.frequency.value = hz;
    gain.gain.setValueAtTime(0, begin);
    gain.gain.linearRampToValueAtTime(size, begin + 0.01);
    gain.gain.setValueAtTime(size, begin + seconds - 0.02);
    gain.gain.linearRampToValueAtTime(0, begin + seconds);
    source.connect(gain).connect(out);
    source.start(begin);
    source.stop(begin + seconds);
  };
  const stop = (from = 0) => tone(1000, from, 1.2, "square", 0.5);
  const caution = (from = 0) => { tone(400, from, 0.15, "sine", 0.6); tone(400, from + 0.25, 0.15, "sine", 0.6); };
  const allow = () => context.resume();
  const test = () => allow().then(() => { caution(); stop(1); });
  for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, allow, true);
  window.rigTones = { stop, caution, test, context, out, get allowed() { return context.state === "running"; } };
})();
