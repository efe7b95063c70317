// ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again.
import { Sensor } from "./sensor.mjs";

export const facts = ${facts};

let compiled;

async function own() {
  const place = new URL("./${p}.wasm", import.meta.url);
  if (place.protocol === "file:") return (await import("node:fs/promises")).readFile(place);
  return (await fetch(place)).arrayBuffer();
}

// A new sensor. bytes: of the .wasm where a host has them already; by default the file beside this one.
export async function createSensor(bytes) {
  if (bytes) return new Sensor(await WebAssembly.compile(bytes), facts);
  compiled ??= own().then((found) => WebAssembly.compile(found));
  return new Sensor(await compiled, facts);
}
