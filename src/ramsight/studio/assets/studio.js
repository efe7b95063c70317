// What the page does by itself: strips over time, colours of the circuit, words of the status. The server sends frames.
"use strict";
window.studio = (() => {
  const PAGE_UP = 33, PAGE_DOWN = 34; // as browsers number keys
  const PAGES = 50; // keys at most from one end of a slider to the other, ten of its steps each
  const SURE = 1.96; // deviations of a 95 % band
  const DASHES = { balance: [9, 4], unreferenced: [3, 3], table: [10, 3, 2, 3], second: [2, 5] }; // as in studio.css: lines differ without colour, too
  const MARKERS = { width: 2, dash: (plot, k) => (plot.series[k].dash ? "dashed" : "solid") }; // of the legends: lines as they are drawn
  const units = {}, keepers = {}; // by unit: the newest samples, all that is kept
  let shown = "", held = {}, now = "", drawn = 0, waiting = false, highest = 250, fitting = null, begun = 0, help = {}, laidOut = 0;

  // What is not on the screen is not drawn, until it comes there.
  const visible = new WeakMap();
  const looks = new IntersectionObserver((all) => {
    for (const one of all) { visible.set(one.target, one.isIntersecting); wakers.get(one.target)?.(); }
    draw();
  });
  const wakers = new WeakMap();
  const watch = (place, wake) => { looks.observe(place); if (wake) wakers.set(place, wake); };
  const isSeen = (place) => visible.get(place) !== false;

  const css = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
  function element(kind, attributes, text) { // of a drawing
    const made = document.createElementNS("http://www.w3.org/2000/svg", kind);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }
  const series = (label, colour, more = {}) => ({ label, stroke: css(colour), width: 1.5, spanGaps: false, points: { show: false }, value: (_, v) => v ?? "", ...more });

  const plain = (more = {}) => ({ stroke: css("--ink"), grid: { stroke: css("--grid"), width: 1 }, font: "12px sans-serif", size: 56, ...more }); // an axis

  const named = (plot, words) => { // a canvas says nothing by itself
    plot.ctx.canvas.setAttribute("role", "img");
    plot.ctx.canvas.setAttribute("aria-label", `${words}, over time`);
  };

  function begin(names, highestPressure, lines, words) {
    help = words;
    begun = 0;
    studio.timeline.forget();
    for (const name of Object.keys(units)) { delete units[name]; delete keepers[name]; }
    fitting?.disconnect();
    highest = highestPressure;
    const scale = document.getElementById("highest-pressure");
    if (scale) scale.textContent = highest.toFixed(0);
    for (const name of names) studio.lay(name, lines[name]);
    for (const name of names) units[name] = (keepers[name] = studio.keeper()).fine;
    shown = names[0];
    studio.begun();
    held = Object.fromEntries(names.map((name) => [name, {}]));
    now = "";
    laidOut = performance.now();
    const head = document.querySelector(".q-header");
    if (head) document.body.style.setProperty("--under-header", `${head.offsetHeight}px`);
    fitting = new ResizeObserver(() => studio.fit());
    fitting.observe(document.getElementById("strips"));
  }

  // A tab that is not open is out of the document, and its places with it: they are those that were drawn in.
  function recolour() {
    studio.remake();
    if (seen.columns) track(seen.columns, seen.references, (id) => pictures[id]);
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setTimeout(recolour, 100));

  function show(name) {
    shown = name;
    studio.explain();
    studio.renew();
    for (const one of document.querySelectorAll("[data-circuit]")) one.hidden = one.dataset.circuit !== name;
    studio.remake();
  }

  // What comes seldom holds until it comes again: what a sensor has learned, how likely its hypotheses are, the oil.
  const finite = (v) => (Number.isFinite(v) ? v : null);
  function hold(unit, f) {
    const known = f.known[unit], own = (held[unit] = known === null ? {} : held[unit]);
    [own.oil_pumps, own.oil_tank] = f.oil[unit];
    for (const { name, value, std } of known?.learned ?? []) for (const [edge, off] of [["", 0], ["_low", -SURE], ["_high", SURE]]) own[name + edge] = finite(value + off * std);
    for (const { name, chance } of known?.hypotheses ?? []) own[name] = finite(100 * chance);
  }

  function take(unit, time, columns) {
    const band = columns.kalman_band ?? [], more = { ...columns, kalman_error_high: band, kalman_error_low: band.map((v) => (v === null ? null : -v)) };
    for (const [name, value] of Object.entries(held[unit])) more[name] = time.map(() => value);
    keepers[unit].take(time, more);
  }

  // What stands is drawn once, and with it what is off the screen: for a picture, too.
  function draw(all = false) {
    waiting = false;
    const kept = keepers[shown];
    if (!kept?.fine.time.length || (studio.timeline.stands() && !all)) return;
    const [min, max] = studio.timeline.window(...kept.reach());
    studio.fill((unit) => keepers[unit ?? shown], min, max, all);
  }

  function paint(unit, now) {
    const root = document.querySelector(`[data-circuit="${unit}"]`);
    if (!root || root.hidden || !studio.isSeen(root)) return;
    studio.flow(unit, now);
    for (const group of root.querySelectorAll("g.node")) {
      const bar = now["pressure_" + group.dataset.node];
      if (bar === undefined) continue;
      const share = Math.min(Math.max(bar / highest, 0), 1);
      group.style.setProperty("--line", `hsl(${215 - 215 * share} 80% calc(var(--light) + ${8 * share}%))`);
      group.querySelector("title").textContent = `${group.dataset.node} ${bar} bar`;
    }
    for (const part of root.querySelectorAll("g.part")) {
      const name = part.id.slice(5), flow = now[name + ".flow"], opening = now[name + ".opening"];
      if (flow === undefined) continue;
      const valve = /valve/.test(part.getAttribute("class"));
      const passes = Math.abs(flow) > 0.3, spits = passes && part.classList.contains("relief-valve");
      part.classList.toggle("open", valve && (passes || opening > 0.02));
      part.classList.toggle("spits", spits);
      part.style.setProperty("--opening", `${passes ? 100 : Math.round(100 * (opening ?? 0))}%`);
      studio.says(part, spits ? `spits ${Math.abs(flow).toFixed(0)} l/min` : opening > 0.02 && part.classList.contains("safety-valve") ? `${Math.round(100 * opening)} % open` : "");
      const words = opening === undefined ? "" : `, opening ${opening}`;
      part.querySelector("title").textContent = `${name}: ${flow} l/min${words}`;
    }
  }

  function frame(f) {
    if (f.begun !== begun) {
      for (const unit of Object.keys(keepers)) { keepers[unit].forget(); held[unit] = {}; }
      studio.timeline.forget();
    }
    begun = f.begun;
    studio.timeline.happened(f.marks);
    const on = Object.fromEntries(Object.keys(f.status).map((unit) => [unit, Object.keys(f.status[unit])])), said = JSON.stringify(on);
    if (said !== now) {
      now = said;
      studio.remake(on);
    }
    for (const unit of Object.keys(units)) { hold(unit, f); take(unit, f.columns.time, f.columns[unit]); }
    paint(shown, f.circuit[shown]);
    studio.moved(f);
    studio.says_of(f, help);
    const last = f.columns[shown], k = last.position.length - 1;
    const mm = (v, digits = 1) => (v === null || v === undefined ? "–" : v.toFixed(digits));
    const set = (id, text) => { const place = document.getElementById(id); if (place) place.textContent = text; };
    set("now-unit", shown);
    set("now-true", mm(last.position[k]));
    const lost = f.status[shown].kalman?.level === "not referenced"; // what it has then is no position
    set("now-kalman", lost ? "–" : mm(last.kalman?.[k]));
    set("now-error", lost ? "–" : mm(last.kalman_error?.[k], 2));
    set("now-balance-error", mm(last.balance_error?.[k], 2));
    set("now-time", f.columns.time.at(-1).toFixed(1));
    f.oil[shown].forEach((celsius, at) => set(["now-pumps", "now-tank"][at], celsius.toFixed(1)));
    if (f.factor !== null) set("now-factor", f.factor.toFixed(1));
    if (f.energy[shown]) studio.energy(f.energy[shown]);
    if (shown in f.known) studio.knows(f.known[shown], f.known[shown]?.true ?? null);
    studio.lifts(f.lifts);
    studio.race(f);
    if (!waiting) { waiting = true; requestAnimationFrame(() => { draw(); drawn += 1; }); }
    return drawn;
  }

  // A track between two times: what is dragged over is asked for again, as fine as the picture can show it.
  const seen = {};

  function look(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    emitEvent("track-view", [plot.posToVal(left, "x"), plot.posToVal(left + width, "x"), plot.width]);
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
  }

  // A line over the height of a picture at a time; whether that is in it.
  function upright(plot, at) {
    const { ctx, bbox } = plot, x = plot.valToPos(at, "x", true);
    if (!(x >= bbox.left && x <= bbox.left + bbox.width)) return false;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    return true;
  }

  function marks(plot) {
    const { ctx } = plot;
    ctx.save();
    ctx.strokeStyle = css("--true");
    ctx.setLineDash([4, 4]);
    for (const at of seen.references) upright(plot, at);
    ctx.restore();
  }

  // Where the pointer is in a track, sent as often as what is known then can be drawn.
  const TELLS = 100; // ms
  let waits = false;
  function point(plot) {
    if (waits || !(plot.cursor.left >= 0)) return;
    waits = true;
    setTimeout(() => {
      waits = false;
      if (plot.cursor.left >= 0) emitEvent("track-at", plot.posToVal(plot.cursor.left, "x"));
    }, TELLS);
  }

  const pictures = {}; // where the track was drawn, by what the place is called
  function panel(place, title, height, lines, data, bands) {
    pictures[place.id] = place;
    place.replaceChildren();
    const plot = new uPlot({ title, width: place.clientWidth || 600, height, series: [{ label: "time [s]" }, ...lines],
      axes: [plain({ size: 28, values: (_, all) => all.map((v) => v + " s") }), plain()], bands, legend: { live: false },
      cursor: { drag: { x: true, y: false, setScale: false } }, hooks: { setSelect: [look], setCursor: [point], draw: [marks] },
      scales: { x: { time: false } } }, data, place);
    plot.over.addEventListener("dblclick", () => emitEvent("track-view", [null, null, plot.width]));
    named(plot, `the track: ${title}`);
    return plot;
  }

  function track(columns, references, find = (id) => document.getElementById(id)) {
    Object.assign(seen, { columns, references });
    const known = columns.true !== undefined;
    const lines = [series("estimate", "--kalman"), series("band +", "--kalman", { width: 0 }), series("band −", "--kalman", { width: 0 })];
    const data = [columns.time, columns.position, columns.high, columns.low];
    if (known) { lines.push(series("true", "--true")); data.push(columns.true); }
    panel(find("track-picture"), "position [mm]", 320, lines, data, [{ series: [2, 3], fill: css("--band") }]);
    if (known) panel(find("error-picture"), "error [mm]", 160, [series("error", "--kalman")], [columns.time, columns.error], []);
    else find("error-picture")?.replaceChildren();
    return columns.time.length;
  }

  // How a study's figures settle while machines are added: what 95 % of the samples keep, a line for each group.
  const STUDIED = ["--true", "--kalman", "--balance", "--second", "--table", "--unreferenced"];
  function studied(rows) {
    const place = document.getElementById("study-picture");
    if (!place) return;
    place.replaceChildren();
    const names = [...new Set(rows.flatMap((row) => Object.keys(row)))].filter((one) => one !== "machines");
    const lines = names.map((one, k) => series(one, STUDIED[k % STUDIED.length], { dash: k ? [8 - k, 2 + k] : undefined, points: { show: true, size: 5 } }));
    const plot = new uPlot({ title: "95 % of the samples within [mm], over the machines so far", width: place.clientWidth || 600, height: 200,
      series: [{ label: "machines" }, ...lines], axes: [plain({ size: 28, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000] }), plain()], legend: { live: false, markers: MARKERS },
      cursor: { show: false }, scales: { x: { time: false }, y: { range: (_, __, most) => [0, 1.1 * (most || 1)] } } },
      [rows.map((row) => row.machines), ...names.map((one) => rows.map((row) => row[one] ?? null))], place);
    plot.ctx.canvas.setAttribute("role", "img");
    plot.ctx.canvas.setAttribute("aria-label", plot.root.querySelector(".u-title").textContent);
  }

  // Of a track that belongs to another file nothing is left.
  function forget() {
    for (const name of Object.keys(seen)) delete seen[name];
    for (const id of ["track-picture", "error-picture"]) (document.getElementById(id) ?? pictures[id])?.replaceChildren();
  }

  // The file chooser that the uploader draws is an input in a button: leave the input alone to be reached, and name it.
  // Its other buttons are icons. A table that is wider than the page is scrolled with keys.
  const ICONS = { done_all: "remove all that is uploaded", clear_all: "remove all that waits", delete: "remove this file", clear: "remove this file", done: "remove this file" };
  function label() {
    for (const own of document.querySelectorAll(".q-slider[role=slider]")) { // the focus belongs to what has name and value
      const order = own.getAttribute("aria-disabled") === "true" ? -1 : 0;
      if (own.getAttribute("tabindex") !== `${order}`) own.tabIndex = order; // a change that is none would be looked at again
      for (const inner of own.querySelectorAll("[tabindex='0']")) inner.tabIndex = -1;
    }
    for (const place of document.querySelectorAll(".q-uploader")) {
      const words = place.querySelector(".q-uploader__title")?.textContent || "file";
      for (const input of place.querySelectorAll("input[type=file]")) {
        if (input.getAttribute("aria-label") === words) continue;
        input.setAttribute("aria-label", words);
        input.tabIndex = 0;
        const button = input.closest("[role=button]");
        if (button) { button.removeAttribute("role"); button.tabIndex = -1; }
      }
      for (const button of place.querySelectorAll(".q-btn:not([aria-label]):not(:has(input))"))
        button.setAttribute("aria-label", ICONS[button.querySelector("i")?.textContent] ?? "remove");
    }
    for (const bar of document.querySelectorAll(".q-loading-bar:not([aria-label])")) bar.setAttribute("aria-label", "the page loads");
    for (const place of document.querySelectorAll(".q-table__middle.scroll:not([tabindex])")) place.tabIndex = 0;
  }
  addEventListener("DOMContentLoaded", () => new MutationObserver(label).observe(document.body, { childList: true, subtree: true, attributeFilter: ["tabindex"] }));

  // A slider has the focus as a whole; its keys go to the part that knows them, and move no lever. Home and End it does
  // not know: pages do.
  function keyed(event) {
    const own = event.target.closest?.(".q-slider[role=slider]"), inner = own?.querySelector("[tabindex]");
    if (!inner || !event.isTrusted || !/^(Arrow|Page|Home|End)/.test(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    const send = (keyCode) => inner.dispatchEvent(new KeyboardEvent(event.type, { keyCode, ctrlKey: event.ctrlKey, cancelable: true }));
    if (!["Home", "End"].includes(event.key)) send(event.keyCode);
    else for (let k = 0; k < (event.type === "keydown" ? PAGES : 1); k++) send(event.key === "Home" ? PAGE_DOWN : PAGE_UP);
  }
  for (const kind of ["keydown", "keyup"]) addEventListener(kind, keyed, true);

  // The newest words of a place that does not grow are seen once they are there.
  const newest = (id) => setTimeout(() => { const own = document.getElementById(id); own?.scrollTo(0, own.scrollHeight); }, 50);

  // A server that has gone says nothing: what is shown then is old.
  const SILENT = 5000, LOOK = 500; // ms without a word; from one look to the next, of a page that is not busy
  let heard = performance.now(), looked = heard;
  const beat = () => { heard = performance.now(); };
  function gone() {
    const now = performance.now(), wasBusy = now - looked > 3 * LOOK, cut = window.socket?.connected === false;
    looked = now;
    if (wasBusy) beat();
    const is = laidOut && (cut || now - heard > SILENT), place = document.getElementById("gone");
    document.body?.classList.toggle("gone", is); // a busy page is looked at before it has one
    const words = is ? "The studio gives no answer: what is shown is old." : "";
    if (place && place.textContent !== words) place.textContent = words;
  }
  setInterval(gone, LOOK);

  addEventListener("keydown", (event) => {
    const back = event.key === "Escape" && document.querySelector(".circuit.large button");
    if (back) { back.click(); back.focus(); }
  });

  // A file that is dropped beside its box would take the page's place: it goes into the first box of the tab.
  addEventListener("dragover", (event) => { if (!event.target.closest?.(".q-uploader")) event.preventDefault(); });
  addEventListener("drop", (event) => {
    if (event.target.closest?.(".q-uploader") || !event.dataTransfer?.files.length) return;
    event.preventDefault();
    const input = document.querySelector(".q-uploader input[type=file]");
    if (!input) return;
    input.files = event.dataTransfer.files;
    input.dispatchEvent(new Event("change", { bubbles: true }));
  });

  return { beat, newest, watch, isSeen, begin, show, frame, track, studied, forget, draw, css, element, upright, series, plain, named, dashes: DASHES, markers: MARKERS, shown: () => shown, reach: () => keepers[shown].reach(), count: () => drawn, units, seen };
})();
