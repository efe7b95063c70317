// The bar that stays: of every sensor position, band and status; and the lanes of the status over time.
"use strict";
(() => {
  const LEVELS = ["ok", "uncertain", "not referenced", "invalid", "unchecked", "no report"]; // as in said.py
  const place = (id) => document.getElementById(id);
  const known = (v) => v !== null && v !== undefined;
  let chosen = null, newest = null, help = {};

  function set(own, text) {
    if (own && own.textContent !== text) own.textContent = text;
  }

  // A band of metres is no number to read: as many digits as it deserves.
  const digits = (mm) => mm.toFixed(Math.abs(mm) < 100 ? 1 : 0);

  function row(unit, kind, said, columns) {
    const status = place(`status-${unit}-${kind}`), own = status?.closest(".said");
    if (!own) return;
    own.hidden = said === undefined;
    if (said === undefined) return;
    const at = columns[kind]?.at(-1), band = columns[kind + "_band"]?.at(-1);
    set(place(`at-${unit}-${kind}`), known(at) && said.level !== "not referenced" ? at.toFixed(1) : "–");
    set(place(`width-${unit}-${kind}`), known(band) ? digits(band) : "–");
    set(status, said.text);
    const name = "status " + said.level.replace(" ", "-");
    if (status.className !== name) status.className = name;
    own.classList.toggle("invalid", said.level === "invalid");
  }

  // What is explained: the sensor that was chosen, or the self-calibrating one that has most to say.
  function explained(status) {
    if (chosen && status[chosen.unit]?.[chosen.kind]) return chosen;
    const all = Object.keys(status).map((unit) => ({ unit, kind: "kalman" })).filter((one) => status[one.unit].kalman);
    const rank = (one) => ["ok", "no report", "unchecked", "uncertain", "not referenced", "invalid"].indexOf(status[one.unit].kalman.level);
    const alert = status[Object.keys(status)[0]]?.second?.level === "invalid" ? { unit: Object.keys(status)[0], kind: "second" } : null;
    return alert ?? all.reduce((best, one) => (best && rank(best) >= rank(one) ? best : one), null);
  }

  function explain(status) {
    const one = explained(status);
    for (const own of document.querySelectorAll(".said")) own.setAttribute("aria-pressed", `${!!one && own.dataset.unit === one.unit && own.dataset.kind === one.kind}`);
    if (!one) return;
    const said = status[one.unit][one.kind], words = help[said.text];
    set(place("meaning-of"), `${one.unit}, ${one.kind === "second" ? "transducer" : one.kind}: ${said.text}.`);
    set(place("meaning"), words?.meaning ?? "");
    set(place("remedy"), words?.do ? `What to do: ${words.do}` : "");
  }

  studio.says_of = (frame, words) => {
    newest = frame;
    help = words;
    for (const [unit, status] of Object.entries(frame.status))
      for (const own of document.querySelectorAll(`.said[data-unit="${unit}"]`)) row(unit, own.dataset.kind, status[own.dataset.kind], frame.columns[unit]);
    explain(frame.status);
  };

  addEventListener("click", (event) => {
    const own = event.target.closest?.(".said");
    if (!own || !newest) return;
    const again = chosen && chosen.unit === own.dataset.unit && chosen.kind === own.dataset.kind;
    chosen = again ? null : { unit: own.dataset.unit, kind: own.dataset.kind };
    explain(newest.status);
  });

  // Rectangles of one colour as long as a status holds, a lane for each sensor.
  studio.lanes = (plot) => {
    const { ctx, bbox, data } = plot, time = data[0], lanes = data.length - 1, height = bbox.height / lanes;
    const colours = LEVELS.map((one) => getComputedStyle(document.body).getPropertyValue("--level-" + one.replace(" ", "-")).trim());
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip(); // of a part of the time what is beside it is not shown
    for (let lane = 0; lane < lanes; lane++) {
      const levels = data[lane + 1], top = bbox.top + bbox.height - (lane + 1) * height;
      for (let from = 0, k = 1; k <= time.length; k++) {
        if (k < time.length && levels[k] === levels[from]) continue;
        if (known(levels[from])) {
          const left = plot.valToPos(time[from], "x", true), right = plot.valToPos(time[Math.min(k, time.length - 1)], "x", true);
          ctx.fillStyle = colours[levels[from]];
          ctx.fillRect(left, top + 0.15 * height, Math.max(right - left, 1), 0.7 * height);
        }
        from = k;
      }
    }
    ctx.restore();
  };
})();
