// What the sensor knows: the cylinder to scale, over it how likely each place is, and by which hypothesis.
"use strict";
(() => {
  const HILL = 84, TUBE = 16, FOOT = 34, SIDE = 10; // px
  const NARROW = 1.5; // px, of the narrowest hill
  const ANYWHERE = 0.24; // of the stroke, from which deviation on a place may be any
  const LEAST = 0.001; // chance of a hypothesis that is drawn
  const LOOKS = { described: "--kalman", leaks: "--table", low: "--balance", top: "--second", unknown_position: "--soft" };
  const DIAL = { leakage: [0.5, 2], displacement: [0.97, 1.03], compliance: [0.5, 2] }; // ends of the scales

  const { css, element } = studio;
  const place = (id) => document.getElementById(id);
  const percent = (p) => (p > 0 && p < 0.001 ? "< 0.1 %" : `${(100 * p).toFixed(p < 0.1 ? 1 : 0)} %`);

  // Of each hypothesis, how likely each pixel is.
  function densities(known, wide, perMm) {
    return known.hypotheses.filter((h) => h.chance > LEAST).map((h) => {
      const flat = h.std > ANYWHERE * known.stroke, std = Math.max(h.std * perMm, NARROW), at = h.place * perMm, row = [];
      let sum = 0;
      for (let x = 0; x <= wide; x++) { const v = flat ? 1 : Math.exp(-0.5 * ((x - at) / std) ** 2); row.push(v); sum += v; }
      return { name: h.name, row: row.map((v) => (h.chance * v) / Math.max(sum, 1e-12)) };
    });
  }

  // Hills on each other: the outline is the root of the probability, so that what is unlikely is seen, too. Each has of
  // it what it has of the probability there.
  function hills(svg, known, wide, perMm) {
    const all = densities(known, wide, perMm), total = new Float64Array(wide + 1);
    for (const { row } of all) row.forEach((v, x) => { total[x] += v; });
    const most = Math.max(...total, 1e-12), base = new Float64Array(wide + 1);
    for (const { name, row } of [...all].reverse()) {
      const high = (v, x) => `${SIDE + x},${(HILL * (1 - (total[x] > 0 ? (v / total[x]) * Math.sqrt(total[x] / most) : 0))).toFixed(1)}`;
      const up = row.map((v, x) => high(base[x] + v, x)), down = [...row.keys()].reverse().map((x) => high(base[x], x));
      svg.append(element("polygon", { points: [...up, ...down].join(" "), fill: css(LOOKS[name]), "fill-opacity": 0.75 }));
      row.forEach((v, x) => { base[x] += v; });
    }
  }

  function cylinder(svg, known, truth, wide, perMm) {
    const x = (mm) => SIDE + Math.min(Math.max(mm, 0), known.stroke) * perMm;
    svg.append(element("rect", { x: SIDE, y: HILL, width: wide, height: TUBE, fill: css("--ground"), stroke: css("--line") }));
    svg.append(element("rect", { x: x(known.low), y: HILL + 1, width: Math.max(x(known.high) - x(known.low), 1), height: TUBE - 2, fill: css("--kalman"), "fill-opacity": 0.3 }));
    if (known.position !== null) {
      const [a, b] = [x(known.position - known.bound), x(known.position + known.bound)], y = HILL + TUBE + 5;
      svg.append(element("path", { d: `M${a},${y - 3}v6M${a},${y}H${b}M${b},${y - 3}v6`, stroke: css("--kalman"), fill: "none" }));
      svg.append(element("line", { x1: x(known.position), x2: x(known.position), y1: HILL - 2, y2: HILL + TUBE + 2, stroke: css("--kalman"), "stroke-width": 2 }));
    }
    if (truth !== null) svg.append(element("path", { d: `M${x(truth)},${HILL + TUBE}l-5,9h10z`, fill: css("--true") }));
    const step = [1, 2, 5].flatMap((n) => [n, 10 * n, 100 * n, 1000 * n]).sort((p, q) => p - q).find((one) => one * perMm > 60) ?? known.stroke;
    for (let mm = 0; mm <= known.stroke; mm += step) svg.append(element("text", { x: x(mm), y: HILL + TUBE + FOOT - 8, "text-anchor": mm === 0 ? "start" : mm > known.stroke - step / 2 ? "end" : "middle", class: "known-words" }, `${mm}${mm === 0 ? " mm" : ""}`));
  }

  function listed(list, known) {
    list.replaceChildren(...known.hypotheses.map((h) => {
      const row = document.createElement("li"), swatch = document.createElement("i"), words = document.createElement("span"), chance = document.createElement("b");
      swatch.style.background = css(LOOKS[h.name]);
      words.textContent = h.words;
      chance.textContent = percent(h.chance);
      row.append(swatch, chance, words);
      return row;
    }));
  }

  // What it has learned over the data sheet's value, which is marked, with what lies within 95 %.
  function dial({ name, value, std }) {
    const own = document.createElement("div"), wide = 150, [low, high] = DIAL[name];
    const x = (v) => (wide * Math.log(Math.min(Math.max(v, low), high) / low)) / Math.log(high / low);
    const svg = element("svg", { viewBox: `0 0 ${wide} 18`, width: wide, height: 18, role: "img", "aria-label": `${name} ${value} ± ${(1.96 * std).toFixed(3)} of the data sheet's` });
    svg.append(element("rect", { x: 0, y: 7, width: wide, height: 4, fill: css("--grid") }));
    svg.append(element("rect", { x: x(value - 1.96 * std), y: 5, width: Math.max(x(value + 1.96 * std) - x(value - 1.96 * std), 1), height: 8, fill: css("--kalman"), "fill-opacity": 0.35 }));
    svg.append(element("line", { x1: x(1), x2: x(1), y1: 1, y2: 17, stroke: css("--true"), "stroke-dasharray": "2 2" }));
    svg.append(element("line", { x1: x(value), x2: x(value), y1: 2, y2: 16, stroke: css("--kalman"), "stroke-width": 2 }));
    const words = document.createElement("span");
    words.textContent = `${name} ${value.toFixed(name === "displacement" ? 4 : 2)} ± ${(1.96 * std).toFixed(name === "displacement" ? 4 : 2)}`;
    own.append(svg, words);
    return own;
  }

  // Fills the places that are called so; the truth is null where nobody knows it.
  studio.knows = (known, truth, of = "known") => {
    const picture = place(of);
    if (!picture) return;
    for (const panel of document.querySelectorAll(`.panel.${of}`)) panel.hidden = !known;
    if (!known) return;
    const width = picture.clientWidth || 460, wide = Math.floor(width - 2 * SIDE), perMm = wide / known.stroke;
    const said = known.position === null ? "the place of the piston is unknown" : `${known.position.toFixed(1)} mm, in 95 of 100 cases between ${known.low.toFixed(1)} and ${known.high.toFixed(1)} mm`;
    const svg = element("svg", { viewBox: `0 0 ${width} ${HILL + TUBE + FOOT}`, width, height: HILL + TUBE + FOOT, role: "img", "aria-label": `how likely each place in the cylinder is: ${said}` });
    hills(svg, known, wide, perMm);
    cylinder(svg, known, truth, wide, perMm);
    picture.replaceChildren(svg);
    const answers = {
      now: known.position === null ? "The place of the piston is unknown." : `The piston is at ${known.position.toFixed(1)} mm.`,
      sure: `In 95 of 100 cases it is between ${known.low.toFixed(1)} and ${known.high.toFixed(1)} mm${known.bound === null ? "" : `; one sample in 100\u00a0000 is off by more than ${known.bound.toFixed(0)} mm`}.`,
      since: known.since === null ? "It has met no end and no reference yet." : `The last end or reference was ${known.since.toFixed(0)} s ago.`,
      next: known.next,
      wrong: known.wrong,
    };
    for (const [name, answer] of Object.entries(answers)) { const own = place(`${of}-${name}`); if (own.textContent !== answer) own.textContent = answer; }
    listed(place(`${of}-hypotheses`), known);
    place(`${of}-learned`).replaceChildren(...known.learned.map(dial));
    place(`${of}-moved`).textContent = known.moved.join("\n");
  };
})();
