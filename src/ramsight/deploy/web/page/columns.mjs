// Which column of a log is which quantity, in which unit, and its values in SI units.

const scaled = (factor, ...names) => ({ names, toSI: (value) => value * factor });

export const QUANTITIES = {
  time: {
    label: "Time",
    found: /time|zeit|^t\b|^t_|stamp/i,
    units: { s: scaled(1, "s", "sec"), ms: scaled(1e-3, "ms"), "µs": scaled(1e-6, "us", "µs"), min: scaled(60, "min") },
  },
  motorSpeed: {
    label: "Motor speed",
    found: /speed|drehzahl|rpm|velocity|omega/i,
    signed: true,
    units: {
      rpm: scaled(Math.PI / 30, "rpm", "1/min", "min-1", "u/min", "r/min"),
      "rad/s": scaled(1, "rad/s", "rad_s", "radps"),
      "1/s": scaled(2 * Math.PI, "1/s", "rps"),
    },
  },
  motorTorque: {
    label: "Motor torque",
    found: /torque|moment/i,
    signed: true,
    units: { "N m": scaled(1, "nm", "n m", "n·m"), "kN m": scaled(1e3, "knm"), "lbf ft": scaled(1.3558179483314004, "lbfft", "lbf ft") },
  },
  oilTemperature: {
    label: "Oil temperature",
    found: /temp/i,
    constant: "40",
    units: {
      "°C": { names: ["c", "°c", "degc", "celsius"], toSI: (value) => value + 273.15 },
      K: scaled(1, "k"),
      "°F": { names: ["f", "°f", "degf"], toSI: (value) => (value - 32) / 1.8 + 273.15 },
    },
  },
  position: {
    label: "Measured position",
    found: /pos|hub|weg/i,
    optional: true,
    units: { mm: scaled(1e-3, "mm"), cm: scaled(1e-2, "cm"), m: scaled(1, "m") },
  },
};

// The unit at the end of a column's name: `speed_rpm`, `Speed [rpm]`, `Speed (rpm)`.
function unitIn(name, units) {
  const said = (/[[(]\s*([^\])]+?)\s*[\])]\s*$/.exec(name) ?? /_([^_]+)$/.exec(name) ?? [])[1]?.toLowerCase();
  return Object.keys(units).find((unit) => units[unit].names.includes(said));
}

// For each quantity the number of its column (-1: none), its unit, and whether its sign is reversed.
export function guess(names) {
  const taken = new Set();
  const found = {};
  for (const [key, { found: pattern, units }] of Object.entries(QUANTITIES)) {
    const fits = names.map((name, k) => k).filter((k) => pattern.test(names[k]) && !taken.has(k));
    const best = fits.find((k) => unitIn(names[k], units)) ?? fits[0] ?? -1;
    taken.add(best);
    found[key] = { column: best, unit: (best >= 0 && unitIn(names[best], units)) || Object.keys(units)[0], reversed: false };
  }
  return found;
}

// Quantities that a log needs and that have neither a column nor a constant.
export function lacking(choice) {
  return Object.keys(QUANTITIES).filter((key) => {
    const { optional, constant } = QUANTITIES[key];
    return !optional && choice[key].column < 0 && !(constant && Number.isFinite(Number(choice[key].constant ?? NaN)));
  });
}

// The quantities of a table in SI units, arrays by name; the measured position only where there is one.
export function quantities(table, choice) {
  const rows = table.columns[0].length;
  const found = {};
  for (const [key, { units, optional }] of Object.entries(QUANTITIES)) {
    const { column, unit, reversed, constant } = choice[key];
    if (column < 0 && optional) continue;
    const { toSI } = units[unit];
    const sign = reversed ? -1 : 1;
    found[key] = column < 0 ? new Float64Array(rows).fill(toSI(Number(constant))) : table.columns[column].map((value) => sign * toSI(value));
  }
  const begin = found.time.find((value) => !Number.isNaN(value)) ?? 0;
  found.time = found.time.map((value) => value - begin);
  return found;
}
