// Oil that moves in the circuit's lines: dashes in the direction of the flow, faster where more flows.
"use strict";
(() => {
  const LEAST = 0.05; // l/min, a thousandth of what a pump delivers: less stands
  const PERIOD = 18; // of the dashes, in units of the drawing, as in studio.css
  const LINE = 13; // from one line of words to the next, as in drawing/layout.py
  const FASTEST = 110, LONGEST = 0.07; // units a second at a pump's full flow; s, in which they go less than half a period
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const laid = {}, { element } = studio;

  // The middle of a chain's longest piece, and the angle at which it goes on there.
  function middle(points) {
    const pieces = points.slice(1).map((end, k) => [points[k], end]);
    const long = ([a, b]) => Math.hypot(b[0] - a[0], b[1] - a[1]);
    const [a, b] = pieces.reduce((best, one) => (long(one) > long(best) ? one : best));
    return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (Math.atan2(b[1] - a[1], b[0] - a[0]) * 180) / Math.PI];
  }

  // Lays the moving lines of a unit over those of its drawing, below the parts.
  studio.lay = (unit, lines) => {
    const root = document.querySelector(`[data-circuit="${unit}"]`), svg = root?.querySelector("svg");
    if (!svg) return;
    studio.watch(root);
    svg.querySelector("g.flows")?.remove();
    const group = element("g", { class: "flows", "aria-hidden": "true" });
    const chains = lines.chains.map(({ points, flows }) => {
      const dashes = element("polyline", { points: points.map((p) => p.join(",")).join(" ") });
      const [x, y, angle] = middle(points);
      const arrow = element("path", { d: "M7,0L-5,-5.5L-5,5.5Z" });
      dashes.style.display = arrow.style.display = "none";
      group.append(dashes, arrow);
      return { dashes, arrow, x, y, angle, flows: Object.entries(flows), gone: 0, way: 0, shown: false };
    });
    [...svg.querySelectorAll("g.node")].at(-1)?.after(group);
    laid[unit] = { full: lines.full, chains, last: performance.now() };
  };

  studio.flow = (unit, now) => {
    const own = laid[unit];
    if (!own) return;
    const time = performance.now(), passed = Math.min((time - own.last) / 1000, LONGEST);
    own.last = time;
    for (const one of own.chains) {
      let flow = 0;
      for (const [name, factor] of one.flows) flow += factor * (now[name + ".flow"] ?? 0);
      const shown = Math.abs(flow) > LEAST, way = Math.sign(flow);
      if (shown !== one.shown || (shown && way !== one.way)) {
        one.dashes.style.display = one.arrow.style.display = shown ? "" : "none";
        one.arrow.setAttribute("transform", `translate(${one.x},${one.y}) rotate(${one.angle + (way < 0 ? 180 : 0)})`);
        Object.assign(one, { shown, way });
      }
      one.flow = flow;
      if (!shown || still.matches) continue;
      const share = Math.min(Math.abs(flow) / own.full, 1);
      one.gone += way * FASTEST * Math.sqrt(share) * passed;
      one.dashes.style.strokeDashoffset = (-one.gone % PERIOD).toFixed(1);
    }
  };
  studio.moving = (unit) => laid[unit].chains.map(({ flow, gone, shown }) => ({ flow, gone, shown }));

  // Puts a line of words below those of a part, as that a relief valve spits.
  studio.says = (part, words) => {
    if ((part.dataset.says ?? "") === words) return;
    part.dataset.says = words;
    let place = part.querySelector("text.says");
    if (!place) {
      const last = [...part.querySelectorAll("text")].filter((one) => !one.matches(".port, .letter")).at(-1);
      if (!last) return;
      place = last.cloneNode();
      place.classList.add("says");
      place.setAttribute("y", +last.getAttribute("y") + LINE);
      part.append(place);
    }
    place.textContent = words;
  };
})();
