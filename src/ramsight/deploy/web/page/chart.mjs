// Position over time with its band, what the status is, and how far off the band reaches: two charts with one time axis.
import { patternOf } from "pattern";

const LEFT = 46, RIGHT = 10, TOP = 10, STRIP = 14, BOTTOM = 22; // px
const STEPS = [1, 2, 5];

// Round numbers from least to most, about so many.
export function ticks(least, most, about) {
  const rough = (most - least) / about || 1;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * (STEPS.find((one) => one * power >= rough) ?? 10);
  const found = [];
  for (let k = Math.ceil(least / step - 1e-9); k * step <= most + 1e-9 * step; k++) found.push(k * step);
  return found;
}

function canvasFor(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const ink = canvas.getContext("2d");
  ink.scale(ratio, ratio);
  ink.font = "12px system-ui, sans-serif";
  return { ink, width, height };
}

const scale = (least, most, from, to) => (value) => from + ((value - least) / (most - least || 1)) * (to - from);

function axes(ink, { x, y, width, down, unit, moments, heights, theme, named }) {
  ink.strokeStyle = theme.grid;
  ink.fillStyle = theme.soft;
  ink.lineWidth = 1;
  ink.textAlign = "right";
  ink.textBaseline = "middle";
  for (const value of heights) {
    ink.beginPath();
    ink.moveTo(LEFT, Math.round(y(value)) + 0.5);
    ink.lineTo(width - RIGHT, Math.round(y(value)) + 0.5);
    ink.stroke();
    ink.fillText(String(+value.toFixed(6)), LEFT - 6, y(value));
  }
  ink.textAlign = "center";
  ink.textBaseline = "top";
  if (named) for (const value of moments) ink.fillText(`${+value.toFixed(6)}`, Math.min(x(value), width - RIGHT - 8), down + 6);
  if (named) {
    ink.textAlign = "left";
    ink.fillText(unit, 4, down + 6);
  }
}

// The area between two series, where both are numbers.
function fillBetween(ink, x, y, time, low, high) {
  let begin = -1;
  for (let k = 0; k <= time.length; k++) {
    const there = k < time.length && Number.isFinite(low[k]) && Number.isFinite(high[k]);
    if (there && begin < 0) begin = k;
    if (there || begin < 0) continue;
    ink.beginPath();
    for (let at = begin; at < k; at++) ink.lineTo(x(time[at]), y(high[at]));
    for (let at = k - 1; at >= begin; at--) ink.lineTo(x(time[at]), y(low[at]));
    ink.closePath();
    ink.fill();
    begin = -1;
  }
}

function line(ink, x, y, time, values) {
  ink.beginPath();
  let on = false;
  for (let k = 0; k < time.length; k++) {
    const there = Number.isFinite(values[k]);
    if (there && on) ink.lineTo(x(time[k]), y(values[k]));
    else if (there) ink.moveTo(x(time[k]), y(values[k]));
    on = there;
  }
  ink.stroke();
}

// The value that a share of the numbers do not exceed.
function quantile(values, share) {
  const sorted = values.filter(Number.isFinite).sort();
  return sorted.length ? sorted[Math.min(Math.floor(share * sorted.length), sorted.length - 1)] : NaN;
}

export class Charts {
  // position, sureness: canvases; theme: gives colours.
  constructor(position, sureness, theme) {
    Object.assign(this, { position, sureness, theme });
  }

  // track: what `follow` returns, with `validity` and perhaps `truth`; stroke [m].
  show(track, stroke) {
    Object.assign(this, { track, stroke });
    const half = track.position.map((value, k) => 1e3 * Math.max(track.positionHigh[k] - value, value - track.positionLow[k]));
    this.reach = 1.3 * Math.max(quantile(half, 0.6), 1) || 10;
    this.draw();
  }

  draw() {
    if (!this.track) return;
    this.#drawPosition();
    this.#drawSureness();
  }

  #frame(canvas, least, most, strip) {
    const { ink, width, height } = canvasFor(canvas);
    const { time } = this.track;
    const down = height - BOTTOM;
    const x = scale(0, time[time.length - 1], LEFT, width - RIGHT);
    const y = scale(least, most, down - strip, TOP);
    const theme = this.theme();
    const moments = ticks(0, time[time.length - 1], width / 90);
    axes(ink, { x, y, width, down, unit: "s", moments, heights: ticks(least, most, (down - strip) / 30), theme, named: true });
    ink.save();
    ink.beginPath();
    ink.rect(LEFT, TOP - 1, width - LEFT - RIGHT, down - TOP + 2);
    ink.clip();
    return { ink, x, y, theme, down, width };
  }

  #drawPosition() {
    const { time, position, positionLow, positionHigh, truth, validity } = this.track;
    const mm = (values) => values.map((value) => 1e3 * value);
    const { ink, x, y, theme, down } = this.#frame(this.position, 0, 1e3 * this.stroke, STRIP + 6);
    ink.fillStyle = theme.band;
    fillBetween(ink, x, y, time, mm(positionLow), mm(positionHigh));
    if (truth) {
      ink.strokeStyle = theme.truth;
      ink.lineWidth = 1.5;
      ink.setLineDash([5, 4]);
      line(ink, x, y, time, mm(truth));
      ink.setLineDash([]);
    }
    ink.strokeStyle = theme.line;
    ink.lineWidth = 2;
    line(ink, x, y, time, mm(position));
    const patterns = {};
    for (let begin = 0, k = 1; k <= time.length; k++) {
      if (k < time.length && validity[k] === validity[begin]) continue;
      const kind = validity[begin];
      ink.fillStyle = patterns[kind] ??= patternOf(ink, kind, theme[kind], theme.paper);
      const from = x(time[begin]);
      ink.fillRect(from, down - STRIP, Math.max(x(time[Math.min(k, time.length - 1)]) - from, 1), STRIP);
      begin = k;
    }
    ink.restore();
  }

  #drawSureness() {
    const { time, position, positionLow, positionHigh, truth } = this.track;
    const { ink, x, y, theme } = this.#frame(this.sureness, -this.reach, this.reach, 0);
    const off = (values) => values.map((value, k) => 1e3 * (value - position[k]));
    ink.fillStyle = theme.band;
    fillBetween(ink, x, y, time, off(positionLow), off(positionHigh));
    ink.lineWidth = 2;
    ink.strokeStyle = theme.line;
    line(ink, x, y, time, position.map((value) => 0 * value));
    if (truth) {
      ink.lineWidth = 1.5;
      ink.strokeStyle = theme.truth;
      line(ink, x, y, time, off(truth));
    }
    ink.restore();
  }

  // Where a moment [s] is across, in px.
  across(moment) {
    const { time } = this.track;
    return scale(0, time[time.length - 1], LEFT, this.position.clientWidth - RIGHT)(moment);
  }

  // The moment [s] at so many px.
  momentAt(px) {
    const { time } = this.track;
    const last = time[time.length - 1];
    return Math.min(Math.max(scale(LEFT, this.position.clientWidth - RIGHT, 0, last)(px), 0), last);
  }
}
