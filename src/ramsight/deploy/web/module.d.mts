// ${title}. Made by ramsight ${version} from the machine "${machine}"; do not edit, export it again.

/** What the drive reports; SI units. What is left out is missing. */
export interface Sample {
${inputs}
}

/** What the sensor says after a sample; SI units. */
export interface Estimate {
${outputs}
  /** Below 10 ok, below 30 uncertain, below 40 not referenced, else invalid. */
  status: number;
  validity: ${validities};
  /** The status in words. */
  text: string;
}

export interface Sensor {
  /** Begin again at a known position [m] with a standard deviation [m]; false if one of them cannot be. */
  start(position: number, std: number): boolean;
  /** The piston is at this position [m] at the next sample: a switch, a hand. */
  reference(position: number): void;
  /** Take one sample, every 1 to 100 ms. */
  step(sample: Sample): Estimate;
  /** After each step: which slot of lasting memory has to be written now, before the motor turns; null if none. */
  keep(starts?: boolean): { slot: 0 | 1; bytes: Uint8Array } | null;
  /** At power-up: begin with what two slots say. Only "resumed" gives a position. */
  resume(
    instance: number,
    slot0: Uint8Array | null,
    slot1: Uint8Array | null,
  ): "nothing" | "resumed" | "older" | "moved";
}

export const facts: {
  machine: string;
  unit: string;
  stroke: number;
  inputs: string[];
  outputs: string[];
  status: Record<number, [string, string]>;
};

/** A new sensor. bytes: of the .wasm where a host has them already; by default the file beside the module. */
export function createSensor(bytes?: BufferSource): Promise<Sensor>;
