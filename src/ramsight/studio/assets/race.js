// The race: of each sensor how far it is off, now and at most, and what kalman says of itself.
"use strict";
(() => {
  const RACERS = ["kalman", "balance", "table"];
  let most = {}, unit = "", begun = -1;

  const mm = (v) => v.toFixed(v < 10 ? 1 : 0);
  const known = (v) => v !== null && v !== undefined;

  // What kalman says of itself, beside what is true.
  function answer(said, off, band) {
    if (!said) return "kalman is switched off";
    if (said.level === "not referenced") return `kalman says: ${said.text}. It gives no position.`;
    if (!known(off)) return `kalman says: ${said.text}.`;
    const holds = off <= band ? "within" : "beyond";
    return `kalman says: ${said.text}, ± ${mm(band)} mm. It is ${holds} its band.`;
  }

  studio.race = (f) => {
    const shown = studio.shown(), last = f.columns[shown], k = last.position.length - 1;
    if (shown !== unit || f.begun !== begun) { most = {}; unit = shown; begun = f.begun; }
    const off = {};
    for (const one of RACERS) {
      const place = document.getElementById(`race-${one}`), errors = last[`${one}_error`];
      if (!place) return;
      const said = f.status[shown][one], is = !!said && said.level !== "not referenced" && known(errors?.[k]);
      place.hidden = !said;
      if (is) {
        off[one] = Math.abs(errors[k]);
        most[one] = Math.max(most[one] ?? 0, ...errors.map((v) => Math.abs(v ?? 0)));
      }
      place.querySelector("b").textContent = is ? mm(off[one]) : "–";
      place.querySelector("i").textContent = known(most[one]) ? mm(most[one]) : "–";
    }
    const words = answer(f.status[shown].kalman, off.kalman, last.kalman_band?.[k]), place = document.getElementById("race-says");
    if (place.textContent !== words) place.textContent = words;
  };
})();
