// Each validity has a pattern and a mark beside its colour.

export const MARKS = { ok: "✓", uncertain: "?", "not referenced": "…", invalid: "✕" };

const TILE = 8; // px
const STROKES = {
  ok: [],
  uncertain: [[0, 8, 8, 0]],
  "not referenced": [[4, 3, 4, 5]],
  invalid: [[0, 8, 8, 0], [0, 0, 8, 8]],
};

// A pattern for a canvas: the colour with strokes of the paper's.
export function patternOf(context, validity, colour, paper) {
  const tile = document.createElement("canvas");
  tile.width = tile.height = TILE;
  const ink = tile.getContext("2d");
  ink.fillStyle = colour;
  ink.fillRect(0, 0, TILE, TILE);
  ink.strokeStyle = paper;
  ink.lineWidth = 1.6;
  for (const [x, y, to, down] of STROKES[validity]) {
    for (const shift of [-TILE, 0, TILE]) {
      ink.beginPath();
      ink.moveTo(x + shift, y);
      ink.lineTo(to + shift, down);
      ink.stroke();
    }
  }
  return context.createPattern(tile, "repeat");
}
