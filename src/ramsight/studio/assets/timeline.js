// The time of the strips: one cursor for all, how much of it is shown, marks of what happened, a picture.
"use strict";
studio.timeline = (() => {
  const KEPT = 500; // marks
  const LEAST = 4; // pixels; a drag that is shorter is a click
  const place = (id) => document.getElementById(id);
  const SPANS = { "30s": 30, "2min": 120, "10min": 600, all: Infinity }; // s
  let marks = [], part = null, span = SPANS["2min"]; // what stands, from and to; else the newest

  // Only the cursor goes to the other strips: what is dragged over in one is set for all by `zoomed`.
  const moves = (type) => type === "mousemove" || type === "mouseleave";
  const cursor = { drag: { x: true, y: false, setScale: false }, sync: { key: "strips", filters: { pub: moves, sub: moves } } };

  // What is shown of a time that is kept; the slider stands where that ends.
  function shown(first, newest) {
    const found = part ?? [Math.max(first, newest - span), Math.max(newest, first + 1e-3)], back = place("strips-back");
    if (!back) return found;
    const least = Math.min(first + span, newest);
    Object.assign(back, { min: least, max: newest, disabled: least >= newest });
    if (back !== document.activeElement || !part) back.value = found[1];
    back.setAttribute("aria-valuetext", `${found[0].toFixed(0)} to ${found[1].toFixed(0)} s`);
    return found;
  }

  // A part that stands while the machine goes on; none for the newest.
  function stand(on) {
    part = on;
    place("strips-pause")?.setAttribute("aria-pressed", `${part !== null}`);
    studio.draw(true);
  }

  function zoomed(plot) {
    const { left, width } = plot.select;
    if (width < LEAST) return;
    const over = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    stand(over);
  }

  const now = () => shown(...studio.reach());
  const whole = () => stand(null);

  function spanned(name) {
    span = SPANS[name] ?? span;
    for (const one of document.querySelectorAll("[data-span]")) one.setAttribute("aria-pressed", `${SPANS[one.dataset.span] === span}`);
    stand(null);
  }

  function happened(more) {
    marks.push(...more);
    marks = marks.slice(-KEPT);
  }

  // The rows of words from left to right, each with begin and end, so that none is over another.
  function rows(spans) {
    const ends = [];
    return spans.map(([from, end]) => {
      let row = ends.findIndex((one) => one <= from);
      if (row < 0) row = ends.length;
      ends[row] = end;
      return row;
    });
  }

  // A line in each strip for what has happened to the unit that is shown; its words are in the first one.
  function marked(plot) {
    const { ctx, bbox } = plot, ratio = devicePixelRatio || 1, size = 11 * ratio, named = studio.plots()[0]?.plot === plot;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = studio.css("--soft");
    ctx.font = `${size}px sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.lineWidth = ratio;
    ctx.setLineDash([3 * ratio, 3 * ratio]);
    const own = marks.filter(([time, , unit]) => (!unit || unit === studio.shown()) && studio.upright(plot, time));
    const spans = own.map(([time, words]) => {
      const wide = ctx.measureText(words).width, from = Math.min(plot.valToPos(time, "x", true) + 3 * ratio, bbox.left + bbox.width - wide);
      return [from, from + wide + 6 * ratio];
    });
    if (named) rows(spans).forEach((row, k) => {
      if ((row + 1) * 1.2 * size < bbox.height) ctx.fillText(own[k][1], spans[k][0], bbox.top + (row + 1) * 1.2 * size);
    });
    ctx.restore();
  }

  async function picture() {
    studio.draw(true);
    await new Promise((done) => setTimeout(done)); // uPlot draws once this is over
    const all = studio.plots(), ratio = devicePixelRatio || 1, head = 20 * ratio;
    const sheet = document.createElement("canvas"), ctx = sheet.getContext("2d");
    sheet.width = Math.max(...all.map((one) => one.plot.ctx.canvas.width));
    sheet.height = all.reduce((sum, one) => sum + head + one.plot.ctx.canvas.height, 0);
    ctx.fillStyle = studio.css("--paper");
    ctx.fillRect(0, 0, sheet.width, sheet.height);
    let y = 0;
    for (const { plot, lanes, title } of all) {
      ctx.font = `600 ${13 * ratio}px sans-serif`;
      ctx.fillStyle = studio.css("--ink");
      const lines = plot.series.slice(1).filter((one) => one.label && one.width > 0), levels = plot.root.parentElement.querySelectorAll("[data-level]");
      ctx.fillText(title, 8 * ratio, y + 0.75 * head);
      let x = 8 * ratio + ctx.measureText(title).width + 16 * ratio;
      ctx.font = `${12 * ratio}px sans-serif`;
      for (const one of lines) {
        ctx.fillStyle = one._stroke ?? studio.css("--ink");
        ctx.fillText(one.label, x, y + 0.75 * head);
        x += ctx.measureText(one.label).width + 12 * ratio;
      }
      ctx.fillStyle = studio.css("--ink");
      if (lanes) ctx.fillText([...levels].map((one) => one.textContent).join(", "), x, y + 0.75 * head);
      ctx.drawImage(plot.ctx.canvas, 0, y + head);
      y += head + plot.ctx.canvas.height;
    }
    const link = document.createElement("a");
    link.download = `${studio.shown()}-strips.png`;
    link.href = sheet.toDataURL("image/png");
    link.click();
  }

  addEventListener("click", (event) => {
    const id = event.target.closest?.("button")?.id;
    if (id === "strips-pause") stand(part ? null : now());
    if (id === "strips-whole") whole();
    if (id === "strips-picture") picture();
    const name = event.target.closest?.("[data-span]")?.dataset.span;
    if (name) { spanned(name); studio.renew(); }
  });
  addEventListener("input", ({ target }) => {
    if (target.id !== "strips-back") return;
    const to = Number(target.value);
    stand(to >= Number(target.max) ? null : [to - Math.min(span, to - studio.reach()[0]), to]);
  });

  return {
    cursor, rows, zoomed, whole, happened, marked, spanned, window: shown, stands: () => part !== null, marks: () => marks,
    span: () => Object.keys(SPANS).find((one) => SPANS[one] === span), forget: () => { marks = []; part = null; place("strips-pause")?.setAttribute("aria-pressed", "false"); },
  };
})();
