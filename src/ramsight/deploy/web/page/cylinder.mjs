// The cylinder to scale: barrel, piston, rod, the 95 % band of the piston, and a rule.
import { ticks } from "chart";

const NAMESPACE = "http://www.w3.org/2000/svg";
const MARGIN = 8, RULE = 34; // px
const LEAST = 3; // px that a band is drawn wide at least

function part(name, attributes, text) {
  const one = document.createElementNS(NAMESPACE, name);
  for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
  if (text !== undefined) one.textContent = text;
  return one;
}

export class Cylinder {
  constructor(svg) {
    this.svg = svg;
  }

  // shape: bore, rod and stroke [m].
  show({ bore, rod, stroke }) {
    const width = this.svg.clientWidth;
    const piston = 0.35 * bore, cap = 0.25 * bore, eye = 0.8 * rod;
    const total = 2 * cap + 2 * piston + 2 * stroke + 2 * eye;
    const scale = Math.min((width - 2 * MARGIN) / total, 150 / bore);
    const high = Math.max(bore * scale, 6), middle = MARGIN + high / 2;
    const left = (width - total * scale) / 2;
    const inside = left + (eye + cap) * scale; // where the piston's back is at 0
    this.at = (position) => inside + position * scale;
    Object.assign(this, { stroke, scale, pistonWidth: piston * scale });
    const bottom = middle + high / 2;
    const rodHigh = Math.max(rod * scale, 2);
    const end = inside + (stroke + piston) * scale; // inner face of the rod's side
    this.svg.setAttribute("viewBox", `0 0 ${width} ${bottom + RULE}`);
    this.svg.style.height = `${bottom + RULE}px`;
    const wall = Math.max(0.04 * bore * scale, 2);
    this.rod = part("rect", { class: "rod", y: middle - rodHigh / 2, height: rodHigh });
    this.piston = part("rect", { class: "piston", y: middle - high / 2 + wall, height: high - 2 * wall, width: this.pistonWidth, rx: 2 });
    this.band = part("rect", { class: "band", y: middle - high / 2 - 4, height: high + 8 });
    this.eye = part("circle", { class: "eye", cy: middle, r: Math.max((eye * scale) / 2, 3) });
    this.pointer = part("path", { class: "pointer" });
    this.bottom = bottom;
    this.svg.replaceChildren(
      part("circle", { class: "eye", cx: left + (eye * scale) / 2, cy: middle, r: Math.max((eye * scale) / 2, 3) }),
      part("rect", { class: "oil a", x: inside, y: middle - high / 2, width: end - inside, height: high }),
      this.oilB = part("rect", { class: "oil b", y: middle - high / 2, height: high }),
      this.rod,
      this.eye,
      this.piston,
      part("rect", { class: "wall", x: inside, y: middle - high / 2, width: end - inside, height: wall }),
      part("rect", { class: "wall", x: inside, y: bottom - wall, width: end - inside, height: wall }),
      part("rect", { class: "wall", x: inside - cap * scale, y: middle - high / 2, width: cap * scale, height: high, rx: 2 }),
      part("rect", { class: "wall", x: end, y: middle - high / 2, width: cap * scale, height: (high - rodHigh) / 2 }),
      part("rect", { class: "wall", x: end, y: middle + rodHigh / 2, width: cap * scale, height: (high - rodHigh) / 2 }),
      this.band,
      ...this.#rule(),
      this.pointer,
    );
    Object.assign(this, { end, eyeAtRest: end + (cap + piston + eye / 2) * scale });
  }

  *#rule() {
    const y = this.bottom + 8;
    yield part("path", { class: "rule", d: `M${this.at(0)} ${y}H${this.at(this.stroke)}` });
    for (const mm of ticks(0, 1e3 * this.stroke, Math.max((this.stroke * this.scale) / 60, 2))) {
      const x = this.at(mm / 1e3);
      yield part("path", { class: "rule", d: `M${x} ${y}v5` });
      yield part("text", { class: "number", x, y: y + 18, "text-anchor": "middle" }, mm ? String(mm) : "0 mm");
    }
  }

  // position, low, high [m]; NaN is a position that nobody knows.
  move(position, low, high) {
    const known = Number.isFinite(position);
    this.svg.classList.toggle("unknown", !known);
    const at = this.at(known ? position : this.stroke / 2);
    const face = at + this.pistonWidth;
    const reach = at - this.at(0) + this.eyeAtRest;
    const set = (one, attributes) => Object.entries(attributes).forEach(([key, value]) => one.setAttribute(key, value));
    set(this.piston, { x: at });
    set(this.rod, { x: face, width: Math.max(reach - face, 0) });
    set(this.eye, { cx: reach });
    set(this.oilB, { x: face, width: Math.max(this.end - face, 0) });
    const from = this.at(known ? low : 0), to = this.at(known ? high : this.stroke);
    const wide = Math.max(to - from, LEAST);
    set(this.band, { x: (from + to - wide) / 2, width: wide });
    set(this.pointer, { d: known ? `M${at} ${this.bottom + 8}l-5 -8h10z` : "" });
  }
}
