// Where the energy goes: what came in on the left, where it went on the right, bands as wide as their energy.
"use strict";
(() => {
  const GAP = 6, BAR = 12, LINE = 15, NARROW = 160, FOOT = 30; // px
  const LEAST = 0.004; // share of the whole that is drawn
  const COLOURS = { "drive": "--true", "load comes down": "--balance", "load": "--balance", "back to the drive": "--true", "stored, tank and air": "--soft" };

  const { css, element } = studio;
  const colour = (name) => css(COLOURS[name] ?? "--kalman");

  // Entries of one side, the largest first, each with its place in pixels.
  function stacked(side, whole, height) {
    const entries = Object.entries(side).filter(([, kj]) => kj > LEAST * whole).sort((a, b) => b[1] - a[1]);
    const scale = (height - GAP * Math.max(entries.length - 1, 0)) / whole;
    let at = 0;
    return entries.map(([name, kj]) => {
      const one = { name, kj, top: at, tall: Math.max(kj * scale, 1) };
      at += one.tall + GAP;
      return one;
    });
  }

  function band(x0, y0, x1, y1, tall, fill) {
    const m = (x0 + x1) / 2;
    const d = `M${x0},${y0}C${m},${y0} ${m},${y1} ${x1},${y1}v${tall}C${m},${y1 + tall} ${m},${y0 + tall} ${x0},${y0 + tall}Z`;
    return element("path", { d, fill, "fill-opacity": 0.45 });
  }

  // Draws one side, and gives its words, which are drawn over everything and never over each other.
  function side(svg, entries, x, middle, right, whole) {
    let at = 0, free = 0;
    const labels = [];
    for (const one of entries) {
      const fill = colour(one.name), from = x + (right ? 0 : BAR);
      const thick = one.tall;
      svg.append(element("rect", { x, y: one.top, width: BAR, height: thick, fill }));
      svg.append(right ? band(middle, at, from, one.top, thick, fill) : band(from, one.top, middle, at, thick, fill));
      at += thick;
      const short = middle < NARROW ? "" : ` ${one.kj.toFixed(one.kj < 10 ? 2 : 1)} kJ,`;
      const y = Math.max(one.top + thick / 2, free + LINE / 2);
      free = y + LINE / 2;
      const place = { x: right ? x - 5 : x + BAR + 5, y, "text-anchor": right ? "end" : "start", "dominant-baseline": "middle", class: "sankey-words" };
      labels.push(element("text", place, `${one.name}${short} ${Math.round((100 * one.kj) / whole)} %`));
    }
    return labels;
  }

  studio.energy = (found) => {
    const place = document.getElementById("sankey");
    if (!place || !found) return;
    const sum = (one) => Object.values(one).reduce((a, b) => a + b, 0);
    const whole = Math.max(sum(found.in), sum(found.out));
    const said = document.getElementById("energy-said");
    const percent = (share) => (share === null ? "–" : `${Math.round(100 * share)} %`);
    said.textContent = `regenerated: ${percent(found.regenerated)} of what the load gave, ${percent(found.recovered)} of what the drive gave; not accounted for: ${found.missing.toFixed(3)} kJ`;
    if (whole < 0.01) { place.replaceChildren(); return; }
    const width = place.clientWidth || 500, height = 250, middle = 0.36 * width;
    const list = (one) => Object.entries(one).map(([name, kj]) => `${name} ${kj} kJ`).join(", ");
    const svg = element("svg", { viewBox: `0 0 ${width} ${height + FOOT}`, width, height: height + FOOT, role: "img", "aria-label": `in: ${list(found.in)}; out: ${list(found.out)}` });
    const left = stacked(found.in, whole, height), right = stacked(found.out, whole, height);
    svg.append(...side(svg, left, 0, middle, false, whole), ...side(svg, right, width - BAR, middle, true, whole));
    place.replaceChildren(svg);
  };
})();
