// What was lifted: the newest weighing to scale, with its band, the truth and the rated load; those before it; the total.
"use strict";
(() => {
  const SIDE = 10, HIGH = 14, TOP = 14, FOOT = 40; // px
  const { css, element } = studio;
  const place = (id) => document.getElementById(id);
  const known = (v) => v !== null && v !== undefined;
  const kg = (v) => v.toLocaleString("en").replace(/,/g, "\u202f");
  const weighedAs = (one) => (known(one.mass) ? `${kg(one.mass)} ± ${kg(one.half)} kg` : "no mass");
  const truth = ([low, high]) => (!known(low) ? "–" : low === high ? `${kg(low)} kg` : `${kg(low)} to ${kg(high)} kg`);
  const rated = (one) => (known(one.share) ? `${one.share} ± ${one.share_half} %, ${one.status}` : one.status);
  let shown = "";

  function part(name, ...inside) {
    const own = document.createElement("span");
    own.className = name;
    own.append(...inside);
    return own;
  }

  // How far the truth is from a good weighing.
  function compared(one) {
    if (!one.good || one.true[0] !== one.true[1]) return `true: ${truth(one.true)}`;
    const off = one.mass - one.true[0], holds = Math.abs(off) <= one.half ? "within" : "beyond";
    return `true: ${truth(one.true)}, ${holds} the band`;
  }

  function entry(one, chart) {
    const own = document.createElement("li"), by = one.direction === "both" ? "up and down" : "up";
    const verdict = part(`status ${one.good ? "ok" : "invalid"}`, one.good ? "good" : "bad");
    const load = chart ? [part(`status ${one.level}`, `rated load: ${rated(one)}`)] : []; // without a load chart there is none
    const said = part("verdict", verdict, ...load, one.good ? "" : one.quality);
    own.append(part("line", part("mass", weighedAs(one)), compared(one)), part("line", said, part("when", `${by}, ${one.at} s`)));
    return own;
  }

  function picture(one) {
    const own = place("lifts-picture"), width = own.clientWidth || 460, wide = width - 2 * SIDE;
    own.replaceChildren();
    if (!known(one.mass)) return;
    const most = 1.15 * Math.max(one.mass + one.half, one.true[1] ?? 0, one.rated ?? 0, 1);
    const x = (v) => SIDE + (wide * Math.min(Math.max(v, 0), most)) / most, band = [x(one.mass - one.half), x(one.mass + one.half)];
    const svg = element("svg", { viewBox: `0 0 ${width} ${TOP + HIGH + FOOT}`, width, height: TOP + HIGH + FOOT, role: "img", "aria-label": `weighed ${weighedAs(one)}, true ${truth(one.true)}` });
    const add = (kind, attributes, text) => svg.append(element(kind, attributes, text));
    add("rect", { x: SIDE, y: TOP, width: wide, height: HIGH, fill: css("--ground"), stroke: css("--line") });
    add("rect", { x: band[0], y: TOP + 1, width: Math.max(band[1] - band[0], 1), height: HIGH - 2, fill: css("--kalman"), "fill-opacity": one.good ? 0.35 : 0.15 });
    add("line", { x1: x(one.mass), x2: x(one.mass), y1: TOP - 2, y2: TOP + HIGH + 2, stroke: css("--kalman"), "stroke-width": 2 });
    if (known(one.rated)) {
      add("line", { x1: x(one.rated), x2: x(one.rated), y1: TOP - 4, y2: TOP + HIGH + 4, stroke: css("--ink"), "stroke-dasharray": "3 3" });
      add("text", { x: x(one.rated), y: TOP - 5, "text-anchor": "middle", class: "known-words" }, "rated");
    }
    for (const mass of new Set(one.true)) if (known(mass)) add("path", { d: `M${x(mass)},${TOP + HIGH + 1}l-5,9h10z`, fill: css("--true") });
    const step = [1, 2, 5].flatMap((n) => [n, 10 * n, 100 * n, 1000 * n, 10000 * n]).sort((p, q) => p - q).find((v) => (v * wide) / most > 70) ?? most;
    for (let v = 0; v < most; v += step) add("text", { x: x(v), y: TOP + HIGH + FOOT - 8, "text-anchor": v ? "middle" : "start", class: "known-words" }, `${kg(v)}${v ? "" : " kg"}`);
    own.append(svg);
  }

  studio.lifts = (now) => {
    if (!place("lifts") || !now.weighings) return;
    const said = JSON.stringify([now, place("lifts-picture").clientWidth, css("--kalman")]); // as wide and in the colours of the page
    if (said === shown) return;
    shown = said;
    const [newest, ...before] = [...now.weighings].reverse().map((one) => [one, entry(one, now.chart)]);
    place("lifts-none").hidden = !!newest;
    place("lifts-newest").replaceChildren(...(newest ? [newest[1]] : []));
    picture(newest?.[0] ?? {});
    place("lifts-before").replaceChildren(...before.map(([, own]) => own));
    const count = `${now.count} ${now.count === 1 ? "weighing" : "weighings"}`, cycles = `${now.cycles} ${now.cycles === 1 ? "cycle" : "cycles"}`;
    place("lifts-total").textContent = now.count ? `total since the start: ${kg(now.total)} ± ${kg(now.total_half)} kg (95 %) in ${cycles}, of ${count}` : "";
  };
})();
