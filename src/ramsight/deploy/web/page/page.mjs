// The page: a machine, a log, and what its sensor says of it.
import { Charts } from "chart";
import { QUANTITIES, guess, lacking, quantities } from "columns";
import { readTable } from "csv";
import { Cylinder } from "cylinder";
import { between, follow } from "follow";
import { MARKS } from "pattern";
import { Sensor } from "sensor";

const MACHINES = JSON.parse(document.getElementById("machines").textContent);
const START_STD = 1e-3; // m, of a position that somebody enters
const HIGH_95 = 1.96; // standard deviations
const LEAST_WIDTH = 100; // px in which something can be drawn
const KEPT = ["position", "positionLow", "positionHigh", "positionBound", "status", "load", "leakFactor", "leakFactorStd", "displacementFactor", "displacementFactorStd"];
const THEME = ["paper", "grid", "soft", "line", "band", "truth", "ok", "uncertain", "not-referenced", "invalid"];

const by = (id) => document.getElementById(id);
const at = { machine: MACHINES[0], table: null, choice: null, truth: null, track: null, place: 0, playing: 0, run: 0 };

function theme() {
  const style = getComputedStyle(document.body);
  return Object.fromEntries(THEME.map((name) => [name.replace("-", " "), style.getPropertyValue(`--${name}`).trim()]));
}

const cylinder = new Cylinder(by("cylinder"));
const charts = new Charts(by("position-chart"), by("sureness-chart"), theme);

async function inflated(stream) {
  return new Response(stream.pipeThrough(new DecompressionStream("gzip")));
}

const packed = (text) => inflated(new Blob([Uint8Array.from(atob(text), (one) => one.charCodeAt(0))]).stream());

async function sensorOf(machine) {
  machine.module ??= WebAssembly.compile(await (await packed(machine.wasm)).arrayBuffer());
  return new Sensor(await machine.module, machine.facts);
}

// Logs ---------------------------------------------------------------------------------------------------------------

async function example() {
  const { machine } = at;
  const log = readTable(await (await packed(machine.log)).text());
  const truth = readTable(await (await packed(machine.truth)).text());
  by("log-name").textContent = machine.note;
  by("start").value = "";
  take(log, { time: truth.columns[0], position: truth.columns[1] });
}

async function open(file) {
  pause();
  try {
    const text = file.name.endsWith(".gz") ? await (await inflated(file.stream())).text() : await file.text();
    const table = readTable(text);
    by("log-name").textContent = `${file.name}, ${table.columns[0].length.toLocaleString("en")} rows`;
    take(table, null);
  } catch (error) {
    refuse(`${file.name}: ${error.message}`);
  }
}

function take(table, truth) {
  at.table = table;
  at.truth = truth;
  at.choice = guess(table.names);
  drawForm();
  return rerun();
}

function refuse(text) {
  by("message").textContent = text;
}

async function rerun() {
  const run = ++at.run;
  pause();
  refuse("");
  const missing = lacking(at.choice);
  by("columns").open ||= missing.length > 0;
  if (missing.length) {
    refuse(`Say which column is the ${missing.map((key) => QUANTITIES[key].label.toLowerCase()).join(", the ")}: under "Columns of the log".`);
    return;
  }
  const { machine } = at;
  const { facts } = machine;
  const log = quantities(at.table, at.choice);
  const sensor = await sensorOf(machine);
  const start = by("start").value.trim().replace(",", ".");
  if (start !== "" && !sensor.start(Number(start) / 1e3, START_STD)) {
    refuse(`The position at the start has to be within the stroke, 0 to ${1e3 * facts.stroke} mm.`);
    return;
  }
  const names = [...KEPT, ...Object.keys(machine.hypotheses)].filter((name) => facts.outputs.includes(name));
  const found = await follow(sensor, log, names, (share) => run === at.run && refuse(`${Math.round(100 * share)} %`));
  if (run !== at.run) return; // another log or machine was chosen meanwhile
  found.validity = Array.from(found.status, (number) => facts.status[number][0]);
  const truth = log.position ? { time: log.time, position: log.position } : at.truth;
  if (truth) found.truth = between(found.time, truth.time, truth.position);
  at.track = found;
  refuse(found.position.some(Number.isFinite) ? "" : advice(found));
  document.body.dataset.samples = found.samples;
  for (const one of document.querySelectorAll(".truth-key")) one.hidden = !truth;
  layout();
  goTo(found.time.length - 1);
}

// Why there is no position, and what to do.
function advice({ validity }) {
  const referenced = validity.every((one) => one === "not referenced");
  return referenced
    ? "No end stop was met in this log, so nobody knows where the piston is. Enter its position at the start, under \"Columns of the log\"."
    : "The sensor accepts none of these samples: look at units and signs, under \"Columns of the log\".";
}

// What is shown of a moment ------------------------------------------------------------------------------------------

const mm = (value, digits = 1) => (1e3 * value).toFixed(digits);

function goTo(place) {
  const { track, machine } = at;
  at.place = Math.min(Math.max(place, 0), track.time.length - 1);
  const k = at.place;
  const value = (name) => track[name]?.[k] ?? NaN;
  const known = Number.isFinite(value("position"));
  by("position").textContent = known ? mm(value("position")) : "unknown";
  by("position").classList.toggle("known", known);
  by("low-high").textContent = known ? `${mm(value("positionLow"))} to ${mm(value("positionHigh"))} mm` : "none";
  by("bound").textContent = known ? `${mm(value("positionBound"))} mm` : "none";
  by("leakage").textContent = factor("leakFactor");
  by("displacement").textContent = factor("displacementFactor");
  by("load").textContent = Number.isFinite(value("load")) ? `${(value("load") / 1e3).toFixed(0)} kN` : "none";
  const off = value("position") - value("truth");
  by("error").textContent = Number.isFinite(off) ? `${mm(off)} mm` : "none";
  const [validity, text] = machine.facts.status[value("status")];
  if (by("status-text").textContent !== text) {
    by("status").dataset.validity = validity;
    by("status-mark").textContent = MARKS[validity];
    by("status-text").textContent = text;
  }
  for (const [name] of Object.entries(machine.hypotheses)) {
    const row = document.querySelector(`[data-hypothesis=${name}]`);
    const share = value(name);
    row.querySelector("b").textContent = Number.isFinite(share) ? `${(100 * share).toFixed(share > 0.0005 && share < 0.1 ? 1 : 0)} %` : "–";
    row.style.setProperty("--share", Number.isFinite(share) ? share : 0);
  }
  cylinder.move(value("position"), value("positionLow"), value("positionHigh"));
  const moment = track.time[k];
  const slider = by("moment");
  slider.value = moment;
  slider.setAttribute("aria-valuetext", `${moment.toFixed(1)} seconds, position ${by("position").textContent}`);
  by("clock").textContent = `${moment.toFixed(1)} s`;
  for (const one of document.querySelectorAll(".cursor")) one.style.left = `${charts.across(moment)}px`;

  function factor(name) {
    const std = value(`${name}Std`);
    return Number.isFinite(std) ? `${value(name).toFixed(3)} ± ${(HIGH_95 * std).toFixed(3)}` : "none";
  }
}

// The newest moment that is kept until a time [s].
function placeOf(moment) {
  const { time } = at.track;
  let low = 0, high = time.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (time[middle] <= moment + 1e-9) low = middle;
    else high = middle - 1;
  }
  return low;
}

// Play ---------------------------------------------------------------------------------------------------------------

function pause() {
  cancelAnimationFrame(at.playing);
  at.playing = 0;
  by("play").textContent = "▶ Play";
}

function play() {
  if (at.playing || !at.track) return pause();
  const { time } = at.track;
  const last = time.length - 1;
  if (at.place >= last) goTo(0);
  let before = performance.now(), moment = time[at.place];
  const tick = (now) => {
    moment += ((now - before) / 1e3) * Number(by("speed").value);
    before = now;
    goTo(placeOf(moment));
    if (at.place >= last) return pause();
    at.playing = requestAnimationFrame(tick);
  };
  by("play").textContent = "❚❚ Pause";
  at.playing = requestAnimationFrame(tick);
}

// The page's parts ---------------------------------------------------------------------------------------------------

function element(name, attributes = {}, ...inside) {
  const one = document.createElement(name);
  Object.assign(one, attributes);
  one.append(...inside);
  return one;
}

function drawForm() {
  const rows = Object.entries(QUANTITIES).map(([key, { label, units, signed, constant, optional }]) => {
    const own = at.choice[key];
    const set = (change) => {
      Object.assign(own, change);
      rerun();
    };
    const without = constant ? "no column: constant" : optional ? "none" : "choose a column";
    const column = element("select", { ariaLabel: `${label}: column`, onchange: () => { steady.hidden = !constant || +column.value >= 0; set({ column: +column.value }); } },
      element("option", { value: -1, textContent: without }),
      ...at.table.names.map((name, k) => element("option", { value: k, textContent: name })));
    column.value = own.column;
    const unit = element("select", { ariaLabel: `${label}: unit`, onchange: () => set({ unit: unit.value }) },
      ...Object.keys(units).map((name) => element("option", { value: name, textContent: name })));
    unit.value = own.unit;
    if (constant) own.constant ??= constant;
    const steady = element("input", { ariaLabel: `${label}: constant value`, inputMode: "decimal", value: own.constant ?? "", hidden: !constant || own.column >= 0,
      onchange: () => set({ constant: steady.value.trim().replace(",", ".") }) });
    const reversed = element("input", { type: "checkbox", checked: own.reversed, onchange: () => set({ reversed: reversed.checked }) });
    return element("div", { className: "row" }, element("span", { textContent: label }), column, unit, steady,
      ...(signed ? [element("label", {}, reversed, " reverse the sign")] : []));
  });
  by("choices").replaceChildren(...rows);
}

function drawMachine() {
  const { hypotheses, shape, title } = at.machine;
  by("hypotheses").replaceChildren(...Object.entries(hypotheses).map(([name, words]) => {
    const row = element("li", {}, element("span", { textContent: words }), element("b"));
    row.dataset.hypothesis = name;
    return row;
  }));
  by("scale").textContent = `${title}, to scale: bore ${mm(shape.bore, 0)} mm, rod ${mm(shape.rod, 0)} mm, stroke ${mm(shape.stroke, 0)} mm`;
}

function layout() {
  if (!at.track || by("cylinder").clientWidth < LEAST_WIDTH) return;
  const { time } = at.track;
  by("moment").max = time[time.length - 1];
  cylinder.show(at.machine.shape);
  charts.show(at.track, at.machine.facts.stroke);
  goTo(at.place);
}

function choose(name) {
  pause();
  at.machine = MACHINES.find((one) => one.name === name);
  drawMachine();
  return example();
}

by("machine").replaceChildren(...MACHINES.map(({ name, title }) => element("option", { value: name, textContent: title })));
by("machine").onchange = () => choose(by("machine").value);
by("example").onclick = async () => {
  await example();
  goTo(0);
  play();
};
by("play").onclick = play;
by("moment").oninput = () => {
  pause();
  goTo(placeOf(Number(by("moment").value)));
};
by("file").onchange = () => by("file").files.length && open(by("file").files[0]);
by("start").onchange = rerun;
for (const one of document.querySelectorAll(".chart")) {
  one.onpointerdown = one.onpointermove = (event) => {
    if (!at.track || (event.type === "pointermove" && !event.buttons)) return;
    pause();
    goTo(placeOf(charts.momentAt(event.clientX - one.getBoundingClientRect().left)));
  };
}
addEventListener("dragover", (event) => {
  event.preventDefault();
  document.body.classList.add("dragged");
});
addEventListener("dragleave", (event) => event.relatedTarget || document.body.classList.remove("dragged"));
addEventListener("drop", (event) => {
  event.preventDefault();
  document.body.classList.remove("dragged");
  if (event.dataTransfer.files.length) open(event.dataTransfer.files[0]);
});
addEventListener("resize", layout);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", layout);
choose(MACHINES[0].name);
