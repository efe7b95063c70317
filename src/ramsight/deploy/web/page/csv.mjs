// Reads a table of numbers as drives and spreadsheets write it: commas, semicolons or tabs between the fields, decimal points
// or commas, lines before the heading, a line of units below it.

const SEPARATORS = ["\t", ";", ","];
const LOOKED_AT = 60; // lines in which the heading is looked for

// A field as a number; a clock or a date as seconds; NaN is anything else.
function numberOf(field, decimalComma) {
  const text = decimalComma ? field.replaceAll(".", "").replace(",", ".") : field;
  if (text.trim() === "") return NaN;
  const value = Number(text);
  return Number.isNaN(value) ? secondsOf(field) : value;
}

function secondsOf(field) {
  const clock = /^(.*?)[T ]?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)\D*$/.exec(field.trim());
  if (!clock) return NaN;
  const day = clock[1] ? Date.parse(clock[1]) / 1000 : 0;
  return day + 3600 * Number(clock[2]) + 60 * Number(clock[3]) + Number(clock[4].replace(",", "."));
}

const unquoted = (field) => field.trim().replace(/^"(.*)"$/, "$1");

// Text of a file as { names, columns }: a Float64Array each. Throws an Error that says what is missing.
export function readTable(text) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r\n|\n|\r/).filter((line) => line.trim() !== "");
  if (lines.length < 2) throw new Error("The file has no rows.");
  const top = lines.slice(0, LOOKED_AT);
  // The separator that most lines have equally often; a comma last, because it may be a decimal one.
  const separator = SEPARATORS.find((one) => top.filter((line) => line.includes(one)).length > top.length / 2) ?? ",";
  const rows = top.map((line) => line.split(separator).map(unquoted));
  const decimalComma = separator !== "," && rows.flat().some((field) => /^[+-]?[\d.]*\d,\d+(e[+-]?\d+)?$/i.test(field));
  const isNumber = (field) => !Number.isNaN(numberOf(field, decimalComma));
  const isData = (row) => row.length > 1 && row.filter(isNumber).length >= row.length / 2;
  const first = rows.findIndex((row, k) => isData(row) && (k + 1 === rows.length || isData(rows[k + 1])));
  if (first < 0) throw new Error("The file has no rows of numbers with one of tab, semicolon and comma between them.");
  const width = rows[first].length;
  const headings = rows.slice(Math.max(first - 2, 0), first).filter((row) => row.length === width);
  const names = rows[first].map((_, k) => {
    const said = headings.map((row) => row[k]).filter(Boolean);
    return said.length === 2 ? `${said[0]} [${said[1]}]` : said[0] || `column ${k + 1}`;
  });
  const columns = names.map(() => new Float64Array(lines.length - first));
  for (let k = first; k < lines.length; k++) {
    const fields = lines[k].split(separator);
    for (let c = 0; c < width; c++) columns[c][k - first] = c < fields.length ? numberOf(unquoted(fields[c]), decimalComma) : NaN;
  }
  return { names, columns };
}
