// Runs the sensor over the golden samples, compares with what Python said, and tells how long a step takes: node test.mjs
import { readFile } from "node:fs/promises";

const read = async (name) => JSON.parse(await readFile(new URL(name, import.meta.url), "utf8"));
const { main } = await read("./package.json");
const { createSensor, facts } = await import("./" + main);
const golden = await read("./golden.json");

const ALLOWED = 1e-9; // m, of position and standard deviation
const ROUNDS = 20;
const INSTANCE = 7;
const { reference: at, ...places } = golden.columns;
const samples = golden.inputs.map((row) => {
  const sample = Object.fromEntries(Object.entries(places).map(([name, place]) => [name, row[place] ?? NaN]));
  return { sample, reference: row[at] ?? NaN };
});

function run(sensor) {
  const found = { largest: 0, missing: 0, statuses: 0 };
  if (!sensor.start(golden.start, golden.std)) found.missing++;
  samples.forEach(({ sample, reference }, k) => {
    sensor.reference(reference);
    const said = sensor.step(sample);
    const [position, std, , , status] = golden.outputs[k];
    for (const [value, expected] of [[said.position, position], [said.positionStd, std]]) {
      if (Number.isNaN(value) !== (expected === null)) found.missing++;
      else if (expected !== null) found.largest = Math.max(found.largest, Math.abs(value - expected));
    }
    if (said.status !== status || said.text !== facts.status[status][1]) found.statuses++;
  });
  return found;
}

// The piston rests: its position comes back from two whole slots, and from no others.
async function slotsWork() {
  const slots = [null, null];
  const sensor = await createSensor();
  const kept = (starts) => {
    const saved = sensor.keep(starts);
    if (saved) slots[saved.slot] = saved.bytes;
    return saved;
  };
  if (sensor.resume(INSTANCE, null, null) !== "nothing") return false;
  if (kept(true)?.slot === kept(true)?.slot || kept(true)) return false; // two at first, then none
  sensor.start(0.5 * facts.stroke, 0.001);
  let last;
  for (let k = 0; k < 100; k++) {
    last = sensor.step({ ...samples[0].sample, motorSpeed: 0, time: 0.02 * k });
    kept(false);
  }
  const back = await createSensor();
  const found = back.resume(INSTANCE, ...slots);
  if (found === "resumed") {
    const again = back.step({ ...samples[0].sample, motorSpeed: 0, time: 0 });
    if (!(Math.abs(again.position - last.position) < 1e-6)) return false;
  } else if (found !== "moved") return false; // a piston that the pump holds up does not rest while the motor stands
  if (back.resume(INSTANCE + 1, ...slots) !== "nothing") return false;
  slots[0][16] ^= 1;
  if (back.resume(INSTANCE, ...slots) !== "older") return false;
  return back.resume(INSTANCE, slots[0], Uint8Array.of(...slots[1], 0)) === "nothing"; // too long
}

const sensor = await createSensor();
const found = run(sensor);
const work = await slotsWork();
const begin = performance.now();
for (let k = 0; k < ROUNDS; k++) run(sensor);
const step = (1e6 * (performance.now() - begin)) / ROUNDS / samples.length;
const good = found.largest <= ALLOWED && !found.missing && !found.statuses && work;
console.log(
  samples.length + " samples: largest difference " + found.largest.toPrecision(2) + " m (allowed " + ALLOWED + " m), "
    + found.missing + " missing, " + found.statuses + " other statuses (allowed 0), slots " + (work ? "good" : "BAD")
    + ", " + step.toFixed(0) + " ns a step: " + (good ? "passed" : "FAILED"),
);
process.exitCode = good ? 0 : 1;
