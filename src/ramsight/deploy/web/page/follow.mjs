// Runs a sensor over a log and keeps what the page shows of it.

const MOST = 40000; // moments that are kept of a log, however long it is
const AT_ONCE = 20000; // samples between two breaths of the page

// log: arrays in SI units; names: outputs that are kept; told: called with the share that is done.
// Returns { time, samples, ...names }: an array each, of the moments that are kept.
export async function follow(sensor, log, names, told) {
  const samples = log.time.length;
  const every = Math.ceil(samples / MOST);
  const count = Math.ceil(samples / every);
  const kept = Object.fromEntries(["time", ...names].map((name) => [name, new Float64Array(count)]));
  const sample = {};
  const inputs = ["time", "motorSpeed", "motorTorque", "oilTemperature"];
  for (let k = 0; k < samples; k++) {
    for (const name of inputs) sample[name] = log[name][k];
    const said = sensor.step(sample);
    // The last sample of each group, so that the last one of all is kept.
    if ((k + 1) % every === 0 || k + 1 === samples) {
      const place = Math.floor(k / every);
      kept.time[place] = log.time[k];
      for (const name of names) kept[name][place] = said[name];
    }
    if ((k + 1) % AT_ONCE === 0) {
      told((k + 1) / samples);
      await new Promise((resume) => setTimeout(resume));
    }
  }
  return { ...kept, samples };
}

// Values over one time at the moments of another, straight between two; the last one
// holds for one more interval, and beyond both ends is NaN.
export function between(moments, time, values) {
  const found = new Float64Array(moments.length).fill(NaN);
  for (let k = 0, at = 0; k < moments.length; k++) {
    while (at + 2 < time.length && time[at + 1] < moments[k]) at++;
    const share = (moments[k] - time[at]) / (time[at + 1] - time[at]);
    if (share >= 0 && share < 2) found[k] = values[at] + Math.min(share, 1) * (values[at + 1] - values[at]);
  }
  return found;
}
