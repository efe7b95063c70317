// The time of the strips: one cursor for all, a part of the time to look at, marks of what happened, a picture.
"use strict";
studio.timeline = (() => {
  const KEPT = 500; // marks
  const LEAST = 4; // pixels; a drag that is shorter is a click
  const place = (id) => document.getElementById(id);
  let marks = [], stands = false;

  // Only the cursor goes to the other strips: what is dragged over in one is set for all by `zoomed`.
  const moves = (type) => type === "mousemove" || type === "mouseleave";
  const cursor = { drag: { x: true, y: false, setScale: false }, sync: { key: "strips", filters: { pub: moves, sub: moves } } };

  // What is drawn then is a copy: what the strips keep goes on.
  function stand(on) {
    if (on && !stands) for (const { plot } of studio.plots()) plot.setData(plot.data.map((row) => row.slice()), false);
    stands = on;
    place("strips-pause")?.setAttribute("aria-pressed", `${on}`);
  }

  function zoomed(plot) {
    const { left, width } = plot.select;
    if (width < LEAST) return;
    const [min, max] = [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")];
    plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    stand(true);
    for (const one of studio.plots()) one.plot.setScale("x", { min, max });
  }

  function whole() {
    stand(false);
    studio.draw();
  }

  function happened(more) {
    marks.push(...more);
    marks = marks.slice(-KEPT);
  }

  // A line in each strip; its words are in the first one, each below the last where they are close.
  function marked(plot) {
    const { ctx, bbox } = plot, ratio = devicePixelRatio || 1, size = 11 * ratio, named = studio.plots().find((one) => !one.place.hidden)?.plot === plot;
    ctx.save();
    ctx.strokeStyle = ctx.fillStyle = studio.css("--soft");
    ctx.font = `${size}px sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    ctx.lineWidth = ratio;
    ctx.setLineDash([3 * ratio, 3 * ratio]);
    let row = 0, end = -1;
    for (const [time, words] of marks) {
      if (!studio.upright(plot, time) || !named) continue;
      const x = plot.valToPos(time, "x", true), wide = ctx.measureText(words).width, from = Math.min(x + 3 * ratio, bbox.left + bbox.width - wide);
      row = from < end ? row + 1 : 0;
      end = from + wide;
      if ((row + 1) * 1.2 * size < bbox.height) ctx.fillText(words, from, bbox.top + (row + 1) * 1.2 * size);
    }
    ctx.restore();
  }

  function picture() {
    const all = studio.plots(), ratio = devicePixelRatio || 1, head = 20 * ratio;
    const sheet = document.createElement("canvas"), ctx = sheet.getContext("2d");
    sheet.width = Math.max(...all.map((one) => one.plot.ctx.canvas.width));
    sheet.height = all.reduce((sum, one) => sum + head + one.plot.ctx.canvas.height, 0);
    ctx.fillStyle = studio.css("--paper");
    ctx.fillRect(0, 0, sheet.width, sheet.height);
    let y = 0;
    for (const { plot, title } of all) {
      ctx.font = `600 ${13 * ratio}px sans-serif`;
      ctx.fillStyle = studio.css("--ink");
      const lines = plot.series.slice(1).filter((one) => one.label && one.width > 0);
      ctx.fillText(title, 8 * ratio, y + 0.75 * head);
      let x = 8 * ratio + ctx.measureText(title).width + 16 * ratio;
      ctx.font = `${12 * ratio}px sans-serif`;
      for (const one of lines) {
        ctx.fillStyle = one._stroke ?? studio.css("--ink");
        ctx.fillText(one.label, x, y + 0.75 * head);
        x += ctx.measureText(one.label).width + 12 * ratio;
      }
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
    if (id === "strips-pause") stands ? whole() : stand(true);
    if (id === "strips-whole") whole();
    if (id === "strips-picture") picture();
  });

  return { cursor, zoomed, whole, happened, marked, stands: () => stands, marks: () => marks, forget: () => { marks = []; stand(false); } };
})();
