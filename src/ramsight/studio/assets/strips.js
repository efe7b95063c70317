// The strips over time: each shows signals that a visitor chooses, of one unit of measure by one axis.
"use strict";
(() => {
  const LEFT = 48, RIGHT = 44, WORDS = 16; // of the axes and their units: all strips have one time below the other
  const HEIGHT = 150, LANES = [110, 30, 22, 30]; // px: of lanes the least, what is beside them, one lane, one with a unit's name
  const LOOKS = ["kalman", "balance", "unreferenced", "table", "second", "true"]; // colours that a second unit's lines may have
  const { css, plain, series } = studio;
  const place = (id) => document.getElementById(id);
  let known = null, list = [], on = {};

  const words = (strip) => known.presets[strip.text]?.names ?? strip.text.split(" ").filter(Boolean);
  function parsed(word) { // a signal, and the unit that it is of; none is the one that is shown
    const dot = word.lastIndexOf("."), name = word.slice(dot + 1);
    return { word, name, unit: dot < 0 ? null : word.slice(0, dot), ...known.signals[name] };
  }
  const isOn = (one) => !one.sensor || (on[one.unit ?? studio.shown()] ?? ["kalman", "balance"]).includes(one.sensor);
  const measures = (all) => [...new Set(all.map((one) => one.measure))];
  const label = (one) => (one.unit === null ? one.words : `${one.unit} ${one.words}`);

  function heading(strip) {
    const all = words(strip).map(parsed), units = measures(all).filter((one) => one !== known.lanes);
    const title = known.presets[strip.text]?.title ?? (all.map(label).join(", ") || "no signal is chosen");
    const of = all.some((one) => one.unit === null) ? `${studio.shown()}: ` : "";
    return `${of}${title}${units.length ? ` [${units.join(", ")}]` : ""}`;
  }

  // Lines differ without colour, too: a look has a dash of its own, and no two lines have one look while there are some.
  function lines(drawn) {
    const isFirst = (one) => drawn.find((other) => other.colour === one.colour) === one; // whose look it keeps
    const free = LOOKS.filter((look) => !drawn.some((one) => one.colour === look));
    return drawn.map((one) => {
      const look = isFirst(one) ? one.colour : free.shift() ?? one.colour;
      const scale = one.measure === drawn[0].measure ? "y" : "right";
      return series(label(one), "--" + look, { scale, dash: studio.dashes[look], width: look === "kalman" ? 2 : 1.6 });
    });
  }

  function make(strip) {
    const { section, plot: before } = strip, box = section.querySelector(".strip-plot"), all = words(strip).map(parsed), drawn = all.filter(isOn);
    before?.destroy();
    box.replaceChildren();
    strip.plot = null;
    section.id = `strip-${strip.text.replaceAll(" ", "+")}`;
    section.querySelector("h3").textContent = heading(strip);
    for (const [name, said] of [["up", "move up"], ["down", "move down"], ["away", "remove"]])
      section.querySelector(`[data-strip-do=${name}]`).setAttribute("aria-label", `${said}: ${heading(strip)}`);
    section.querySelector("summary").setAttribute("aria-label", `signals of ${heading(strip)}`);
    strip.lanes = all.length > 0 && all[0].measure === known.lanes;
    if (!drawn.length) { box.textContent = all.length ? "The sensors of these signals are off." : "Choose signals."; return; }
    strip.columns = drawn.map((one) => [one.unit, one.column || one.name]);
    const own = strip.lanes ? drawn.map((one) => series(label(one), "--" + one.colour, { width: 0 })) : lines(drawn), bands = [];
    for (const [k, one] of drawn.entries()) {
      if (!one.band) continue;
      const { scale, stroke } = own[k], first = own.length + 1, is = bands.length === 0;
      own.push(series(is ? "95 % band" : "", "", { stroke, scale, width: 0, class: is ? "area" : "nameless" }), series("", "", { stroke, scale, width: 0, class: "nameless" }));
      strip.columns.push([one.unit, one.name + "_high"], [one.unit, one.name + "_low"]);
      bands.push({ series: [first, first + 1], fill: stroke + "2e" });
    }
    const sides = measures(drawn), axis = (more = {}) => plain({ ticks: { stroke: css("--grid"), width: 1 }, size: LEFT, ...more });
    const labelled = (unit) => ({ label: unit, labelSize: WORDS, labelFont: "12px sans-serif" });
    const axes = [axis({ size: 28, values: (_, at) => at.map((v) => v + " s") })], isWide = drawn.some((one) => one.unit !== null), [least, beside, lane, wide] = LANES;
    strip.height = strip.lanes ? Math.max(least, beside + drawn.length * (isWide ? wide : lane)) : HEIGHT;
    if (strip.lanes) axes.push(axis({ size: LEFT + WORDS, splits: drawn.map((_, k) => k + 0.5), grid: { show: false },
      values: () => drawn.map((one) => label(one).replace("unreferenced", "no ref.").replace(" ", "\n")) }));
    else axes.push(axis(labelled(sides[0])));
    if (sides[1]) axes.push(axis({ ...labelled(sides[1]), scale: "right", side: 1, size: RIGHT, grid: { show: false } }));
    const range = (unit) => (unit === "%" ? { range: [0, 100] } : {});
    strip.plot = new uPlot({
      width: box.clientWidth || 500, height: strip.height, series: [{ label: "time [s]", value: (_, v) => v ?? "" }, ...own], axes, bands,
      padding: [null, sides[1] ? 0 : RIGHT + WORDS, null, null], legend: { show: !strip.lanes, markers: studio.markers }, cursor: studio.timeline.cursor,
      hooks: { setSelect: [studio.timeline.zoomed], draw: [...(strip.lanes ? [studio.lanes] : []), studio.timeline.marked] },
      scales: { x: { time: false }, y: strip.lanes ? { range: [0, drawn.length] } : range(sides[0]), right: range(sides[1]) },
    }, [[], ...own.map(() => [])], box);
    strip.plot.over.addEventListener("dblclick", studio.timeline.whole);
    studio.named(strip.plot, heading(strip));
    if (strip.lanes) box.append(key());
  }

  // What colours, patterns and letters of the status mean; `status.js` fills the patterns in.
  function key() {
    const own = document.createElement("div");
    own.className = "key";
    own.innerHTML = Object.entries(known.levels).map(([one, letter]) => `<span data-level="${one}" data-letter="${letter}"><i></i><b>${letter}</b> ${one}</span>`).join("");
    return own;
  }

  // The menu of a strip: a box for each signal of the unit that is shown and, of a machine of several, of each unit.
  function menu(strip, box) {
    const units = Object.keys(studio.units), of = units.length > 1 ? [null, ...units] : [null];
    for (const measure of measures(Object.values(known.signals))) {
      const group = document.createElement("fieldset"), legend = document.createElement("legend");
      legend.textContent = measure;
      group.append(legend);
      for (const [name, one] of Object.entries(known.signals).filter(([, one]) => one.measure === measure)) {
        const row = document.createElement("div");
        if (of.length > 1) row.append(Object.assign(document.createElement("span"), { textContent: one.words }));
        for (const unit of of) {
          const tick = document.createElement("label"), input = document.createElement("input");
          Object.assign(input, { type: "checkbox", value: unit === null ? name : `${unit}.${name}` });
          if (of.length > 1) input.setAttribute("aria-label", `${unit ?? "shown"}: ${one.words} [${measure}]`);
          tick.append(input, of.length > 1 ? unit ?? "shown" : one.words);
          row.append(tick);
        }
        group.append(row);
      }
      box.append(group);
    }
    box.addEventListener("change", ({ target }) => {
      const before = strip.text, chosen = [...box.querySelectorAll("input:checked")].map((one) => one.value).join(" ");
      strip.text = Object.keys(known.presets).find((name) => known.presets[name].names.join(" ") === chosen) ?? chosen;
      if (list.some((one) => one !== strip && one.text && one.text === strip.text)) say("There is such a strip already.");
      else if (text().length > known.letters) say("A link has no room for more signals.");
      else { make(strip); ticks(strip); changed(""); return; }
      target.checked = !target.checked;
      strip.text = before;
    });
  }

  // A strip has two axes at most, and lanes have none.
  function ticks(strip) {
    const now = words(strip), shown = measures(now.map(parsed));
    for (const input of strip.section.querySelectorAll("fieldset input")) {
      const { measure } = parsed(input.value), isLane = measure === known.lanes;
      input.checked = now.includes(input.value);
      input.disabled = shown.length > 0 && !shown.includes(measure) && (isLane || shown.includes(known.lanes) || shown.length > 1);
    }
  }

  function built(text) {
    const section = document.createElement("section"), strip = { text, section, plot: null };
    section.className = "strip";
    section.innerHTML = `<div class="strip-head"><h3 class="u-title"></h3><details><summary class="small">signals</summary><div class="choice"></div></details>${
      [["up", "↑"], ["down", "↓"], ["away", "×"]].map(([name, sign]) => `<button type="button" class="small" data-strip-do="${name}">${sign}</button>`).join("")}</div><div class="strip-plot"></div>`;
    const details = section.querySelector("details"), box = section.querySelector(".choice");
    details.addEventListener("toggle", () => { if (!box.children.length) menu(strip, box); ticks(strip); });
    details.addEventListener("keydown", (event) => { if (event.key === "Escape") { details.open = false; section.querySelector("summary").focus(); } });
    section.addEventListener("click", (event) => {
      const button = event.target.closest("[data-strip-do]"), what = button?.dataset.stripDo;
      if (what === "away") { remove(strip); place("strip-add").focus(); }
      else if (what) { move(strip, what === "up" ? -1 : 1); button.focus(); }
    });
    studio.watch(section.querySelector(".strip-plot"));
    return strip;
  }

  const say = (words) => { place("strips-said").textContent = words; };
  const text = () => list.map((one) => one.text).filter(Boolean).join(",");

  function changed(said) {
    say(said);
    for (const one of document.querySelectorAll("[data-strip]")) one.setAttribute("aria-pressed", `${list.some((strip) => strip.text === one.dataset.strip)}`);
    studio.renew();
    studio.draw(true);
  }

  function add(text) {
    if (list.length >= known.most) { say(`${known.most} strips are the most: remove one.`); return; }
    const strip = built(text);
    list.push(strip);
    place("strip-list").append(strip.section);
    make(strip);
    changed(`added: ${heading(strip)}`);
    return strip;
  }

  function remove(strip) {
    list = list.filter((one) => one !== strip);
    strip.plot?.destroy();
    strip.section.remove();
    changed(`removed: ${heading(strip)}`);
  }

  function move(strip, by) {
    const from = list.indexOf(strip), to = from + by;
    if (to < 0 || to >= list.length) return;
    [list[from], list[to]] = [list[to], list[from]];
    const upper = list[Math.min(from, to)].section, lower = list[Math.max(from, to)].section;
    lower.before(upper);
    changed(`${heading(strip)}: strip ${to + 1} of ${list.length}`);
  }

  // The strips of a page that begins, from above.
  studio.strips = (given, texts) => {
    known = given;
    for (const one of list) one.plot?.destroy();
    list = texts.map(built);
    place("strip-list").replaceChildren(...list.map((one) => one.section));
    list.forEach(make);
    changed("");
    studio.laidOut = performance.now(); // ms since the page was asked for
  };
  studio.remake = (sensors = on) => { on = sensors; list.forEach(make); studio.draw(true); };
  studio.stripsText = () => (known && text() !== known.usual.join(",") ? text() || "none" : "");
  studio.plots = () => list.filter((one) => one.plot).map((one) => ({ ...one, title: heading(one) }));
  studio.fit = () => { for (const one of list) one.plot?.setSize({ width: one.plot.root.parentElement.clientWidth, height: one.height }); };
  studio.fill = (keeper, min, max, all) => {
    for (const { plot, columns, section } of list) {
      if (!plot || (!all && !studio.isSeen(section.querySelector(".strip-plot")))) continue;
      const data = [[null, "time"], ...columns].map(([unit, name]) => keeper(unit).between([name], min, max)[0]);
      plot.batch(() => { plot.setData(data, false); plot.setScale("x", { min, max }); });
    }
  };

  addEventListener("click", (event) => {
    const name = event.target.closest?.("[data-strip]")?.dataset.strip;
    if (name) { const there = list.find((one) => one.text === name); if (there) remove(there); else add(name); }
    if (event.target.closest?.("#strip-add")) {
      const strip = add("");
      if (strip) { strip.section.querySelector("details").open = true; strip.section.querySelector("summary").focus(); }
    }
  });
})();
