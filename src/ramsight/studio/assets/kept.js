// What the strips keep of a run: every sample of the newest, and some each second of all that was before.
"use strict";
studio.keeper = () => {
  const FINE = 1500, COARSE = 18000, SLACK = 1.1; // samples; so many times as much before the oldest goes, which costs
  const APART = 0.2; // s between samples of what is kept coarsely: an hour of them
  const fine = { time: [] }, coarse = { time: [] };

  function forget() {
    for (const rows of [fine, coarse]) for (const row of Object.values(rows)) row.length = 0;
  }

  function take(time, columns) {
    const before = fine.time.length, none = time.map(() => null);
    for (const name of new Set([...Object.keys(fine), ...Object.keys(columns)])) // columns stay beside each other, whenever one begins or ends
      (fine[name] ??= Array(before).fill(null)).push(...(name === "time" ? time : columns[name] ?? none));
    const over = fine.time.length - FINE;
    if (over < (SLACK - 1) * FINE) return;
    let last = coarse.time.at(-1) ?? -Infinity;
    const kept = [...Array(over).keys()].filter((k) => fine.time[k] - last >= APART && ((last = fine.time[k]), true));
    const had = coarse.time.length;
    for (const [name, row] of Object.entries(fine)) {
      const before = (coarse[name] ??= Array(had).fill(null));
      before.push(...kept.map((k) => row[k]));
      row.splice(0, over);
      if (before.length > SLACK * COARSE) before.splice(0, before.length - COARSE);
    }
  }

  // The first place of a time, or a later one.
  function placed(times, at) {
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < at) low = middle + 1; else high = middle;
    }
    return low;
  }

  // Columns between two times, and a sample beside them on each side so that lines go to the edge.
  function between(names, from, to) {
    const parts = [coarse, fine].map((rows) => [rows, placed(rows.time, from) - 1, placed(rows.time, to) + 1]);
    return names.map((name) => parts.flatMap(([rows, begin, end]) => rows[name]?.slice(Math.max(begin, 0), end) ?? []));
  }

  const reach = () => [coarse.time[0] ?? fine.time[0] ?? 0, fine.time.at(-1) ?? 0];
  return { fine, take, forget, between, reach };
};
