// The bar that stays: of every sensor position, band and status; and the lanes of the status over time.
"use strict";
(() => {
  const place = (id) => document.getElementById(id);
  const known = (v) => v !== null && v !== undefined;
  let chosen = null, newest = null, help = {}, said = {}, key = [];

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

  // What is explained: the sensor that was chosen, or the one that matters most of the unit that is shown.
  function explained(status) {
    if (chosen && status[chosen.unit]?.[chosen.kind]) return chosen;
    const unit = studio.shown(), own = status[unit] ?? {};
    const kind = own.second?.level === "invalid" ? "second" : own.kalman ? "kalman" : Object.keys(own)[0];
    return kind ? { unit, kind } : null;
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

  // Another unit is shown: a choice of a sensor of the one before is over.
  studio.explain = () => {
    chosen = null;
    if (newest) explain(newest.status);
  };

  // A change is said to whoever does not see it.
  function tell(status) {
    const now = Object.fromEntries(Object.keys(status).map((unit) => [unit, status[unit].kalman?.text ?? "no kalman"]));
    const changed = Object.keys(now).filter((unit) => now[unit] !== said[unit]);
    if (changed.length) set(place("status-said"), changed.map((unit) => `${unit}, kalman: ${now[unit]}`).join(". "));
    said = now;
  }

  studio.says_of = (frame, words) => {
    newest = frame;
    tell(frame.status);
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

  // Each status has a colour, lines across it and a letter: who does not see the one sees the other.
  const LINES = { uncertain: [[0, 8, 8, 0]], "not referenced": [[0, 4, 8, 4]], invalid: [[0, 0, 8, 8], [0, 8, 8, 0]], unchecked: [[4, 0, 4, 8]] };
  function tile(level, ratio) {
    const made = document.createElement("canvas"), ctx = made.getContext("2d");
    made.width = made.height = 8 * ratio;
    ctx.scale(ratio, ratio);
    ctx.fillStyle = studio.css("--level-" + level.replace(" ", "-"));
    ctx.fillRect(0, 0, 8, 8);
    ctx.strokeStyle = studio.css("--paper");
    ctx.lineWidth = 1.2;
    for (const [x, y, to, down] of LINES[level] ?? []) {
      ctx.beginPath();
      ctx.moveTo(x, y);
      ctx.lineTo(to, down);
      ctx.stroke();
    }
    return made;
  }

  // The key has all levels in their order, as in said.py, and shows what the lanes are made of.
  function tiles(ratio) {
    const found = [...document.querySelectorAll(".strip .key [data-level]")];
    const theme = studio.css("--paper") + ratio;
    if (found.some((one) => !one.dataset.drawn) || key.theme !== theme) {
      key = found.map((one) => ({ letter: one.dataset.letter, tile: tile(one.dataset.level, ratio) }));
      key.theme = theme;
      found.forEach((one, k) => { one.querySelector("i").style.background = `url(${key[k].tile.toDataURL()}) 0 0 / 8px`; found[k].dataset.drawn = theme; });
    }
    return key;
  }

  // Rectangles as long as a status holds, a lane for each sensor.
  studio.lanes = (plot) => {
    const { ctx, bbox, data } = plot, time = data[0], lanes = data.length - 1, height = bbox.height / lanes;
    ctx.save();
    const ratio = devicePixelRatio || 1, legend = tiles(ratio), fills = legend.map((one) => ctx.createPattern(one.tile, "repeat"));
    ctx.font = `bold ${12 * ratio}px sans-serif`;
    ctx.textBaseline = "middle";
    ctx.textAlign = "left";
    ctx.strokeStyle = studio.css("--paper");
    ctx.lineWidth = 4 * ratio;
    ctx.lineJoin = "round";
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip(); // of a part of the time what is beside it is not shown
    for (let lane = 0; lane < lanes; lane++) {
      const levels = data[lane + 1], top = bbox.top + bbox.height - (lane + 1) * height;
      for (let from = 0, k = 1; k <= time.length; k++) {
        if (k < time.length && levels[k] === levels[from]) continue;
        if (known(levels[from])) {
          const left = plot.valToPos(time[from], "x", true), right = plot.valToPos(time[Math.min(k, time.length - 1)], "x", true);
          ctx.fillStyle = fills[levels[from]];
          ctx.fillRect(left, top + 0.15 * height, Math.max(right - left, 1), 0.7 * height);
          const letter = legend[levels[from]]?.letter ?? "", at = Math.max(left, bbox.left) + 4 * ratio;
          if (at + ctx.measureText(letter).width + 4 * ratio < right) {
            ctx.fillStyle = studio.css("--ink");
            for (const put of ["strokeText", "fillText"]) ctx[put](letter, at, top + 0.5 * height);
          }
        }
        from = k;
      }
    }
    ctx.restore();
  };
})();
