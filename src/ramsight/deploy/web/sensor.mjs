// A sensor that is one instance of a WebAssembly module. It asks nothing of its host: the module has no imports.

const RESUMED = ["nothing", "resumed", "older", "moved"];

export class Sensor {
  #wasm;
  #inputs;
  #outputs;
  #facts;

  // module: a WebAssembly.Module; facts: names of inputs and outputs in their order, and what each status says.
  constructor(module, facts) {
    this.#wasm = new WebAssembly.Instance(module, {}).exports;
    this.#wasm._initialize();
    this.#wasm.init();
    this.#facts = facts;
    this.#inputs = this.#numbers(this.#wasm.inputs(), facts.inputs.length);
    this.#outputs = this.#numbers(this.#wasm.outputs(), facts.outputs.length);
  }

  // The memory never grows, so views of it stay valid.
  #numbers(place, count) {
    return new Float64Array(this.#wasm.memory.buffer, place, count);
  }

  #bytes(place) {
    return new Uint8Array(this.#wasm.memory.buffer, place, this.#wasm.bytes());
  }

  // Begin again at a known position [m] with a standard deviation [m]; false if one of them cannot be.
  start(position, std) {
    return this.#wasm.start(position, std) === 1;
  }

  // The piston is at this position [m] at the next sample: a switch, a hand.
  reference(position) {
    this.#wasm.reference(position);
  }

  // Take one sample; what is left out is missing.
  step(sample) {
    const { inputs, outputs, status } = this.#facts;
    for (let k = 0; k < inputs.length; k++) this.#inputs[k] = sample[inputs[k]] ?? NaN;
    const number = this.#wasm.step();
    const said = {};
    for (let k = 0; k < outputs.length; k++) said[outputs[k]] = this.#outputs[k];
    said.status = number;
    [said.validity, said.text] = status[number];
    return said;
  }

  // After each step: which slot of lasting memory is to be written now, and with what; null if none.
  keep(starts = false) {
    const slot = this.#wasm.keep(starts ? 1 : 0);
    return slot < 0 ? null : { slot, bytes: this.#bytes(this.#wasm.written()).slice() };
  }

  // At power-up: begin with what two slots say. One that is null or of another length counts as erased.
  resume(instance, slot0, slot1) {
    const there = [slot0, slot1].map((slot, number) => {
      const place = this.#bytes(this.#wasm.slot(number));
      if (slot?.length !== place.length) return 0;
      place.set(slot);
      return 1;
    });
    return RESUMED[this.#wasm.resume(instance >>> 0, ...there)];
  }
}
